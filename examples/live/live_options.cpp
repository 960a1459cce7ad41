// SPDX-License-Identifier: MIT
#include "live_options.hpp"

#include "keys.hpp"
#include "script.hpp"

#ifdef TREPHINE_LIVE_HAS_DEVICES
#include "../devices/kinds.hpp"
#endif

#include <trephine/core/number.hpp>
#include <trephine/tool/motors.hpp>
#include <trephine/tool/named_tools.hpp>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <charconv>
#include <map>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <system_error>

namespace live {
namespace {

/// WIDTHxHEIGHT; throws CLI::ValidationError.
void read_size(const std::string& text, LiveOptions& o) {
  const auto fail = [&] {
    throw CLI::ValidationError("--size", "'" + text + "' is no size from 160x120 to 7680x4320, such as 1280x800");
  };
  const std::size_t x = text.find('x');
  if (x == std::string::npos) fail();
  const auto number = [&](std::string_view part, int least, int most) {
    int v = 0;
    const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), v);
    if (error != std::errc{} || end != part.data() + part.size() || v < least || v > most) fail();
    return v;
  };
  o.width = number(std::string_view(text).substr(0, x), 160, 7680);
  o.height = number(std::string_view(text).substr(x + 1), 120, 4320);
}

/// A burr's diameter [mm] or a tool's name; throws CLI::ValidationError.
void read_tool(const std::string& text, bool coupled, LiveOptions& o) {
  if (const std::optional<double> mm = trephine::parse_number(text)) {
    if (!(*mm >= 0.01 && *mm <= 1000)) throw CLI::ValidationError("--tool", "a burr's diameter is 0.01 to 1000 mm");
    o.bone.tip_radius = 0.5e-3 * *mm;
    return;
  }
  try {
    (void)trephine::tool_by_name(text);
  } catch (const std::invalid_argument& e) {
    throw CLI::ValidationError("--tool", e.what());
  }
  if (!coupled) throw CLI::ValidationError("--tool", "line and surface have a round burr; use --algorithm coupled");
  o.bone.tool = text;
}

/// A motor's name; throws CLI::ValidationError.
void read_motor(const std::string& name, LiveOptions& o) {
  try {
    o.motor = trephine::motor_by_name(name);
  } catch (const std::invalid_argument& e) {
    throw CLI::ValidationError("--motor", e.what());
  }
}

/// Keys, mouse and the commands of sessions' files, a line each.
std::string help_of_use() {
  std::ostringstream text;
  const auto row = [&](const std::string& what, std::string_view help) {
    text << "  " << what << std::string(what.size() < 31 ? 31 - what.size() : 1, ' ') << help << '\n';
  };
  text << "Keys:\n";
  for (const Key& k : kKeys) row(std::string(k.name), k.help);
  text << "\nMouse:\n";
  for (const MouseHelp& m : kMouseHelp) row(std::string(m.gesture), m.help);
  text << "\nA session's file (--script, --replay, --record) has a line for each event: seconds since the start, a "
          "command.\nTimes do not fall; '#' begins a comment. examples/live/*.session are some.\n";
  for (const Command& c : commands())
    row(std::string(c.word) + (c.arguments.empty() ? "" : " ") + std::string(c.arguments), c.help);
  return text.str();
}

/// An error's text if no device has this name.
std::string wrong_device(const std::string& name) {
  if (name == kMouse) return {};
#ifdef TREPHINE_LIVE_HAS_DEVICES
  try {
    const devices::Kind& kind = devices::kind_named(name);
    const devices::Finding finding = kind.look();
    return finding.usable ? "" : name + ": " + finding.found + "; " + finding.to_do;
  } catch (const devices::UnknownDevice& error) {
    return std::string(error.what()) + ", mouse";
  }
#else
  return "there is no device '" + name + "'; there is: mouse";
#endif
}

}  // namespace

