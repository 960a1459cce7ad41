// SPDX-License-Identifier: MIT
#include "plots.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace drill {
namespace {

namespace fs = std::filesystem;

#if defined(_WIN32)
constexpr const char* kQuiet = " >NUL 2>&1";
#else
constexpr const char* kQuiet = " >/dev/null 2>&1";
#endif

constexpr std::array<const char*, Surgeon::kPhases> kPhaseNames{"approach", "mill", "go in",      "lean",
                                                                "hold",     "turn", "straighten", "withdraw"};
constexpr std::array<const char*, 6> kColours{"#0b6fb8", "#d1495b", "#2a9d5c", "#e08e0b", "#7a4fb5", "#5a6472"};

/// A script in the making: panels under each other over one time axis, the run's phases marked.
class Script {
 public:
  Script(const std::string& name, const std::string& title, int panels, const Surgeon& surgeon)
      : Script(name, title, panels, surgeon.seconds(), &surgeon) {}
  /// Without phases to mark where there is no surgeon.
  Script(const std::string& name, const std::string& title, int panels, double seconds, const Surgeon* surgeon)
      : name_(name), panels_(panels), surgeon_(surgeon) {
    s_ << "# gnuplot " << name << ".gp\n"
       << "if (strstrt(GPVAL_TERMINALS, 'pngcairo') > 0) {\n"
       << "  set terminal pngcairo size 1500," << pixels() << " font 'sans,13' linewidth 1.4\n"
       << "  set output '" << name << ".png'\n} else {\n"
       << "  set terminal svg size 1500," << pixels() << " font 'sans,13' linewidth 1.4\n"
       << "  set output '" << name << ".svg'\n}\n"
       << "set datafile separator ','\nset datafile missing 'nan'\n"
       << "set border 3 linecolor '#5a6472'\nset tics nomirror textcolor '#39424e'\n"
       << "set grid xtics ytics linecolor '#dfe3e8' linetype 1\n"
       << "set key top left horizontal samplen 2 textcolor '#39424e' opaque\n"
       << "set xrange [0:" << seconds << "]\nset lmargin 11\nset rmargin 9\nset offsets 0, 0, graph 0.2, graph 0.03\n"
       << "set multiplot title '" << title << "' font 'sans,16'\n";
  }

  /// `y_range` as gnuplot has it: "[*:*]" by the data, "[0:*]" from zero.
  Script& panel(const std::string& y_label, const std::string& y_range, const std::string& plots,
                const std::string& y2_label = "") {
    const double height = (1 - (kHead + kFoot) / pixels()) / panels_;
    const double top = 1 - kHead / pixels() - height * index_;
    const bool last = index_ + 1 == panels_;
    s_ << "\nset size 1," << height << "\nset origin 0," << top - height << "\nset tmargin 1.6\nset bmargin " << 1.6
       << "\nset xlabel '" << (last ? "time [s]" : "") << "'\nset ylabel '" << y_label << "'\n";
    if (y2_label.empty())
      s_ << "unset y2tics\nunset y2label\nset border 3\n";
    else
      s_ << "set y2tics textcolor '#39424e'\nset y2label '" << y2_label << "'\nset border 11\n";
    s_ << "set yrange " << y_range << "\nset y2range [0:*]\nunset label\nunset arrow\n";
    double from = 0;
    for (std::size_t i = 0; i < kPhaseNames.size() && surgeon_ != nullptr; ++i) {
      const double to = surgeon_->ends(static_cast<Surgeon::Phase>(i));
      if (i + 1 < kPhaseNames.size())
        s_ << "set arrow from " << to << ", graph 0 to " << to
           << ", graph 1 nohead linecolor '#aab2bd' dashtype 3 linewidth 1\n";
      if (index_ == 0 && to - from > 0.035 * surgeon_->seconds())
        s_ << "set label '" << kPhaseNames[i] << "' at " << 0.5 * (from + to)
           << ", graph 1.07 center font 'sans,10' textcolor '#7b8794'\n";
      from = to;
    }
    s_ << "plot " << plots << "\n";
    ++index_;
    return *this;
  }

