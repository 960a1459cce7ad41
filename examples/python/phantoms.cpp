// SPDX-License-Identifier: MIT
// Bones made of formulas, as arrays: those of examples/drill, for environments.
#include "bind.hpp"

#include "phantom.hpp"
#include "temporal_bone.hpp"

#include <array>
#include <cstdint>
#include <tuple>

using namespace trephine_python;

namespace {

namespace temporal = drill::temporal_bone;

template <class Density>
py::array voxels_of(const VoxelGrid<Density>& grid) {
  const auto& n = grid.size();
  py::array_t<Density> voxels({n[2], n[1], n[0]});
  grid.copy_voxels({voxels.mutable_data(), static_cast<std::size_t>(voxels.size())});
  return voxels;
}

/// `at(point, row)` writes `columns` numbers for each point of (N, 3).
template <class At>
py::array_t<double> for_each_point(const Numbers& points, py::ssize_t columns, const At& at) {
  if (points.ndim() != 2 || points.shape(1) != 3) refuse("phantoms", "points must be (N, 3)", shape_text(points));
  py::array_t<double> made({points.shape(0), columns});
  const double* p = points.data();
  double* row = made.mutable_data();
  const py::gil_scoped_release release;
  for (py::ssize_t i = 0; i < points.shape(0); ++i, p += 3, row += columns) at(Vec3d(p[0], p[1], p[2]), row);
  return made;
}

}  // namespace

PYBIND11_MODULE(_phantoms, m) {
  m.attr("TOOTH_ISOVALUE") = drill::PhantomDensities::kIsovalue;
  m.def(
      "tooth_voxels",
      [](const std::tuple<int, int, int>& shape, double spacing) {
        const auto& [z, y, x] = shape;
        return voxels_of(drill::tooth_phantom<std::uint8_t>({.size = {x, y, z}, .spacing = spacing}));
      },
      py::arg("shape"), py::arg("spacing"));
  m.def(
      "tooth_distances",
      [](const Numbers& points) {
        return for_each_point(points, 3, [](const Vec3d& p, double* row) {
          const drill::phantom::Tooth t = drill::phantom::tooth_at(1e3 * p);
          for (const double distance : {t.outside, t.dentine, t.pulp}) *row++ = 1e-3 * distance;
        });
      },
      py::arg("points"));
  py::dict structures;
  for (const auto& [name, structure] : {std::pair{"facial nerve", temporal::kFacialNerve},
                                        {"chorda tympani", temporal::kChorda},
                                        {"canals", temporal::kCanals},
                                        {"cochlea", temporal::kCochlea},
                                        {"sigmoid sinus", temporal::kSinus},
                                        {"dura", temporal::kDura},
                                        {"carotid", temporal::kCarotid}})
    structures[name] = static_cast<int>(structure);
  m.attr("TEMPORAL_STRUCTURES") = structures;
  m.def("temporal_bone", [] {
    const drill::Bone bone = temporal::bone({});
    return py::make_tuple(voxels_of(bone.grid), from_vector(bone.grid.spacing()), from_pose(bone.grid.X_WG()),
                          bone.isovalue);
  });
  m.def(
      "temporal_distances",
      [](const Numbers& points) {
        return for_each_point(points, temporal::kCount, [](const Vec3d& p, double* row) {
          for (int s = 0; s < temporal::kCount; ++s) row[s] = temporal::distance(s, p);
        });
      },
      py::arg("points"));
}
