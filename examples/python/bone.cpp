// SPDX-License-Identifier: MIT
#include "bone.hpp"

#include <trephine/voxel/mesh_file.hpp>

#include <pybind11/stl/filesystem.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace trephine_python;

namespace {

BonePointer make_bone(const py::object& from, const Numbers& spacing, const std::optional<Numbers>& X_WG,
                      std::optional<double> outside, bool keep_original) {
  const char* const who = "Bone";
  const py::array voxels = to_array(who, "voxels", from);
  GridGeometry geometry{.size = size_of(who, voxels), .spacing = to_spacing(who, spacing), .outside = outside};
  if (X_WG) geometry.X_WG = to_pose(who, *X_WG);
  BonePointer made;
  const auto take = [&]<class Density>(Density) {
    if (!py::isinstance<py::array_t<Density>>(voxels)) return;
    const auto whole = py::array_t<Density, py::array::c_style>::ensure(voxels);
    const std::span<const Density> span(whole.data(), static_cast<std::size_t>(whole.size()));
    const py::gil_scoped_release release;
    made = std::make_shared<PythonBone>(PythonBone{{geometry, span, GridOptions{keep_original}}, keep_original});
  };
  take(std::uint8_t{});
  take(std::int8_t{});
  take(std::uint16_t{});
  take(std::int16_t{});
  take(float{});
  if (!made)
    refuse(who, "voxels must be uint8, int8, uint16, int16 or float32 in the machine's byte order; see numpy.astype",
           std::string(py::str(voxels.dtype())));
  return made;
}

/// A mesh whose arrays Python sees without a copy.
py::array vertices_of(const py::object& self) {
  const auto& mesh = self.cast<const Mesh&>();
  const auto n = static_cast<py::ssize_t>(mesh.vertices.size());
  return py::array_t<float>({n, py::ssize_t{3}}, reinterpret_cast<const float*>(mesh.vertices.data()), self);
}
py::array triangles_of(const py::object& self) {
  const auto& mesh = self.cast<const Mesh&>();
  const auto n = static_cast<py::ssize_t>(mesh.triangles.size());
  return py::array_t<std::uint32_t>({n, py::ssize_t{3}}, reinterpret_cast<const std::uint32_t*>(mesh.triangles.data()),
                                    self);
}
template <class Number>
void take_rows(const py::object& from, std::vector<std::array<Number, 3>>& to) {
  const auto rows = from.cast<py::array_t<Number, py::array::c_style>>();
  to.resize(static_cast<std::size_t>(rows.size()) / 3);
  std::copy_n(rows.data(), rows.size(), to.empty() ? nullptr : to.front().data());
}

/// Saves a mesh; what the file system refuses is an OSError.
template <class Save>
void save_mesh(Save save, const std::filesystem::path& path, const Mesh& mesh, const std::optional<Numbers>& X_WG) {
  const Posed X = X_WG ? to_pose("Mesh", *X_WG) : Posed::Identity();
  try {
    const py::gil_scoped_release release;
    save(path, mesh, X);
  } catch (const std::runtime_error& e) {
    PyErr_SetString(PyExc_OSError, e.what());
    throw py::error_already_set();
  }
}

Mesh mesh_of(const BonePointer& bone, double isovalue) {
  const Work work(bone);
  const py::gil_scoped_release release;
  return bone->bone.mesh(isovalue);
}

BonePointer copy_of(const BonePointer& bone) {
  const Work work(bone);
  const py::gil_scoped_release release;
  return std::make_shared<PythonBone>(PythonBone{bone->bone.copy(), bone->keeps_original});
}

/// A reader keeps its bone's sizes at hand.
struct PythonReader {
  BonePointer bone;
  compiled::BoneReader reader;
};

py::array_t<std::int64_t> changed(PythonReader& self) {
  std::vector<std::int64_t> bricks;
  {
    const py::gil_scoped_release release;
    self.reader.poll([&](std::size_t brick) { bricks.push_back(static_cast<std::int64_t>(brick)); });
  }
  return py::array_t<std::int64_t>(static_cast<py::ssize_t>(bricks.size()), bricks.data());
}

py::array copy_brick(const PythonReader& self, std::size_t brick) {
  return with_density(self.bone->bone.density_type(), [&]<class Density>(Density) -> py::array {
    constexpr int kSide = compiled::BoneReader::kHaloed;
    py::array_t<Density> voxels({kSide, kSide, kSide});
    self.reader.copy_brick(brick, std::span<Density>(voxels.mutable_data(), static_cast<std::size_t>(voxels.size())));
    return voxels;
  });
}

using Triple = std::tuple<int, int, int>;

/// What makes the bone again: its arguments with the voxels that `restore` brings back, and the drilled ones, or None.
py::tuple state_of(const PythonBone& self) {
  self.require_idle();
  const compiled::Bone& b = self.bone;
  return with_density(b.density_type(), [&]<class Density>(Density) {
    const py::array present = voxels_of(b);
    py::array_t<Density> original(std::vector<py::ssize_t>(present.shape(), present.shape() + 3));
    const std::span<Density> to(original.mutable_data(), static_cast<std::size_t>(original.size()));
    b.copy_original(to);
    const bool drilled = std::memcmp(present.data(), original.data(), to.size_bytes()) != 0;
    return py::make_tuple(original, from_vector(b.spacing()), from_pose(b.X_WG()), b.outside(), self.keeps_original,
                          drilled ? py::object(present) : py::none());
  });
}

BonePointer bone_of_state(const py::tuple& state) {
  BonePointer made = make_bone(state[0], state[1].cast<Numbers>(), state[2].cast<Numbers>(), state[3].cast<double>(),
                               state[4].cast<bool>());
  if (state[5].is_none()) return made;
  with_density(made->bone.density_type(), [&]<class Density>(Density) {
    auto present = state[5].cast<py::array_t<Density, py::array::c_style>>();
    made->bone.lower_to(std::span<Density>(present.mutable_data(), static_cast<std::size_t>(present.size())));
  });
  return made;
}

}  // namespace

