// SPDX-License-Identifier: MIT
#include "plots.hpp"

#include "gnuplot_script.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace drill {

bool have_gnuplot() { return std::system((std::string("gnuplot --version") + kQuiet).c_str()) == 0; }

std::string plot_run(const std::string& folder, const std::string& algorithm, const std::string& bone,
                     const Surgeon& surgeon) {
  const std::string csv = algorithm + ".csv";
  const auto& p = surgeon.spot().p_W;
  const auto& n = surgeon.spot().normal_W;
  // Depth along the hole's axis, of the burr's centre below the bone's surface; columns 10-12 probe, 13-15 proxy.
  const auto depth = [&](int x) {
    std::array<char, 256> text{};
    std::snprintf(text.data(), text.size(), "(1e3*(($%d-(%.9g))*(%.9g)+($%d-(%.9g))*(%.9g)+($%d-(%.9g))*(%.9g)))", x,
                  p.x(), -n.x(), x + 1, p.y(), -n.y(), x + 2, p.z(), -n.z());
    return std::string(text.data());
  };
  const std::string name = algorithm == "line"      ? "Line approximation"
                           : algorithm == "surface" ? "Surface approximation"
                                                    : "Coupled tool";
  Script script(algorithm, name + ": drilling the " + bone + kMeanNote, 4, surgeon);
  script.panel("force [N]", "[*:*]",
               magnitude_curve(csv, "(sqrt($16**2+$17**2+$18**2))", "|F|") + "," + mean_curve(csv, "16", "F_x", 0) +
                   "," + mean_curve(csv, "17", "F_y", 1) + "," + mean_curve(csv, "18", "F_z", 2));
  script.panel("torque [mN m]", "[*:*]",
               magnitude_curve(csv, "(1e3*sqrt($19**2+$20**2+$21**2))", "|T|") + "," +
                   mean_curve(csv, "(1e3*$19)", "T_x", 0) + "," + mean_curve(csv, "(1e3*$20)", "T_y", 1) + "," +
                   mean_curve(csv, "(1e3*$21)", "T_z", 2));
  script.panel("depth of the burr [mm]", "[*:*]",
               curve(csv, depth(10), "probe", 0) +
                   (algorithm != "surface" ? "," + curve(csv, depth(13), "proxy", 3) : std::string()));
  script.panel("bone removed [mm^3]", "[0:*]",
               curve(csv, "23", "removed", 2) + "," + curve(csv, "22", "contacts", 4, kRight), "contacts");
  return script.run(folder);
}

std::string plot_line_verification(const std::string& folder, const Surgeon& surgeon) {
  const std::string csv = "verification_line.csv";
  // Nothing is drawn where nothing touches.
  const auto touching = [](const std::string& value) { return "($5>0 ? " + value + " : NaN)"; };
  Script script("verification_line", "Line, a shaft on the edge of a hole in a cube (thesis, Fig. 21 and 22)", 3,
                surgeon);
  script.panel("haptic rate [Hz]", "[0:1300]",
               "950 with lines dashtype 2 linecolor '#aab2bd' title '950 Hz', '" + csv +
                   "' using 1:2 with points pointtype 7 pointsize 0.25 linecolor '#0b6fb8' title 'rate'");
  script.panel("spring length [mm]", "[0:*]",
               curve(csv, touching("1e3*$3"), "spring length", 0) + "," +
                   curve(csv, touching("$5"), "reaction force", 1, kRight),
               "reaction force [N]");
  script.panel(
      "lever arm [mm]", "[0:*]",
      curve(csv, touching("1e3*$4"), "lever arm", 2) + "," + curve(csv, touching("1e3*$6"), "torque", 4, kRight),
      "torque [mN m]");
  return script.run(folder);
}