Parsed parse_live_options(int argc, const char* const* argv) {
  Parsed parsed;
  LiveOptions& o = parsed.options;
  CLI::App app(
      "A window to drill in by hand: the mouse moves the drill, the bone holds it. F1 shows keys and mouse.\n"
      "Without --skull or --ct it opens a built-in tooth phantom.");
  app.name("live");
  double isovalue = 0, voxel_mm = 0, margin_mm = 1;
  std::vector<double> at_mm;
  std::string size;
  auto* skull = app.add_option("--skull", o.bone.skull, "folder of an InVesalius project: matrix.dat and main.plist")
                    ->check(CLI::ExistingDirectory);
  auto* ct = app.add_option("--ct", o.bone.ct, "CT volume: DICOM folder, NRRD, NIfTI or MetaImage (needs ITK)")
                 ->check(CLI::ExistingPath);
  ct->excludes(skull);
  auto* labels =
      app.add_option("--labels", o.labels,
                     "segmentation of the CT: .seg.nrrd, NRRD, NIfTI or MetaImage; its structures are guarded")
          ->check(CLI::ExistingFile)
          ->needs(ct);
  auto* made_structures = app.add_flag("--structures", o.bone.structures,
                                       "guard structures made around the start, in place of a segmentation")
                              ->excludes(labels);
  app.add_option("--series", o.bone.series, "which series of a DICOM folder that holds several: number or UID")
      ->needs(ct);
  auto* iso =
      app.add_option("--isovalue", isovalue, "bone is where the density is at least this (skull and CT: 300 HU)")
          ->check(CLI::Range(-1e9, 1e9));
  app.add_flag("--largest-piece", o.bone.largest_piece,
               "leave out what hangs apart from the largest piece of bone: a head rest (--skull: always)");
  auto* at = app.add_option("--at", at_mm, "start at the bone nearest to X Y Z [mm]")
                 ->expected(3)
                 ->check(CLI::Range(-1e5, 1e5));
  const std::map<std::string, Renderer> renderers{
      {"coupled", Renderer::kCoupled}, {"line", Renderer::kLine}, {"surface", Renderer::kSurface}};
  std::string renderer = "coupled";
  app.add_option("--algorithm", renderer, "coupled, line or surface (coupled)")
      ->check(CLI::IsMember({"coupled", "line", "surface"}));
  std::string tool;
  app.add_option("--tool", tool,
                 "burr's diameter [mm] (six voxels at least), or a tool's name and diameter [mm] for the coupled "
                 "algorithm: match-head-3, twist-3.2");
  auto* law = app.add_flag("--law", o.law,
                           "mill by the law of cutting: feeding takes force, and the spindle turns the hand (coupled)");
  std::string motor;
  app.add_option("--motor", motor,
                 "of the spindle, which slows under load: air-turbine, electric-handpiece or surgical-drill (none)")
      ->needs(law);
  auto* voxel = app.add_option("--voxel", voxel_mm, "resample the bone to this spacing [mm], 0: as read (0.4)")
                    ->check(CLI::Range(0.0, 10.0));
  std::string protection = "warn";
  app.add_option("--protect", protection, "of structures at the start: off, warn, push or veto (warn)")
      ->check(CLI::IsMember({"off", "warn", "push", "veto"}));
  app.add_option("--margin", margin_mm, "of structures for warning and push, half of it for the veto [mm] (1)")
      ->check(CLI::Range(0.2, 10.0));
  app.add_option("--device", o.device, "mouse, or a device by name, as examples/devices/run --list shows them (mouse)")
      ->check([](const std::string& name) { return wrong_device(name); });
  app.add_flag("--second-hand", o.second_hand, "a simulated hand holds a suction tube beside the drill");
  app.add_option("--rate", o.rate, "of the haptic loop [Hz] (1000)")->check(CLI::Range(500.0, 8000.0));
  app.add_option("--scale", o.scale, "motion of the drill over motion of the hand (1)")->check(CLI::Range(0.05, 5.0));
  app.add_option("--size", size, "of the window, WIDTHxHEIGHT (1280x800)");
  auto* replay =
      app.add_option("--replay", o.replay, "play a recorded session, then go on by hand")->check(CLI::ExistingFile);
  auto* script =
      app.add_option("--script", o.script, "play a session, then quit")->check(CLI::ExistingFile)->excludes(replay);
  app.add_option("--simulate", o.simulate, "play a session without a window, in simulated time, and print its end")
      ->check(CLI::ExistingFile)
      ->excludes(script)
      ->excludes(replay);
  std::string phantom;
  app.add_option("--phantom", phantom, "bone made of formulas: tooth, or temporal with structures of its own (tooth)")
      ->check(CLI::IsMember({"tooth", "temporal"}))
      ->excludes(ct)
      ->excludes(skull)
      ->excludes(made_structures);
  app.add_option("--record", o.record, "write the session to this file");
  app.add_option("--fps", o.fps, "pictures a second at most (60)")->check(CLI::Range(0.1, 240.0));
  app.add_flag("--mute", o.mute, "no sound");
  app.add_flag("--debug", o.debug, "ask OpenGL for a debug context; an error of OpenGL ends the program");
  try {
    app.parse(argc, argv);
    if (!size.empty()) read_size(size, o);
    if (!tool.empty()) read_tool(tool, renderer == "coupled", o);
    if (!motor.empty()) read_motor(motor, o);
    if (o.law && renderer != "coupled") throw CLI::ValidationError("--law", "it needs --algorithm coupled");
    if (*at) {
      if (at_mm.size() != 3) throw CLI::ValidationError("--at", "needs X Y Z");
      o.bone.at = 1e-3 * trephine::Vec3d(at_mm[0], at_mm[1], at_mm[2]);
    }
  } catch (const CLI::CallForHelp&) {
    parsed.exit = Exit{0, app.help() + "\n" + help_of_use()};
    return parsed;
  } catch (const CLI::ParseError& e) {
    std::string text = e.what();
    // One line, whatever the library says.
    for (char& c : text)
      if (c == '\n') c = ' ';
    parsed.exit = Exit{2, "live: " + text + "; --help lists the options"};
    return parsed;
  }
  if (phantom == "temporal") o.bone.phantom = drill::Phantom::kTemporalBone;
  if (*iso) o.bone.isovalue = isovalue;
  if (*voxel) o.bone.voxel = 1e-3 * voxel_mm;
  o.protection = kProtections[static_cast<std::size_t>(
      std::find(kProtectionNames.begin(), kProtectionNames.end(), protection) - kProtectionNames.begin())];
  o.margin = 1e-3 * margin_mm;
  o.renderer = renderers.at(renderer);
  return parsed;
}

}  // namespace live
