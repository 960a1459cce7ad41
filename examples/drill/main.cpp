// SPDX-License-Identifier: MIT
#include "algorithms.hpp"
#include "canvas.hpp"
#include "options.hpp"
#include "pictures.hpp"
#include "plots.hpp"
#include "spot.hpp"
#include "structure_show.hpp"
#include "temporal_bone.hpp"
#include "tool_show.hpp"
#include "verification.hpp"
#include "writable.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace drill {
namespace {

namespace fs = std::filesystem;

struct Run {
  Grid bone;
  RunLog log;
};

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void introduce(const Bone& whole, const Bone& bone, const Surgeon& surgeon) {
  const auto& n = whole.grid.size();
  const trephine::Vec3d mm = 1e3 * whole.grid.spacing(), fine = 1e3 * bone.grid.spacing();
  const trephine::Vec3d at = 1e3 * surgeon.spot().p_W;
  std::printf("bone     %s: %d x %d x %d voxels of %.3g x %.3g x %.3g mm around it, bone from %g %s\n",
              bone.name.c_str(), n[0], n[1], n[2], mm.x(), mm.y(), mm.z(), bone.density(bone.isovalue),
              bone.unit.c_str());
  for (const auto& note : bone.notes) std::printf("         %s\n", note.c_str());
  if (fine != mm)
    std::printf("         resampled around the spot: %d x %d x %d voxels of %.3g x %.3g x %.3g mm\n",
                bone.grid.size()[0], bone.grid.size()[1], bone.grid.size()[2], fine.x(), fine.y(), fine.z());
  if (bone.tool)
    std::printf("drill    %s: %.3g mm diameter\n", bone.tool_name.c_str(), 2e3 * bone.burr.tip_radius);
  else
    std::printf("drill    burr of %.3g mm diameter; shaft of %.3g mm diameter, %.3g mm long\n",
                2e3 * bone.burr.tip_radius, 2e3 * bone.burr.shaft_radius, 1e3 * bone.burr.shaft_length);
  std::printf("spot     %.1f %.1f %.1f mm; bone below it for %.1f mm, surface even to %.2f mm\n", at.x(), at.y(),
              at.z(), 1e3 * surgeon.spot().depth, 1e3 * surgeon.spot().unevenness);
  std::fflush(stdout);
}

int verify(const Options& options, bool plots) {
  std::printf("\nverification: a cube, a milled hole, the shaft on its edge (thesis, section 5.1)\n");
  const Verification v = run_verification(options);
  write_line_csv(v.line, (fs::path(options.out) / "verification_line.csv").string());
  write_surface_csv(v.surface, (fs::path(options.out) / "verification_surface.csv").string());
  int failed = print_findings("Line (thesis, Fig. 21 and 22)", check_line(v.line));
  failed += print_findings("Surface (thesis, Fig. 23 and 24)", check_surface(v.surface, v.surgeon));
  failed += print_findings("Both", compare_roughness(v.line, v.surface, v.surgeon));
  // The thesis takes Line's arm from the proxy, and the force that Surface holds in deep contact (Eq. 18) need
  // not lie in its slice's plane. So arm times force is no law of either, and its figures judge nothing.
  print_findings("Line, as the thesis writes it", as_information(check_line(v.thesis_line)));
  print_findings("Surface, as the thesis writes it", as_information(check_surface(v.thesis_surface, v.surgeon)));
  failed +=
      print_findings("Both, as the thesis writes them", compare_roughness(v.thesis_line, v.thesis_surface, v.surgeon));
  if (plots) {
    std::set<int> slices;
    for (const SliceRow& s : v.surface.slices) slices.insert(s.slice);
    plot_line_verification(options.out, v.surgeon);
    plot_surface_verification(options.out, v.surgeon, {slices.begin(), slices.end()});
  }
  return failed;
}

void take(const Options& options, const std::vector<Shot>& shots) {
  for (const Shot& shot : shots) {
    const auto start = std::chrono::steady_clock::now();
    write_png(draw(shot.picture), (fs::path(options.out) / shot.file).string());
    std::printf("  %-22s %.1f s\n", shot.file.c_str(), seconds_since(start));
    std::fflush(stdout);
  }
}

void take_pictures(const Options& options, const Bone& whole, const Bone& bone, const Surgeon& surgeon,
                   const std::vector<Run>& runs) {
  const PicturedBone before(bone.grid, bone.isovalue);
  if (&whole == &bone)
    take(options, {shot_of_whole(whole, before, surgeon)});
  else
    take(options, {shot_of_whole(whole, PicturedBone(whole.grid, whole.isovalue), surgeon)});
  take(options, {shot_of_spot(bone, before, surgeon)});
  for (const Run& run : runs)
    take(options, shots_of_run(bone, before, PicturedBone(run.bone, bone.isovalue), surgeon, run.log));
}

/// All that a wrong argument or file can stop; nothing is written before it is through.
struct Prepared {
  Bone whole;                ///< as read
  std::optional<Bone> fine;  ///< finer voxels around the spot, if it was resampled
  Surgeon surgeon;
  /// What is drilled.
  [[nodiscard]] const Bone& bone() const { return fine ? *fine : whole; }
};

Prepared prepare(const Options& options) {
  Bone whole = load_bone(options);
  std::optional<trephine::Vec3d> at = options.at;
  if (!at && options.phantom == Phantom::kTemporalBone) at = temporal_bone::kSpot_W;
  Spot spot = at ? spot_near(whole, *at) : find_spot(whole);
  std::optional<Bone> fine = resampled_around(whole, spot.p_W, options);
  if (options.tools && !shown_tools_fit(fine ? *fine : whole))
    throw UsageError("--tools: its tools of 3 mm need voxels of half a millimetre at most; use --voxel 0.4");
  if (fine) spot = spot_near(*fine, spot.p_W);
  if (fine) whole.burr = fine->burr;
  const Surgeon surgeon(spot, whole.burr, {.seconds = options.seconds});
  require_writable_folder("--out", options.out);
  return {std::move(whole), std::move(fine), surgeon};
}

/// Says where results are and what is not among them.
void say_what_is_left(const Options& options, bool plots, bool pictures) {
  std::printf("\nleft in %s: logs (*.csv)%s%s\n", options.out.c_str(), plots ? ", plots (*.png, scripts *.gp)" : "",
              pictures ? ", pictures (*.png)" : "");
  if (!plots) std::printf("left out: plots, for want of gnuplot (Debian: gnuplot-nox)\n");
  if (!options.pictures) std::printf("left out: pictures, as asked\n");
  if (options.pictures && !can_write_png())
    std::printf("left out: pictures, for want of libpng when this was built (Debian: libpng-dev)\n");
#ifndef TREPHINE_EXAMPLE_HAS_ITK
  std::printf("left out: --ct, for want of ITK when this was built (Debian: libinsighttoolkit5-dev)\n");
#endif
}

/// The bone before and after, in one picture.
void picture_structures(const Options& options, const Bone& bone, const Surgeon& surgeon, const StructureShow& show) {
  const auto start = std::chrono::steady_clock::now();
  const PicturedBone before(bone.grid, bone.isovalue);
  const trephine::Posed X_SG = show.made.labels.X_WS().inverse() * bone.grid.X_WG();
  const auto drawn = [&](const PicturedBone& surface, const auto& left, const Show* each) {
    const DrawnStructures structures(show.field, left, show.made.labels.structures(), X_SG);
    return draw(picture_of_structures(bone, before, surface, structures, surgeon, show.made.shown, each), 720, 640);
  };
  std::vector<Canvas> parts{drawn(before, show.field, nullptr)};
  for (const Show& each : show.shows) parts.push_back(drawn(PicturedBone(each.bone, bone.isovalue), each.left, &each));
  const std::string file = "structures_section.png";
  write_png(tiled(std::move(parts), 2), (fs::path(options.out) / file).string());
  std::printf("  %-22s %.1f s\n", file.c_str(), seconds_since(start));
}

/// 0; or 1 where a structure was not taken without protection, or was with it.
int perform_structures(const Options& options, const Bone& bone, const Surgeon& surgeon) {
  MadeStructures made =
      options.phantom == Phantom::kTemporalBone ? temporal_bone::structures(bone.burr) : make_structures(bone, surgeon);
  std::printf("\nstraight onto %d made structures: with nothing, with a guard, with a guard and a veto\n",
              made.count());
  const StructureShow show = show_structures(bone, options, std::move(made));
  write_csv(show, (fs::path(options.out) / "structures.csv").string());
  print_table(show);
  const int failed = check(show);
  const bool plots = have_gnuplot();
  if (plots) plot_structures(options.out, show);
  const bool pictures = options.pictures && can_write_png();
  if (pictures) {
    std::printf("\npictures\n");
    picture_structures(options, bone, surgeon, show);
  }
  say_what_is_left(options, plots, pictures);
  if (failed > 0) std::printf("%d of the checks failed\n", failed);
  return failed == 0 ? 0 : 1;
}

/// Tools by name, without and with the cutting law; returns how many checks failed. They are left out where they are
/// too small for the voxels.
int press_tools(const Options& options, const Bone& bone, const Surgeon& surgeon, bool plots) {
  if (!shown_tools_fit(bone)) {
    std::printf("\nleft out: tools of 3 mm, for voxels of half a millimetre at most (--voxel 0.4)\n");
    return 0;
  }
  std::printf("\ntools pressed into the bone, without and with a law of cutting forces\n");
  const ToolShow show = show_tools(bone, options, surgeon);
  write_csv(show, (fs::path(options.out) / "tools.csv").string());
  print_table(show);
  if (plots) plot_tools(options.out, show);
  return check(show);
}

/// 0; or 1 where a check failed.
int perform_tools(const Options& options, const Bone& bone, const Surgeon& surgeon) {
  const bool plots = have_gnuplot();
  const int failed = press_tools(options, bone, surgeon, plots);
  say_what_is_left(options, plots, false);
  if (failed > 0) std::printf("%d of the checks failed\n", failed);
  return failed == 0 ? 0 : 1;
}

/// 0; or 1 where a check failed.
int perform(const Options& options, const Prepared& prepared) {
  const Bone& whole = prepared.whole;
  const Bone& bone = prepared.bone();
  const Surgeon& surgeon = prepared.surgeon;
  introduce(whole, bone, surgeon);
  if (options.structures) return perform_structures(options, bone, surgeon);
  if (options.tools) return perform_tools(options, bone, surgeon);
  const bool plots = have_gnuplot();
  std::printf("\n%.3g s with each algorithm, in %s, hand and device simulated\n", options.seconds,
              options.real_time ? "real time" : "simulated time");
  std::vector<Run> runs;
  const auto add = [&](auto* run) {
    Grid grid = fresh_copy(bone.grid);
    RunLog log = run(grid, bone, options, surgeon, surgeon.ends(Surgeon::kHold));
    write_run_csv(log, (fs::path(options.out) / (log.algorithm + ".csv")).string());
    if (plots) plot_run(options.out, log.algorithm, bone.name, surgeon);
    runs.push_back({std::move(grid), std::move(log)});
  };
  if (options.line) add(run_line);
  if (options.surface) add(run_surface);
  if (options.coupled) add(run_coupled);
  std::vector<const RunLog*> logs;
  for (const Run& r : runs) logs.push_back(&r.log);
  print_table(logs);

  const int failed = verify(options, plots) + press_tools(options, bone, surgeon, plots);

  const bool pictures = options.pictures && can_write_png();
  if (pictures) {
    std::printf("\npictures\n");
    take_pictures(options, whole, bone, surgeon, runs);
  }
  say_what_is_left(options, plots, pictures);
  if (failed > 0) std::printf("%d of the checks failed\n", failed);
  return failed == 0 ? 0 : 1;
}

}  // namespace
}  // namespace drill

/// Exit code: 0; 1 where a check failed or results could not be written; 2 for a wrong argument or file.
int main(int argc, char** argv) {
  int code = 2;
  try {
    const drill::Options options = drill::parse_options(argc, argv);
    if (options.help) {
      std::fputs(drill::usage().c_str(), stdout);
      return 0;
    }
    const drill::Prepared prepared = drill::prepare(options);
    code = 1;
    return drill::perform(options, prepared);
  } catch (const std::exception& e) {
    std::fflush(stdout);
    std::fprintf(stderr, "drill: %s\n", e.what());
    return code;
  }
}
