// SPDX-License-Identifier: MIT
// Files of volumes and labels, as arrays: the package makes bones of them.
#include "bind.hpp"

#include <trephine/adapter/itk.hpp>
#include <trephine/adapter/itk_labels.hpp>
#include <trephine/adapter/itk_save.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

using namespace trephine_python;

namespace {

py::tuple read_file(const std::string& path, std::optional<double> isovalue, const std::string& series) {
  const AnyVoxelGrid any = [&] {
    const py::gil_scoped_release release;
    return read_volume(path, VolumeOptions{.series = series, .isovalue = isovalue, .grid = {.keep_original = false}});
  }();
  return std::visit(
      []<class Density>(const VoxelGrid<Density>& grid) {
        const auto& n = grid.size();
        py::array_t<Density> voxels({n[2], n[1], n[0]});
        grid.copy_voxels({voxels.mutable_data(), static_cast<std::size_t>(voxels.size())});
        return py::make_tuple(voxels, from_vector(grid.spacing()), from_pose(grid.X_WG()),
                              static_cast<double>(grid.outside()));
      },
      any);
}

void save_file(const std::string& path, const py::array& voxels, const Numbers& spacing, const Numbers& X_WG,
               double outside) {
  const auto save_as = [&]<class Density>(Density) {
    if (!py::isinstance<py::array_t<Density>>(voxels)) return;
    const GridGeometry geometry{
        {static_cast<int>(voxels.shape(2)), static_cast<int>(voxels.shape(1)), static_cast<int>(voxels.shape(0))},
        to_spacing("save_volume", spacing),
        to_pose("save_volume", X_WG),
        outside};
    const std::span<const Density> span(static_cast<const Density*>(voxels.data()),
                                        static_cast<std::size_t>(voxels.size()));
    const py::gil_scoped_release release;
    save_volume(path, VoxelGrid<Density>(geometry, span, GridOptions{.keep_original = false}));
  };
  save_as(std::uint8_t{});
  save_as(std::int8_t{});
  save_as(std::uint16_t{});
  save_as(std::int16_t{});
  save_as(float{});
}

py::tuple labels_of_file(const std::string& path) {
  const AnyLabelGrid any = [&] {
    const py::gil_scoped_release release;
    return read_labels(path);
  }();
  return std::visit(
      []<class Label>(const LabelGrid<Label>& grid) {
        const auto& n = grid.size();
        py::array_t<std::uint8_t> voxels({n[2], n[1], n[0]});
        std::vector<std::string> names;
        std::vector<std::uint8_t> number(std::size_t{1} << 16);
        for (const Structure& s : grid.structures()) {
          names.push_back(s.name);
          number[s.label] = static_cast<std::uint8_t>(names.size());
        }
        std::uint8_t* to = voxels.mutable_data();
        for (int k = 0; k < n[2]; ++k)
          for (int j = 0; j < n[1]; ++j)
            for (int i = 0; i < n[0]; ++i) *to++ = number[grid.at(i, j, k)];
        return py::make_tuple(voxels, from_vector(grid.spacing()), from_pose(grid.X_WS()), names);
      },
      any);
}

}  // namespace

PYBIND11_MODULE(_files, m) {
  m.def("read_volume", &read_file);
  m.def("save_volume", &save_file);
  m.def("read_labels", &labels_of_file);
}