void trephine_python::bind_bone(py::module_& m) {
  py::class_<Mesh>(m, "Mesh", "A triangle mesh in the bone's frame G [m].")
      .def(py::pickle([](const py::object& self) { return py::make_tuple(vertices_of(self), triangles_of(self)); },
                      [](const py::tuple& state) {
                        Mesh made;
                        take_rows(state[0], made.vertices);
                        take_rows(state[1], made.triangles);
                        return made;
                      }))
      .def_property_readonly("vertices", &vertices_of, "(V, 3) float32 [m]")
      .def_property_readonly("triangles", &triangles_of,
                             "(T, 3) uint32: indices of vertices, counter-clockwise seen from outside the bone")
      .def(
          "save_stl",
          [](const Mesh& mesh, const std::filesystem::path& path, const std::optional<Numbers>& X_WG) {
            save_mesh([](const auto&... a) { save_stl(a...); }, path, mesh, X_WG);
          },
          py::arg("path"), py::arg("X_WG") = py::none(),
          "Writes a binary STL file in millimetres. `X_WG` is the mesh's pose in the file: the bone's gives the\n"
          "scanner's. Raises OSError where the file cannot be written.")
      .def(
          "save_ply",
          [](const Mesh& mesh, const std::filesystem::path& path, const std::optional<Numbers>& X_WG) {
            save_mesh([](const auto&... a) { save_ply(a...); }, path, mesh, X_WG);
          },
          py::arg("path"), py::arg("X_WG") = py::none(), "Writes a binary PLY file in millimetres, as `save_stl`.");

  py::class_<PythonBone, BonePointer> bone_class(
      m, "Bone",
      "Bone made of voxels, which scenes drill.\n\n"
      "`voxels` is an array of shape (z, y, x), x fastest in memory, as ITK's and SimpleITK's arrays are, of uint8,\n"
      "int8, uint16, int16 or float32. It is copied, so it may be read-only or a view. `spacing` is one length or\n"
      "three [m], along x, y, z: in the reverse order of the shape. Voxel [k, j, i] is a sample at its centre,\n"
      "spacing * (i, j, k) from the origin of G, and `X_WG` is G's pose in the world, (4, 4) or (7,). `outside` is "
      "the\n"
      "density beyond the voxels; None: the smallest among them. Without `keep_original` there is no restore.\n\n"
      "A bone belongs to one thread at a time. While `run` is at work on it, only readers may be used.");
  py::class_<PythonReader>(m, "BoneReader",
                           "Names the bricks that changed. Any one thread uses it, also while `run` is at work on\n"
                           "another. Every brick counts as changed at first.")
      .def(py::init([](const BonePointer& bone) {
             return PythonReader{bone, compiled::BoneReader(bone->bone)};
           }),
           py::arg("bone"))
      .def("changed", &changed,
           "Indices of the bricks that changed since the last call, int64. Brick b has the coordinates\n"
           "(b % x, b // x % y, b // (x * y)) with x, y, _ = bone.bricks, and holds 8 x 8 x 8 voxels.")
      .def("copy_brick", &copy_brick, py::arg("brick"),
           "The brick with a halo of a voxel, (10, 10, 10) in z, y, x: its own first voxel is at [1, 1, 1].")
      .def(
          "mesh",
          [](const PythonReader& r, std::size_t brick, double isovalue) {
            const py::gil_scoped_release release;
            return r.reader.mesh(brick, isovalue);
          },
          py::arg("brick"), py::arg("isovalue"),
          "The brick's share of the surface as a Mesh in G. Those of all bricks meet without a crack.")
      .def(
          "brick_range",
          [](const PythonReader& self, std::size_t brick) {
            const auto [least, greatest] = self.reader.brick_range(brick);
            return std::pair(least, greatest);
          },
          py::arg("brick"), "Least and greatest density of the brick and its halo.");

  bone_class
      .def(py::init(&make_bone), py::arg("voxels"), py::arg("spacing"), py::arg("X_WG") = py::none(),
           py::arg("outside") = py::none(), py::arg("keep_original") = GridOptions{}.keep_original)
      .def_property_readonly(
          "shape", [](const PythonBone& b) { return Triple(b.bone.size()[2], b.bone.size()[1], b.bone.size()[0]); },
          "(z, y, x)")
      .def_property_readonly(
          "spacing", [](const PythonBone& b) { return from_vector(b.bone.spacing()); }, "(3,) along x, y, z [m]")
      .def_property_readonly(
          "dtype",
          [](const PythonBone& b) {
            return with_density(b.bone.density_type(), []<class Density>(Density) { return py::dtype::of<Density>(); });
          },
          "of the voxels")
      .def_property_readonly(
          "outside", [](const PythonBone& b) { return b.bone.outside(); }, "density beyond the voxels")
      .def_property_readonly(
          "bricks",
          [](const PythonBone& b) { return Triple(b.bone.bricks()[0], b.bone.bricks()[1], b.bone.bricks()[2]); },
          "numbers of bricks along x, y, z")
      .def_property(
          "X_WG", [](const PythonBone& b) { return from_pose(b.bone.X_WG()); },
          [](PythonBone& b, const Numbers& X_WG) {
            b.require_idle();
            b.bone.set_X_WG(to_pose("Bone.X_WG", X_WG));
          },
          "pose of the bone in the world, (4, 4); setting it moves the bone")
      .def(
          "voxels",
          [](const PythonBone& b) {
            b.require_idle();
            return voxels_of(b.bone);
          },
          "The voxels as they are now: a new array (z, y, x).")
      .def(
          "restore",
          [](PythonBone& b, std::optional<std::size_t> max_bricks) {
            b.require_idle();
            return b.bone.restore(max_bricks.value_or(std::numeric_limits<std::size_t>::max()));
          },
          py::arg("max_bricks") = py::none(),
          "Puts the original densities back, in up to `max_bricks` drilled bricks; returns how many bricks are left.")
      .def(
          "reader",
          [](const BonePointer& b) {
            return PythonReader{b, compiled::BoneReader(b->bone)};
          },
          "A new reader of this bone.")
      .def("mesh", &mesh_of, py::arg("isovalue"),
           "The surface as a Mesh in G, closed at the voxels' border. Takes half a second for ten million voxels.")
      .def("copy", &copy_of, "A bone of its own with these voxels, the same original and pose.")
      .def(
          "take",
          [](PythonBone& b, const PythonBone& other) {
            b.require_idle();
            other.require_idle();
            b.bone.take(other.bone);
          },
          py::arg("other"),
          "Takes voxels and pose of a copy of this bone, or of what this is a copy of. Raises ValueError for another.")
      .def(py::pickle(&state_of, &bone_of_state))
      .def("__repr__", [](const PythonBone& b) {
        const auto& n = b.bone.size();
        return "<trephine.Bone of " + std::to_string(n[2]) + " x " + std::to_string(n[1]) + " x " +
               std::to_string(n[0]) + " voxels (z, y, x)>";
      });
}
