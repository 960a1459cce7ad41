// SPDX-License-Identifier: MIT
// A window to drill in by hand: mouse, 6-DOF mouse or a file moves the drill, and the bone holds it.
#include "../drill/png_file.hpp"
#include "../drill/writable.hpp"
#include "screen.hpp"
#include "session_writer.hpp"
#include "simulate.hpp"
#include "sound.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <chrono>
#include <cstdio>
#include <exception>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>

namespace live {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point t) { return std::chrono::duration<double>(Clock::now() - t).count(); }

void save_shot(Screen& screen, double time, const std::string& path) {
  const std::vector<std::uint8_t> rgb = screen.shot(time);
  if (rgb.empty()) return;
  drill::write_png(screen.width(), screen.height(), rgb, path);
  std::printf("saved %s\n", path.c_str());
  std::fflush(stdout);
}

/// What the drill did to structures so far, in a line.
void print_log(double time, const Workbench& bench) {
  const TickView& v = bench.view();
  if (bench.guarded() == nullptr || v.closest.nearest < 0) return;
  std::printf("%5.1f s  %-4s nearest %.2f mm to the %s, guard %.2f N, removed %.1f, taken %.3g, refused %.3g mm3\n",
              time, std::string(to_string(bench.protection())).c_str(), 1e3 * v.closest.distance,
              bench.guarded()->structures[static_cast<std::size_t>(v.closest.nearest)].name.c_str(), v.most_push_N,
              v.removed_mm3, v.structures.taken_mm3, v.structures.refused_mm3);
  std::fflush(stdout);
}

/// Does what a session's event says. Shots add what they take to `paused` [s]: the session's clock stands still
/// meanwhile.
void perform(const Event& e, double time, double& paused, Window& window, Workbench& bench, Screen& screen) {
  if (e.kind == Event::Kind::kShot) {
    const auto start = Clock::now();
    save_shot(screen, time, e.file);
    paused += seconds_since(start);
  }
  if (e.kind == Event::Kind::kLog) print_log(time, bench);
  if (e.kind == Event::Kind::kSize)
    glfwSetWindowSize(window.handle(), static_cast<int>(e.numbers[0]), static_cast<int>(e.numbers[1]));
  bench.apply(e);
}

void print_structures(const GuardedBone& guarded, double seconds) {
  const auto& n = guarded.field->size();
  const Vec3d mm = 1e3 * guarded.field->spacing();
  std::printf("labels   %zu of %d x %d x %d voxels of %.3g x %.3g x %.3g mm:", guarded.structures.size(), n[0], n[1],
              n[2], mm.x(), mm.y(), mm.z());
  for (const auto& s : guarded.structures)
    std::printf(" %s%s", s.name.c_str(), &s == &guarded.structures.back() ? "" : ",");
  std::printf("; %.1f s\n", seconds);
  for (const std::string& note : guarded.notes) std::printf("         %s\n", note.c_str());
}

/// What the drill did to structures. After the session's end.
void print_outcome(const GuardedBone& guarded, const StructureReport& closest) {
  if (closest.nearest >= 0)
    std::printf("nearest  %.2f mm, to the %s\n", 1e3 * closest.distance,
                guarded.structures[static_cast<std::size_t>(closest.nearest)].name.c_str());
  for (std::size_t s = 0; s < guarded.structures.size(); ++s)
    std::printf("taken    %.3g mm3, refused %.3g mm3: bone of the %s\n", guarded.watch->taken_mm3(static_cast<int>(s)),
                guarded.refuse->refused_mm3(static_cast<int>(s)), guarded.structures[s].name.c_str());
}

/// Plays a session in simulated time, without a window, and prints where it ends.
void run_simulated(const LiveOptions& options) {
  std::vector<Event> events = read_events(options.simulate);
  Loaded loaded = load(options.bone);
  load_structures(loaded, options);
  const Simulated end = simulate(std::move(loaded), options, std::move(events));
  std::printf("removed  %.9g mm3\nforce    %.9g %.9g %.9g N\nticks    %llu, median %.2f us\n", end.removed_mm3,
              end.force.x(), end.force.y(), end.force.z(), static_cast<unsigned long long>(end.ticks),
              end.tick_us_median);
}