  /// Writes the script and runs it; the picture's name.
  std::string run(const std::string& folder) {
    s_ << "unset multiplot\n";
    const fs::path script = fs::path(folder) / (name_ + ".gp");
    std::ofstream out(script);
    out << s_.str();
    out.close();
    if (!out) throw std::runtime_error("cannot write " + script.string());
    // In the folder itself, so that no name needs quoting.
    const fs::path here = fs::current_path();
    fs::current_path(folder);
    const int status = std::system(("gnuplot " + name_ + ".gp" + kQuiet).c_str());
    const bool png = fs::exists(name_ + ".png");
    fs::current_path(here);
    if (status != 0) throw std::runtime_error("gnuplot failed; see what it says: gnuplot " + script.string());
    return name_ + (png ? ".png" : ".svg");
  }

 private:
  // Pixels above and below the panels, and of each panel.
  static constexpr double kHead = 70, kFoot = 34, kPanel = 250;
  [[nodiscard]] double pixels() const { return kHead + kFoot + kPanel * panels_; }

  std::string name_;
  int panels_;
  int index_ = 0;
  const Surgeon* surgeon_;
  std::ostringstream s_;
};

enum Axis { kLeft, kRight };

/// Column or expression `y` over time as a line in the nth colour; one on the right axis is dashed.
std::string curve(const std::string& file, const std::string& y, const std::string& title, std::size_t nth,
                  Axis axis = kLeft) {
  return "'" + file + "' using 1:" + y + (axis == kRight ? " axes x1y2" : "") + " title '" + title +
         "' with lines linecolor '" + kColours[nth % kColours.size()] + "'" + (axis == kRight ? " dashtype 2" : "");
}

}  // namespace

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
  Script script(algorithm, name + ": drilling the " + bone, 4, surgeon);
  script.panel("force [N]", "[*:*]",
               curve(csv, "(sqrt($16**2+$17**2+$18**2))", "|F|", 5) + "," + curve(csv, "16", "F_x", 0) + "," +
                   curve(csv, "17", "F_y", 1) + "," + curve(csv, "18", "F_z", 2));
  script.panel("torque [mN m]", "[*:*]",
               curve(csv, "(1e3*sqrt($19**2+$20**2+$21**2))", "|T|", 5) + "," + curve(csv, "(1e3*$19)", "T_x", 0) +
                   "," + curve(csv, "(1e3*$20)", "T_y", 1) + "," + curve(csv, "(1e3*$21)", "T_z", 2));
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
  Script script("structures", "Straight onto structures: distance of the drill, and the push of the guard",
                2 * show.made.count(), seconds, nullptr);
  constexpr std::array<std::size_t, kProtections.size()> kNth{1, 3, 2};
  for (const auto& structure : show.made.labels.structures()) {
    const auto each = [&](const std::string& value) {
      std::string curves;
      for (std::size_t p = 0; p < kProtections.size(); ++p) {
        const std::string name = name_of(kProtections[p]);
        curves += (p > 0 ? "," : "") +
                  curve("structures.csv",
                        "(strcol(2) eq '" + structure.name + "' && strcol(3) eq '" + name + "' ? " + value + " : NaN)",
                        name, kNth[p]);
      }
      return curves;
    };
    script.panel(structure.name + ": distance [mm]", "[*:*]",
                 "0 with lines linecolor '#39424e' notitle," + each("1e3*$4"));
    script.panel("guard pushes [N]", "[0:*]", each("$6"));
  }
  return script.run(folder);
}

std::string plot_tools(const std::string& folder, const ToolShow& show) {
  Script script("tools", "Tools pressed into bone: force on the device, without and with the cutting law",
                static_cast<int>(show.runs.size() / 2), show.seconds, nullptr);
  for (std::size_t i = 0; i + 1 < show.runs.size(); i += 2) {
    const ToolRun& with = show.runs[i + 1];
    const auto force = [&](const std::string& law, const std::string& title, std::size_t nth) {
      return curve("tools.csv", "(strcol(2) eq '" + with.tool + "' && strcol(3) eq '" + law + "' ? $4 : NaN)", title,
                   nth);
    };
    const std::string share =
        with.felt < 1 ? ", 1/" + std::to_string(std::lround(1 / with.felt)) + " of it felt" : std::string();
    script.panel(with.tool + ": force [N]", "[0:*]",
                 force("without", "without", 5) + "," + force("with", "with the law" + share, 1));
  }
  return script.run(folder);
}

}  // namespace drill
