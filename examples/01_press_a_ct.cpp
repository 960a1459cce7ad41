// SPDX-License-Identifier: MIT
// Presses a burr onto a CT of your own: a folder of DICOM slices, an NRRD, NIfTI or MetaImage file.
//   01_press_a_ct SCAN [ISOVALUE]
// See the force grow by stiffness times depth from where the image's surface is. CMake links trephine::itk.
#include <trephine/adapter/itk.hpp>
#include <trephine/core/number.hpp>
#include <trephine/trephine.hpp>
#include <trephine/voxel/largest_piece.hpp>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <string>

using namespace trephine;

int main(int argc, char** argv) try {
  const double isovalue =
      argc > 2 ? parse_number(argv[2]).value_or(NAN) : 300;  // bone has at least this density, in HU
  VoxelGrid<std::int16_t> bone = read_volume_as<std::int16_t>(argc > 1 ? argv[1] : "scan", {.isovalue = isovalue});
  keep_largest_piece(bone, isovalue);  // leaves out a head rest, a table, specks

  const CoupledToolRenderer tool{Burr{.tip_radius = 1.5_mm}, CoupledOptions{.stiffness = 500 /* N/m */}};
  HapticScene scene{bone, isovalue, tool, DeviceLimits{.force = 3.3}};
  for (const std::string& warning : scene.warnings()) std::fprintf(stderr, "%s\n", warning.c_str());

  // From above the volume's middle down along the patient's z axis, at 20 mm/s, until the device gives no more.
  const Vec3d end = bone.spacing().cwiseProduct(Vec3d(bone.size()[0] - 1, bone.size()[1] - 1, bone.size()[2] - 1));
  Posed X_GT = Posed::Identity();
  double surface = 0;
  for (X_GT.translation() = Vec3d(end.x() / 2, end.y() / 2, end.z() + 5_mm); X_GT.translation().z() > 0;) {
    X_GT.translation().z() -= 0.02_mm;
    const TickResult r = scene.tick({.X_WT = bone.X_WG() * X_GT, .spindle_on = false}, 1e-3);
    const double height = X_GT.translation().z();
    if (r.contact.count == 0) surface = height;
    const double depth = surface - height;
    if (depth > 0 && std::fmod(depth + 1e-9, 1_mm) < 0.02_mm)
      std::printf("%.0f mm into contact: %.2f N\n", 1e3 * depth, r.wrench.force.norm());
    if (r.wrench.force.norm() > 3.29) return 0;
  }
  std::printf("no more bone on this way\n");
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