std::string plot_surface_verification(const std::string& folder, const Surgeon& surgeon,
                                      const std::vector<int>& slices) {
  const std::string csv = "verification_surface.csv";
  Script script("verification_surface", "Surface, a shaft on the edge of a hole in a cube (thesis, Fig. 23 and 24)", 5,
                surgeon);
  const auto each = [&](const std::string& value) {
    std::string plots;
    for (std::size_t i = 0; i < slices.size(); ++i) {
      const std::string number = std::to_string(slices[i]);
      std::array<char, 160> text{};
      std::snprintf(text.data(), text.size(),
                    "'%s' using 1:($3==%s ? %s : NaN) with points pointtype 7 pointsize 0.25 ", csv.c_str(),
                    number.c_str(), value.c_str());
      plots += (i > 0 ? "," : "") + std::string(text.data()) + "linecolor '" + kColours[i % kColours.size()] +
               "' title 'slice " + number + "'";
    }
    return plots;
  };
  script.panel("haptic rate [Hz]", "[0:1300]",
               "950 with lines dashtype 2 linecolor '#aab2bd' title '950 Hz', '" + csv +
                   "' using 1:2 with points pointtype 7 pointsize 0.25 linecolor '#0b6fb8' title 'rate'");
  script.panel("lever arm [mm]", "[0:*]", each("1e3*$4"));
  script.panel("reaction force [N]", "[0:*]", each("$5"));
  script.panel("torque [mN m]", "[0:*]", each("1e3*$6"));
  script.panel("total torque [mN m]", "[0:*]", curve(csv, "(1e3*$7)", "sum over the slices", 5));
  return script.run(folder);
}

std::string plot_structures(const std::string& folder, const StructureShow& show) {
  double seconds = 0;
  for (const ShowRun& run : show.shows.front().runs) seconds = std::max(seconds, run.rows.back().time);
  Script script("structures",
                std::string("Straight onto structures: distance of the drill, and the push of the guard") + kMeanNote,
                show.made.count(), 2, seconds, nullptr);
  constexpr std::array<std::size_t, kProtections.size()> kNth{1, 3, 2};
  const auto plain = [](const auto&... about) { return curve(about...); };
  for (const auto& structure : show.made.labels.structures()) {
    const auto each = [&](const auto& curve_of, const std::string& value) {
      std::string curves;
      for (std::size_t p = 0; p < kProtections.size(); ++p) {
        const std::string name = name_of(kProtections[p]);
        curves += (p > 0 ? "," : "") + curve_of("structures.csv",
                                                "(strcol(2) eq '" + structure.name + "' && strcol(3) eq '" + name +
                                                    "' ? " + value + " : NaN)",
                                                name, kNth[p]);
      }
      return curves;
    };
    script.panel("distance [mm]", "[*:*]", "0 with lines linecolor '#39424e' notitle," + each(plain, "1e3*$4"), "",
                 structure.name);
    script.panel("guard pushes [N]", "[0:*]", each(mean_curve, "$6"), "", structure.name);
  }
  return script.run(folder);
}

std::string plot_tools(const std::string& folder, const ToolShow& show) {
  Script script(
      "tools",
      std::string("Tools pressed into bone: force on the device and true torque, without and with the cutting law") +
          kMeanNote,
      static_cast<int>(show.runs.size() / 2), 2, show.seconds, nullptr);
  for (std::size_t i = 0; i + 1 < show.runs.size(); i += 2) {
    const ToolRun& with = show.runs[i + 1];
    const auto mean = [&](const std::string& law, const std::string& value, const std::string& title, std::size_t nth) {
      return mean_curve("tools.csv",
                        "(strcol(2) eq '" + with.tool + "' && strcol(3) eq '" + law + "' ? " + value + " : NaN)", title,
                        nth);
    };
    const std::string share = with.force_scale < 1
                                  ? ", 1/" + std::to_string(std::lround(1 / with.force_scale)) + " of it felt"
                                  : std::string();
    script.panel("force [N]", "[0:*]",
                 mean("without", "$4", "without", 5) + "," + mean("with", "$4", "with the law", 1), "",
                 with.tool + share);
    script.panel("torque [N mm]", "[0:*]", mean("with", "1e3*$9", "with the law", 1), "", with.tool);
  }
  return script.run(folder);
}

}  // namespace drill
