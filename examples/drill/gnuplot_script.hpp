// SPDX-License-Identifier: MIT
#pragma once

#include "surgeon.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>

/// Scripts for gnuplot, in the making.
namespace drill {

#if defined(_WIN32)
inline constexpr const char* kQuiet = " >NUL 2>&1";
#else
inline constexpr const char* kQuiet = " >/dev/null 2>&1";
#endif

inline constexpr std::array<const char*, Surgeon::kPhases> kPhaseNames{"approach", "mill", "go in",      "lean",
                                                                       "hold",     "turn", "straighten", "withdraw"};
inline constexpr std::array<const char*, 6> kColours{"#0b6fb8", "#d1495b", "#2a9d5c", "#e08e0b", "#7a4fb5", "#5a6472"};

/// A script in the making: panels in rows over one time axis, the run's phases marked.
class Script {
 public:
  Script(const std::string& name, const std::string& title, int rows, const Surgeon& surgeon)
      : Script(name, title, rows, 1, surgeon.seconds(), &surgeon) {}
  /// Without phases to mark where there is no surgeon.
  Script(const std::string& name, const std::string& title, int rows, int columns, double seconds,
         const Surgeon* surgeon)
      : name_(name), rows_(rows), columns_(columns), surgeon_(surgeon) {
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
                const std::string& y2_label = "", const std::string& title = "") {
    const double height = (1 - (kHead + kFoot) / pixels()) / rows_, width = 1.0 / columns_;
    const double top = 1 - kHead / pixels() - height * (index_ / columns_);
    const bool last = index_ / columns_ + 1 == rows_;
    // Beside each other panels are too narrow for a key: the first writes it for all, above them.
    if (columns_ > 1 && index_ == 0)
      s_ << "\nset key at screen 0.5, screen " << 1 - 0.55 * kHead / pixels()
         << " center top horizontal font 'sans,11' width -1\nset tics font 'sans,11'\n";
    if (index_ == 1 && columns_ > 1) s_ << "\nunset key\n";
    s_ << "\nset size " << width << ',' << height << "\nset origin " << width * (index_ % columns_) << ','
       << top - height << "\nset tmargin 1.6\nset bmargin 1.6\nset title '" << title << "' offset 0,-0.6\nset xlabel '"
       << (last ? "time [s]" : "") << "'\nset ylabel '" << y_label << "'\n";
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
      if (index_ < columns_ && to - from > 0.035 * surgeon_->seconds())
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
    const std::filesystem::path script = std::filesystem::path(folder) / (name_ + ".gp");
    std::ofstream out(script);
    out << s_.str();
    out.close();
    if (!out) throw std::runtime_error("cannot write " + script.string());
    // In the folder itself, so that no name needs quoting.
    const std::filesystem::path here = std::filesystem::current_path();
    std::filesystem::current_path(folder);
    const int status = std::system(("gnuplot " + name_ + ".gp" + kQuiet).c_str());
    const bool png = std::filesystem::exists(name_ + ".png");
    std::filesystem::current_path(here);
    if (status != 0) throw std::runtime_error("gnuplot failed; see what it says: gnuplot " + script.string());
    return name_ + (png ? ".png" : ".svg");
  }

 private:
  // Pixels above and below the panels, of each panel, and of all where there are many.
  static constexpr double kHead = 70, kFoot = 34, kPanel = 250, kMax = 1400;
  [[nodiscard]] double pixels() const {
    return kHead + kFoot + std::min(kPanel * rows_, std::max(kMax, 150.0 * rows_));
  }

  std::string name_;
  int rows_, columns_;
  int index_ = 0;
  const Surgeon* surgeon_;
  std::ostringstream s_;
};

enum Axis { kLeft, kRight };

/// Column or expression `y` over time as a line in the nth colour; one on the right axis is dashed.
inline std::string curve(const std::string& file, const std::string& y, const std::string& title, std::size_t nth,
                         Axis axis = kLeft) {
  return "'" + file + "' using 1:" + y + (axis == kRight ? " axes x1y2" : "") + " title '" + title +
         "' with lines linecolor '" + kColours[nth % kColours.size()] + "'" + (axis == kRight ? " dashtype 2" : "");
}

inline constexpr double kMeanTime = 0.01;  // [s]
inline constexpr const char* kMeanNote = " (lines: means over 10 ms, pale: each tick)";

/// The same for what steps from tick to tick as the device's encoders do: the mean over kMeanTime, and each tick pale
/// behind it. Between two steps of an encoder a force of each tick alone is a block of ink.
inline std::string mean_curve(const std::string& file, const std::string& y, const std::string& title,
                              std::size_t nth) {
  const std::string colour = kColours[nth % kColours.size()] + 1;  // without its '#'
  std::ostringstream mean;
  mean << "'" << file << "' using (" << kMeanTime << "*(floor($1/" << kMeanTime << ")+0.5)):" << y
       << " smooth unique with lines title '" << title << "' linecolor '#" << colour << "'";
  return "'" + file + "' using 1:" + y + " with lines notitle linecolor '#d0" + colour + "'," + mean.str();
}
/// A magnitude, in a broad grey line: a component that is as large stays visible on it.
inline std::string magnitude_curve(const std::string& file, const std::string& y, const std::string& title) {
  std::ostringstream mean;
  mean << "'" << file << "' using (" << kMeanTime << "*(floor($1/" << kMeanTime << ")+0.5)):" << y
       << " smooth unique with lines title '" << title << "' linecolor '#b4bcc6' linewidth 5";
  return mean.str();
}

}  // namespace drill
