// SPDX-License-Identifier: MIT
// Saving the drilled bone and going on with it.
#include <trephine/adapter/itk_save.hpp>
#include <trephine/core/rotation.hpp>

#include "files.hpp"

#include <doctest/doctest.h>

#include <trephine/device/replay.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <cstdint>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#if __has_include(<sys/resource.h>)
#include <sys/resource.h>

#include <csignal>
#endif

using namespace trephine;
using namespace trephine::test;

namespace {

template <VoxelDensity Density>
VoxelGrid<Density> make_grid(const Posed& X_WG = Posed::Identity(), std::optional<double> outside = {}) {
  const std::array size{9, 12, 7};
  std::vector<Density> voxels;
  for (int i = 0; i < size[0] * size[1] * size[2]; ++i)
    voxels.push_back(static_cast<Density>(i * 37 % 101 + (std::is_floating_point_v<Density> ? 0.1 : 0)));
  return {{.size = size, .spacing = {0.3e-3, 0.5e-3, 1.1e-3}, .X_WG = X_WG, .outside = outside}, voxels};
}

template <VoxelDensity Density>
std::vector<Density> voxels_of(const VoxelGrid<Density>& grid) {
  const auto& n = grid.size();
  std::vector<Density> voxels(static_cast<std::size_t>(n[0] * n[1] * n[2]));
  grid.copy_voxels(voxels);
  return voxels;
}

}  // namespace

TEST_CASE_TEMPLATE("a saved volume comes back with its voxels, place and outside", Density, std::uint8_t, std::int8_t,
                   std::uint16_t, std::int16_t, float) {
  const TemporaryFolder folder;
  const Posed X_WG =
      make_pose<double>(rotation_from_vector<double>({0.3, -0.5, 0.2}), Vec3d(0.0123456789, -0.1, 1.0 / 3));
  const auto grid = make_grid<Density>(X_WG, 117);
  for (const std::string name : {"a.nrrd", "a.mha"}) {
    CAPTURE(name);
    save_volume(folder / name, grid);
    const auto again = load_volume<Density>(folder / name);
    CHECK(again.size() == grid.size());
    // Text of 17 digits, and millimetres: a rounding or two.
    CHECK((again.spacing() - grid.spacing()).norm() < 1e-17);
    CHECK((again.X_WG().matrix() - X_WG.matrix()).norm() < 1e-14);
    CHECK(voxels_of(again) == voxels_of(grid));
    CHECK(again.outside() == grid.outside());
    CHECK(load_volume<Density>(folder / name, {.outside = 3}).outside() == Density(3));
    // Any reader of the format sees the same volume; only the note is ours.
    CHECK(voxels_of(read_volume_as<Density>(folder / name)) == voxels_of(grid));
  }
  CHECK(files_in(folder) == 2);
}

TEST_CASE("a session is saved with its recording, reloaded, verified and continued") {
  const TemporaryFolder folder;
  std::vector<std::int16_t> hounsfield(32 * 32 * 32, -1000);
  for (std::size_t i = 0; i < hounsfield.size() / 2; ++i) hounsfield[i] = 1200;
  const auto make_bone = [&] {
    return VoxelGrid<std::int16_t>({.size = {32, 32, 32}, .spacing = {0.5e-3, 0.5e-3, 0.5e-3}}, hounsfield);
  };
  const auto make_scene = [](auto& bone) {
    return HapticScene{bone, 300, SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts::thesis()}}, Cutting{},
                       DeviceLimits{.force = 3.3, .torque = 0.1}};
  };
  const auto input = [](int tick) {
    TickInput in{.X_WT = Posed::Identity(), .spindle_on = tick > 100};
    in.X_WT.translation() = Vec3d(8e-3, 8e-3 + 2e-6 * tick, 9e-3 - 3e-6 * tick);
    return in;
  };
  auto bone = make_bone();
  auto scene = make_scene(bone);
  Recorder recorder(600);
  for (int tick = 0; tick < 600; ++tick) (void)recorder.record(input(tick), 1e-3, scene.tick(input(tick), 1e-3));
  save_volume(folder / "bone.nrrd", bone);
  save_recording((folder / "session.rec").string(), recorder.ticks());

  // The recording on the bone of before gives the bone that was saved.
  auto saved = load_volume<std::int16_t>(folder / "bone.nrrd");
  CHECK(voxels_of(saved) == voxels_of(bone));
  CHECK(saved.outside() == bone.outside());
  auto fresh = make_bone();
  auto of_fresh = make_scene(fresh);
  const auto session = load_recording((folder / "session.rec").string());
  CHECK(replay(session, of_fresh).identical());
  CHECK(voxels_of(fresh) == voxels_of(saved));

  // Going on is as if nothing had been between.
  scene.reset();
  auto of_saved = make_scene(saved);
  double removed = 0;
  double farthest = 0;
  for (int tick = 600; tick < 1000; ++tick) {
    const TickResult a = scene.tick(input(tick), 1e-3);
    const TickResult b = of_saved.tick(input(tick), 1e-3);
    removed += a.removed_mm3;
    farthest = std::max(farthest, (a.wrench.force - b.wrench.force).norm());
  }
  CHECK(removed > 1);
  CHECK(farthest < 1e-9);
  CHECK(voxels_of(saved) == voxels_of(bone));
}

