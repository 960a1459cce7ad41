// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/any_cut.hpp>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

/// What the parts of the Python module share: options as classes of keywords, poses, and shapes of arrays.
namespace trephine_python {

namespace py = pybind11;
using namespace trephine;

/// Numbers of any array-like, copied where they are not contiguous doubles.
using Numbers = py::array_t<double, py::array::c_style | py::array::forcecast>;

void bind_options(py::module_& m);
void bind_tools(py::module_& m);
void bind_bone(py::module_& m);
void bind_structures(py::module_& m);
void bind_scene(py::module_& m);
void bind_session(py::module_& m);
void bind_scores(py::module_& m);
void bind_recording(py::module_& m);
void bind_batch(py::module_& m);

/// An enumeration of Python's own kind, so that an array of numbers compares with it.
inline void int_enum(py::module_& m, const char* name, const std::vector<std::pair<const char*, int>>& values,
                     const char* doc) {
  py::dict members;
  for (const auto& [key, value] : values) members[key] = value;
  m.attr(name) = py::module_::import("enum").attr("IntEnum")(name, members, py::arg("module") = m.attr("__name__"));
  m.attr(name).attr("__doc__") = doc;
}

/// Ends the call with what a signal's handler raises, as Ctrl-C. Under Python's lock.
inline void raise_signals() {
  if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

/// Text as "(3, 4)", for messages.
[[nodiscard]] inline std::string shape_text(const py::array& a) { return py::str(a.attr("shape")); }

/// Throws std::invalid_argument where the last row of a matrix is finite and not 0 0 0 1: a mistake that no tick
/// reports.
inline void check_rows(const char* who, const double* m) {
  if (m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1) return;
  for (int j = 12; j < 16; ++j)
    if (!is_finite(m[j])) return;
  std::string row = std::to_string(m[12]);
  for (int j = 13; j < 16; ++j) row += " " + std::to_string(m[j]);
  refuse(who, "the last row of a pose must be 0 0 0 1; is it transposed?", row);
}
/// Pose of 16 numbers, the rows of a matrix. With a last row that is not finite the pose is not either.
[[nodiscard]] inline Posed pose_of_rows(const double* m) noexcept {
  Posed X = Posed::Identity();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 4; ++j) X(i, j) = m[4 * i + j];
  if (!is_finite(m[12] + m[13] + m[14] + m[15])) X.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
  return X;
}
/// Pose of a position and a quaternion x y z w. One whose length is more than kRotationTolerance off 1 is no rotation,
/// and gives a pose that is not finite.
[[nodiscard]] inline Posed pose_of_seven(const double* v) noexcept {
  const Eigen::Vector4d xyzw(v[3], v[4], v[5], v[6]);
  const double length = xyzw.norm();
  if (std::abs(length - 1) <= kRotationTolerance)
    return make_pose<double>(Quatd(Eigen::Vector4d(xyzw / length)).toRotationMatrix(), Vec3d(v[0], v[1], v[2]));
  Posed X = Posed::Identity();
  X.translation().setConstant(std::numeric_limits<double>::quiet_NaN());
  return X;
}
[[nodiscard]] inline Posed to_pose(const char* who, const Numbers& a) {
  if (a.ndim() == 2 && a.shape(0) == 4 && a.shape(1) == 4) {
    check_rows(who, a.data());
    return pose_of_rows(a.data());
  }
  if (a.ndim() == 1 && a.shape(0) == 7) return pose_of_seven(a.data());
  refuse(who, "a pose must have the shape (4, 4), or (7,): x y z qx qy qz qw", shape_text(a));
}
[[nodiscard]] inline py::array_t<double> from_pose(const Posed& X) {
  py::array_t<double> a({4, 4});
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j < 4; ++j) a.mutable_at(i, j) = i < 3 ? X(i, j) : j == 3 ? 1 : 0;
  return a;
}
[[nodiscard]] inline py::array_t<double> from_vector(const Vec3d& v) { return py::array_t<double>(3, v.data()); }

/// Lengths along x, y, z from three numbers, or from one for all.
[[nodiscard]] inline Vec3d to_spacing(const char* who, const Numbers& a) {
  if (a.ndim() == 0) return Vec3d::Constant(*a.data());
  if (a.ndim() == 1 && a.shape(0) == 3) return {a.at(0), a.at(1), a.at(2)};
  refuse(who, "spacing must be one length or three, along x, y, z", shape_text(a));
}

/// Sets options by their names, whether values are in range or not. Throws TypeError for a name that is none.
template <class T>
void set_fields(T& options, const py::dict& values) {
  const py::type type = py::type::of<T>();
  const py::object fields = type.attr("_fields");
  const py::object view = py::cast(&options, py::return_value_policy::reference);
  const std::string name = py::str(type.attr("__name__"));
  for (const auto& [key, value] : values) {
    if (!fields.contains(key))
      throw py::type_error(name + " has no option " + std::string(py::repr(key)) + "; it has " +
                           std::string(py::str(py::str(", ").attr("join")(fields))));
    try {
      py::setattr(view, key, value);
    } catch (py::error_already_set& e) {
      if (!e.matches(PyExc_TypeError)) throw;
      throw py::type_error(name + ": " + std::string(py::str(key)) + " cannot be " + std::string(py::repr(value)));
    }
  }
}
/// The same, and throws ValueError for a value out of range.
template <class T>
void set_options(T& options, const py::dict& values) {
  set_fields(options, values);
  if constexpr (requires { options.validate(); }) options.validate();
}

