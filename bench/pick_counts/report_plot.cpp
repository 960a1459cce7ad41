// SPDX-License-Identifier: MIT
#include "report.hpp"
#include "text.hpp"

#include <algorithm>
#include <cmath>

namespace pick {
namespace {

/// Errors below a thousandth of the limit are drawn there: a logarithm has no zero.
double drawn(double share) { return std::max(share, 1e-3); }

std::string points(const std::vector<Measured>& measured, bool front) {
  std::vector<Measured> some;
  std::copy_if(measured.begin(), measured.end(), std::back_inserter(some),
               [&](const Measured& m) { return m.front || !front; });
  std::sort(some.begin(), some.end(), [](const auto& a, const auto& b) { return a.p999_us < b.p999_us; });
  std::string out;
  for (const Measured& m : some) out += text("%.6g %.6g\n", m.p999_us, drawn(m.worst_share));
  return out;
}

/// A decade mark above or below all values.
double decade(double v, bool above) {
  const double l = std::log10(v);
  return std::pow(10.0, above ? std::ceil(l + 0.02) : std::floor(l - 0.02));
}

/// Quotes would end gnuplot's strings, and a file's name may hold anything.
std::string harmless(std::string s) {
  for (char& c : s)
    if (c == '\'' || c == '\\' || static_cast<unsigned char>(c) < 0x20) c = '_';
  return s;
}

std::string panel(Algorithm algorithm, const Trial& trial, const Choice& choice, std::size_t i, std::size_t panels) {
  const char* name = name_of(algorithm);
  const char* colour = std::array{"#0b6fb8", "#d1495b", "#2a9d5c"}[static_cast<std::size_t>(algorithm)];
  const double width = 1.0 / static_cast<double>(panels);
  std::string out =
      text("\nset origin %.4g,0\nset size %.4g,0.93\nunset label\n", width * static_cast<double>(i), width);
  out += text("$%s_all << EOD\n%sEOD\n$%s_front << EOD\n%sEOD\n", name, points(trial.measured, false).c_str(), name,
              points(trial.measured, true).c_str());
  out += text("set title '%s' font 'sans,14'\n", title_of(algorithm));
  std::string curves =
      text("$%s_all using 1:2 title 'settings tried' with points pointtype 7 pointsize 0.5 linecolor '#b9c1cc', ",
           name) +
      text("$%s_front using 1:2 title 'front' with linespoints pointtype 7 pointsize 0.9 linewidth 2 linecolor '%s'",
           name, colour);
  if (choice.recommended) {
    out += text("$%s_pick << EOD\n%.6g %.6g\nEOD\n", name, choice.recommended->p999_us,
                drawn(choice.recommended->worst_share));
    curves += text(
        ", $%s_pick using 1:2 title 'recommended' with points pointtype 6 pointsize 2.6 linewidth 2.5 "
        "linecolor '#1c242e'",
        name);
    // Under the picture's title, where no point is.
    out += text("set label '%s' at graph 0.02, graph 0.03 left boxed font 'sans,11' textcolor '#1c242e'\n",
                ("recommended: " + describe(choice.recommended->setting)).c_str());
  } else {
    out +=
        "set label 'nothing keeps to limits and budget' at graph 0.02, graph 0.03 left boxed font 'sans,11' textcolor "
        "'#1c242e'\n";
  }
  return out + "plot " + curves + "\n";
}

}  // namespace

std::string as_gnuplot(const Subject& subject, const Study& study, const std::string& name) {
  double least_us = subject.options.budget_us, most_us = least_us, least = 1, most = 1;
  for (const Trial& t : study.trials)
    for (const Measured& m : t.measured) {
      least_us = std::min(least_us, m.p999_us);
      most_us = std::max(most_us, m.p999_us);
      least = std::min(least, drawn(m.worst_share));
      most = std::max(most, drawn(m.worst_share));
    }
  const double budget = subject.options.budget_us;
  const std::size_t panels = study.trials.size();
  const int width = panels > 1 ? 300 + 600 * static_cast<int>(panels) : 900;
  std::string out = text("# gnuplot %s.gp\n", name.c_str()) +
                    text(
                        "if (strstrt(GPVAL_TERMINALS, 'pngcairo') > 0) {\n"
                        "  set terminal pngcairo size %d,760 font 'sans,12' linewidth 1.2\n  set output '%s.png'\n"
                        "} else {\n"
                        "  set terminal svg size %d,760 font 'sans,12' linewidth 1.2\n  set output '%s.svg'\n}\n",
                        width, name.c_str(), width, name.c_str());
  out +=
      "set encoding utf8\nset logscale xy\nset border 3 linecolor '#5a6472'\nset tics nomirror textcolor '#39424e'\n"
      "set grid xtics ytics mxtics mytics linecolor '#d3d9e0' linetype 1, linecolor '#eceff3' linetype 1\n"
      "set key top right opaque textcolor '#39424e'\nset lmargin 11\nset rmargin 3\nset bmargin 4\n"
      "set style textbox opaque noborder fillcolor 'white'\nset format x '%g'\nset format y '%g'\n";
  // Room at the bottom for the label, at the top for the key.
  out += text("set xrange [%.6g:%.6g]\nset yrange [%.6g:%.6g]\n", decade(least_us, false), decade(most_us, true),
              decade(least, false), decade(most, true));
  out +=
      "set xlabel 'time of a tick, 99.9th percentile [µs]'\n"
      "set ylabel 'worst of force, direction and torque error, as a share of its limit'\n";
  out += text(
      "set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead dashtype 2 linecolor '#39424e'\n"
      "set arrow 2 from first %.6g, graph 0 to first %.6g, graph 1 nohead dashtype 2 linecolor '#39424e'\n",
      budget, budget);
  const Limits& l = subject.options.sweep.limits;
  out += text(
      "set multiplot title '%s: error against time; dashed: %.3g %% force, %.3g° direction, %.3g %% torque and "
      "%.4g µs' noenhanced font 'sans,15'\n",
      harmless(subject.bone).c_str(), 100 * l.force, l.direction_deg, 100 * l.torque, budget);
  for (std::size_t i = 0; i < panels; ++i)
    out += panel(study.algorithms[i], study.trials[i], study.choices[i], i, panels);
  return out + "unset multiplot\n";
}

}  // namespace pick