TEST_CASE("what cannot be saved is refused, and what was there stays") {
  const TemporaryFolder folder;
  const auto grid = make_grid<std::int16_t>();
  const auto save = [&](const std::filesystem::path& path) { return error_of([&] { save_volume(path, grid); }); };
  holds(save(folder / "a.dcm"), "a.dcm: the name must end in .nrrd or .mha");
  holds(save(folder / "a"), "must end in");
  holds(save(folder / "none" / "a.nrrd"), "there is no folder");
  std::filesystem::create_directory(folder / "taken.mha");
  write_text(folder / "taken.mha" / "file", "so that it cannot be replaced");
  holds(save(folder / "taken.mha"), "cannot be replaced");
  const VoxelGrid<std::uint8_t> slice({.size = {2, 2, 1}, .spacing = {1e-3, 1e-3, 1e-3}}, std::vector<std::uint8_t>(4));
  holds(error_of([&] { save_volume(folder / "a.nrrd", slice); }), "single slice");
  Posed nowhere = Posed::Identity();
  nowhere.translation().x() = std::numeric_limits<double>::quiet_NaN();
  holds(error_of([&] { save_volume(folder / "a.nrrd", GridReader<std::int16_t>(grid), nowhere); }), "not finite");
  CHECK(files_in(folder) == 1);
}

#if __has_include(<sys/resource.h>)
TEST_CASE("no room for the file is noticed; the one before stays") {
  const TemporaryFolder folder;
  const auto grid = make_grid<std::int16_t>();
  for (const std::string name : {"a.nrrd", "a.mha"}) {
    CAPTURE(name);
    save_volume(folder / name, grid);
    const std::string before = text_of(folder / name);
    // Files may grow to 512 bytes: the header fits, the voxels do not.
    rlimit old{};
    REQUIRE(getrlimit(RLIMIT_FSIZE, &old) == 0);
    auto* const handler = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit small{512, old.rlim_max};
    REQUIRE(setrlimit(RLIMIT_FSIZE, &small) == 0);
    const std::string error = error_of([&] { save_volume(folder / name, grid); });
    setrlimit(RLIMIT_FSIZE, &old);
    std::signal(SIGXFSZ, handler);
    holds(error, "cannot be written");
    CHECK(text_of(folder / name) == before);
  }
  CHECK(files_in(folder) == 2);
}
#endif

TEST_CASE("saved files that were damaged are refused") {
  const TemporaryFolder folder;
  for (const std::string name : {"a.nrrd", "a.mha"}) {
    CAPTURE(name);
    const auto path = folder / name;
    const auto load = [&] { return error_of([&] { (void)load_volume<float>(path); }); };
    holds(load(), "no such file");
    save_volume(path, make_grid<float>(Posed::Identity(), 12.5));
    CHECK(load() == "no error");
    std::string text = text_of(path);
    const auto at = text.find("12.5");
    REQUIRE(at != std::string::npos);
    std::ofstream(path, std::ios::binary) << text.replace(at, 4, "12,5");
    holds(load(), "no number: '12,5'");
    save_volume(path, make_grid<float>());
    std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
    holds(load(), "cannot be read");
    write_text(path, "not an image\n");
    holds(load(), "no image");
  }
  // Densities of another type must fit.
  save_volume(folder / "a.mha", make_grid<std::int16_t>(Posed::Identity(), -1000));
  holds(error_of([&] { (void)load_volume<std::uint8_t>(folder / "a.mha"); }), "outside");
}