/// `code` is what the program ends with if an exception comes out: 2 while it can only be an argument, file or display.
int run(const LiveOptions& options, int& code) {
  const bool scripted = !options.script.empty();
  const std::string& file = scripted ? options.script : options.replay;
  std::vector<Event> events;
  if (!file.empty()) events = read_events(file);
  if (!options.record.empty()) drill::require_writable_file("--record", options.record);
  for (const Event& e : events)
    if (e.kind == Event::Kind::kShot) drill::require_writable_file("shot", e.file);
  Window window(options.width, options.height, true, options.debug);
  std::printf("picture  %s\n", window.renderer().c_str());
  const auto loading = Clock::now();
  Loaded loaded = load(options.bone);
  const auto& n = loaded.bone.grid.size();
  const Vec3d mm = 1e3 * loaded.bone.grid.spacing();
  std::printf("bone     %s: %d x %d x %d voxels of %.3g x %.3g x %.3g mm\n", loaded.bone.name.c_str(), n[0], n[1], n[2],
              mm.x(), mm.y(), mm.z());
  for (const std::string& note : loaded.bone.notes) std::printf("         %s\n", note.c_str());
  const auto measuring = Clock::now();
  load_structures(loaded, options);
  if (loaded.guarded) print_structures(*loaded.guarded, seconds_since(measuring));
  Workbench bench(std::move(loaded), options);
  Screen screen(window, bench, !scripted);
  std::unique_ptr<Sound> sound;
  if (!options.mute) sound = std::make_unique<Sound>(bench.session().heard());
  std::printf("sound    %s\n", sound ? sound->text().c_str() : "none: muted");
  std::printf("ready    after %.1f s; %zu MB on the card; F1 shows keys and mouse\n", seconds_since(loading),
              (bench.texture().bytes() + (bench.structures() ? bench.structures()->bytes() : 0)) >> 20);
  std::fflush(stdout);

  code = 1;
  std::ofstream record_file;
  std::optional<SessionWriter> record;
  if (!options.record.empty()) {
    record_file.open(options.record);
    record.emplace(record_file, bench);
  }
  Playback playback(std::move(events), scripted ? Playback::End::kProgram : Playback::End::kHand);
  int shots = 0;
  const auto start = Clock::now();
  auto last = start;
  std::size_t frames = 0;
  double paused = 0;
  while (glfwWindowShouldClose(window.handle()) == GLFW_FALSE && !bench.quit()) {
    screen.follow_mouse(playback.is_over());
    glfwPollEvents();
    const double time = seconds_since(start) - paused, dt = std::min(seconds_since(last), 0.1);
    last = Clock::now();
    if (!playback.play(time, [&](const Event& e) { perform(e, time, paused, window, bench, screen); })) break;
    screen.frame(dt, time);
    ++frames;
    const std::vector<Action> pressed = screen.pressed();
    if (record) record->frame(time, bench, pressed);
    if (bench.take_shot()) save_shot(screen, time, "trephine_" + std::to_string(++shots) + ".png");
    if (bench.session().failed()) throw std::runtime_error(bench.session().report());
    if (!window.gl_errors().empty()) throw std::runtime_error("OpenGL: " + window.gl_errors());
    // Nothing is gained beyond 60 pictures a second, also where no screen paces them.
    const double interval = std::max(1 / options.fps, bench.still() ? 0.033 : 0.0);
    std::this_thread::sleep_until(last +
                                  std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(interval)));
  }
  const double length = seconds_since(start);
  if (record) record->quit(length - paused);
  std::printf("drilled  %.1f mm3 in %.1f s; %zu pictures; %llu periods missed of %llu\n", bench.view().removed_mm3,
              length, frames, static_cast<unsigned long long>(bench.view().missed),
              static_cast<unsigned long long>(bench.view().tick));
  const trephine::TimeSummary ticks = bench.session().end();
  if (bench.guarded() != nullptr) print_outcome(*bench.guarded(), bench.view().closest);
  std::printf("ticks    median %.1f us, p99.9 %.1f us, longest %.1f us\n", 1e6 * ticks.p50, 1e6 * ticks.p99_9,
              1e6 * ticks.max);
  return 0;
}

}  // namespace
}  // namespace live

/// Exit code: 0; 1 where the device or OpenGL failed; 2 for a wrong argument, a wrong file or no display.
int main(int argc, char** argv) {
  const live::Parsed parsed = live::parse_live_options(argc, argv);
  if (parsed.exit) {
    std::fprintf(parsed.exit->code == 0 ? stdout : stderr, "%s\n", parsed.exit->text.c_str());
    return parsed.exit->code;
  }
  int code = 2;
  try {
    if (!parsed.options.simulate.empty()) {
      live::run_simulated(parsed.options);
      return 0;
    }
    return live::run(parsed.options, code);
  } catch (const live::NoDisplay& e) {
    std::fprintf(stderr, "live: %s. Without a screen: xvfb-run -a examples/live/run (Debian: xvfb, xauth)\n", e.what());
    return 2;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "live: %s\n", e.what());
    return code;
  }
}