/// Pickles a struct by its members, in this order.
template <class T, class... Members>
[[nodiscard]] auto pickled_members(Members T::*... members) {
  return py::pickle([=](const T& self) { return py::make_tuple(self.*members...); },
                    [=](const py::tuple& state) {
                      T made{};
                      std::size_t at = 0;
                      ((made.*members = state[at++].cast<Members>()), ...);
                      return made;
                    });
}

/// A struct of options as a Python class: keywords set fields, and the defaults are the struct's own.
template <class T>
class OptionsClass {
 public:
  OptionsClass(py::handle scope, const char* name, const char* doc) : class_(scope, name, doc) {}

  template <class Member>
  OptionsClass& field(const char* name, Member T::*member, const char* doc) {
    class_.def_readwrite(name, member, doc);
    fields_.append(name);
    return *this;
  }
  /// Adds the constructor, whose signature shows the defaults.
  py::class_<T>& done() {
    class_.attr("_fields") = py::tuple(fields_);
    const std::string name = py::str(class_.attr("__name__"));
    const T defaults{};
    const py::object view = py::cast(&defaults, py::return_value_policy::copy);
    std::string signature = "__init__(self, ";
    if (!fields_.empty()) signature += "*, ";
    for (const py::handle field : fields_) {
      const std::string getter = py::str(class_.attr(field).attr("fget").attr("__doc__"));
      std::string type = getter.substr(getter.find("-> ") + 3);
      type = type.substr(0, type.find('\n'));
      signature += std::string(py::str(field)) + ": " + type + " = " + std::string(py::repr(view.attr(field))) + ", ";
    }
    signature.erase(signature.size() - 2);
    signature += ") -> None";
    py::options plain;
    plain.disable_function_signatures();
    class_.def(py::init([](const py::kwargs& values) {
                 T made{};
                 set_options(made, values);
                 return made;
               }),
               signature.c_str());
    // A pickle holds the keywords, so that a field which another version adds has its default.
    class_.def(py::pickle(
        [](const py::object& self) {
          py::dict values;
          for (const py::handle field : self.attr("_fields")) values[field] = self.attr(field);
          return values;
        },
        [](const py::dict& values) {
          T made{};
          set_fields(made, values);
          return made;
        }));
    class_.def("__copy__", [](const T& self) { return T(self); });
    class_.def("__deepcopy__", [](const T& self, const py::dict&) { return T(self); });
    class_.def("__repr__", [name](const py::object& self) {
      std::string text = name + "(";
      for (const py::handle field : self.attr("_fields"))
        text += (text.back() == '(' ? "" : ", ") + std::string(py::str(field)) + "=" +
                std::string(py::repr(self.attr(field)));
      return text + ")";
    });
    return class_;
  }

 private:
  py::class_<T> class_;
  py::list fields_;
};

}  // namespace trephine_python

namespace pybind11::detail {

/// A point or direction among options: a tuple, from any three numbers.
template <>
struct type_caster<trephine::Vec3d> {
  PYBIND11_TYPE_CASTER(trephine::Vec3d, const_name("Tuple[float, float, float]"));
  bool load(handle from, bool) {
    const auto numbers = array_t<double, array::c_style | array::forcecast>::ensure(from);
    if (!numbers) PyErr_Clear();
    if (!numbers || numbers.ndim() != 1 || numbers.shape(0) != 3) return false;
    value = {numbers.at(0), numbers.at(1), numbers.at(2)};
    return true;
  }
  static handle cast(const trephine::Vec3d& from, return_value_policy, handle) {
    return make_tuple(from.x(), from.y(), from.z()).release();
  }
};

/// A cut is one of four classes, or None.
template <>
struct type_caster<trephine::AnyCut> {
  PYBIND11_TYPE_CASTER(trephine::AnyCut, const_name("Cut | None"));
  bool load(handle from, bool) {
    using namespace trephine;
    return from.is_none() || take<GeometricCut>(from) || take<RateLimitedCut<>>(from) || take<AdvancingCut>(from) ||
           take<PressureCut>(from);
  }
  static handle cast(const trephine::AnyCut& from, return_value_policy, handle) {
    object made = none();
    from.visit([&](const auto& cut) { made = pybind11::cast(cut); });
    return made.release();
  }

 private:
  template <class Cut>
  bool take(handle from) {
    if (!isinstance<Cut>(from)) return false;
    value = pybind11::cast<const Cut&>(from);
    return true;
  }
};

}  // namespace pybind11::detail
