// SPDX-License-Identifier: MIT
#include "scene.hpp"

#include <algorithm>
#include <string>
#include <utility>

using namespace trephine_python;

namespace {

/// Returns whether an array has one value for all ticks; throws unless it has that or one a tick.
bool is_one_for_all(const char* who, const char* name, const py::array& a, const std::vector<py::ssize_t>& shape) {
  if (a.ndim() == 0) return true;
  bool same = a.ndim() == static_cast<py::ssize_t>(shape.size());
  for (std::size_t d = 0; same && d < shape.size(); ++d) same = a.shape(static_cast<py::ssize_t>(d)) == shape[d];
  if (!same) refuse(who, std::string(name) + " must be one for all ticks, or one for each pose", shape_text(a));
  return false;
}

void copy_vector(const Vec3d& v, double* to) noexcept { std::copy_n(v.data(), 3, to); }

}  // namespace

Inputs::Inputs(const char* who, py::ssize_t scenes, const Numbers& poses, const py::object& spindle,
               const py::object& dt)
    : poses_(poses) {
  const int first = scenes >= 0 ? 1 : 0;  // dimension of the ticks
  const auto n = static_cast<int>(poses.ndim());
  seven_ = n == first + 2 && poses.shape(n - 1) == 7;
  const bool rows = n == first + 3 && poses.shape(n - 1) == 4 && poses.shape(n - 2) == 4;
  if (!seven_ && !rows)
    refuse(who,
           first == 0 ? "poses must have the shape (N, 4, 4), or (N, 7): x y z qx qy qz qw"
                      : "poses must have the shape (scenes, N, 4, 4), or (scenes, N, 7): x y z qx qy qz qw",
           shape_text(poses));
  if (scenes >= 0 && poses.shape(0) != scenes)
    refuse(who, "the first side of poses must be the number of scenes, " + std::to_string(scenes), shape_text(poses));
  for (int d = 0; d <= first; ++d) shape_.push_back(poses.shape(d));
  ticks_ = static_cast<std::size_t>(poses.shape(first));
  pose_at_ = poses_.data();

  const auto numbers = Numbers::ensure(dt);
  if (!numbers) {
    PyErr_Clear();
    refuse(who, "dt must be a number of seconds, or an array of them", std::string(py::repr(dt)));
  }
  dt_ = numbers;
  dt_at_ = dt_.data();
  dt_step_ = is_one_for_all(who, "dt", dt_, shape_) ? 0 : 1;
  for (py::ssize_t i = 0; i < dt_.size(); ++i)
    if (!(dt_at_[i] > 0)) refuse(who, "dt must be > 0 s", dt_at_[i]);

  const auto flags = py::array::ensure(spindle);
  if (!flags || flags.dtype().kind() != 'b') {
    PyErr_Clear();
    refuse(who, "spindle must be a bool, or an array of bool", std::string(py::repr(spindle)));
  }
  spindle_ = flags;
  spindle_at_ = spindle_.data();
  spindle_step_ = is_one_for_all(who, "spindle", spindle_, shape_) ? 0 : 1;

  if (rows)  // refused before the first tick
    for (py::ssize_t i = 0; i < poses.size() / 16; ++i) check_rows(who, pose_at_ + 16 * i);
}

template <class Number>
Number* Columns::column(const char* name, std::vector<py::ssize_t> shape, bool vector) {
  if (vector) shape.push_back(3);
  py::array_t<Number> made(shape);
  dict_[name] = made;
  return made.mutable_data();
}

Columns::Columns(const std::vector<py::ssize_t>& shape, bool structures, bool law)
    : force_(column<double>("force", shape, true)),
      torque_(column<double>("torque", shape, true)),
      removed_(column<double>("removed_mm3", shape)),
      depth_(column<double>("depth", shape)),
      status_(column<std::uint8_t>("status", shape)),
      contacts_(column<std::int32_t>("contacts", shape)),
      tip_(column<bool>("tip", shape)),
      shaft_(column<bool>("shaft", shape)) {
  if (structures) {
    nearest_ = column<std::int32_t>("nearest", shape);
    distance_ = column<double>("distance", shape);
    warns_ = column<bool>("warns", shape);
    push_force_ = column<double>("push_force", shape, true);
    push_torque_ = column<double>("push_torque", shape, true);
    refused_ = column<double>("refused_mm3", shape);
    taken_ = column<double>("taken_mm3", shape);
  }
  if (law) {
    thrust_ = column<double>("thrust", shape);
    spindle_torque_ = column<double>("spindle_torque", shape);
    spindle_speed_ = column<double>("spindle_speed", shape);
    feed_ = column<double>("feed", shape);
  }
}

void Columns::put(std::size_t row, const TickResult& r) noexcept {
  copy_vector(r.wrench.force, force_ + 3 * row);
  copy_vector(r.wrench.torque, torque_ + 3 * row);
  removed_[row] = r.removed_mm3;
  depth_[row] = r.contact.depth;
  status_[row] = static_cast<std::uint8_t>(r.status);
  contacts_[row] = r.contact.count;
  tip_[row] = r.contact.tip;
  shaft_[row] = r.contact.shaft;
  if (nearest_ != nullptr) {
    nearest_[row] = r.structures.nearest;
    distance_[row] = r.structures.distance;
    warns_[row] = r.structures.warns;
    copy_vector(r.structures.push.force, push_force_ + 3 * row);
    copy_vector(r.structures.push.torque, push_torque_ + 3 * row);
    refused_[row] = r.structures.refused_mm3;
    taken_[row] = r.structures.taken_mm3;
  }
  if (thrust_ != nullptr) {
    thrust_[row] = r.cutting.thrust;
    spindle_torque_[row] = r.cutting.torque;
    spindle_speed_[row] = r.cutting.spindle;
    feed_[row] = r.cutting.feed;
  }
}
