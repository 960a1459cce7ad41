// SPDX-License-Identifier: MIT
#include "verification.hpp"

#include "roughness.hpp"

#include <trephine/stage/first_order_filter.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>

namespace drill {
namespace {

using trephine::Vec3d;
using Verdict = Finding::Verdict;

constexpr double kShaftRadius = 0.0016;
constexpr double kFilterCutoff = 30;  // [Hz]

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
std::string
text(const char* format, ...) {
  std::array<char, 400> line{};
  std::va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(line.data(), line.size(), format, arguments);
  va_end(arguments);
  return line.data();
}

Verdict verdict(bool good) { return good ? Verdict::kPass : Verdict::kFail; }

/// Mean, correlation and the slope of y = slope x.
struct Relation {
  std::size_t count = 0;
  double xx = 0, xy = 0, yy = 0, x = 0, y = 0;
  double worst = 0;  ///< largest |y/x − 1|

  void add(double a, double b) {
    ++count;
    x += a;
    y += b;
    xx += a * a;
    xy += a * b;
    yy += b * b;
    worst = std::max(worst, std::abs(b / a - 1));
  }
  [[nodiscard]] double slope() const { return xx > 0 ? xy / xx : 0; }
  [[nodiscard]] double correlation() const {
    const auto n = static_cast<double>(count);
    const double spread = (n * xx - x * x) * (n * yy - y * y);
    return spread > 0 ? (n * xy - x * y) / std::sqrt(spread) : 0;
  }
};

Finding rate_kept(const RunLog& log) {
  double sum = 0;
  std::size_t kept = 0;
  for (const LogRow& r : log.rows) {
    sum += std::min(1000.0, 1e9 / static_cast<double>(std::max<std::int64_t>(r.tick_ns, 1)));
    kept += r.tick_ns <= 1'000'000 ? 1 : 0;
  }
  const auto n = static_cast<double>(std::max<std::size_t>(log.rows.size(), 1));
  return {"the haptic rate stays at or above 950 Hz on average",
          text("mean %.1f Hz; %.2f %% of the ticks took a millisecond at most", sum / n,
               100 * static_cast<double>(kept) / n),
          verdict(sum / n >= 950)};
}

struct Torques {
  std::vector<Vec3d> raw, filtered;
  double mean = 0;
};

/// The torque while the leaning shaft goes round the edge, as it came and through the library's filter.
Torques torques_of(const RunLog& log, const Surgeon& surgeon) {
  Torques t;
  trephine::FirstOrderFilter filter({.cutoff = kFilterCutoff});
  for (const LogRow& r : log.rows) {
    const trephine::TickInput input{.X_WT = r.probe, .spindle_on = false};
    const trephine::Posed X_WG = trephine::Posed::Identity();
    trephine::TickContext context{input, X_WG};
    context.dt = 1e-3;
    trephine::Wrenchd wrench = r.wrench;
    filter.apply(context, wrench);
    if (r.time < surgeon.ends(Surgeon::kHold) || r.time > surgeon.ends(Surgeon::kTurn)) continue;
    t.raw.push_back(r.wrench.torque);
    t.filtered.push_back(wrench.torque);
    t.mean += r.wrench.torque.norm();
  }
  t.mean /= static_cast<double>(std::max<std::size_t>(t.raw.size(), 1));
  return t;
}

}  // namespace

std::vector<Finding> check_line(const RunLog& log) {
  Relation torque;    // moment of the reaction about T's origin against the torque that the scene gave the device
  Relation reaction;  // spring against reaction
  double longest = 0;
  for (const LogRow& r : log.rows) {
    if (!(r.reaction_N > 0.01)) continue;
    const Vec3d arm = r.intersection - r.probe.translation();
    torque.add(arm.cross(r.reaction).norm(), r.wrench.torque.norm());
    reaction.add(r.spring_m, r.reaction_N);
    longest = std::max(longest, r.spring_m);
  }
  const bool enough = torque.count >= 500;
  return {rate_kept(log),
          {"torque = lever arm x reaction force",
           text("%zu ticks in shaft contact: ratio %.4f, worst tick %.2f %% off (limit 2 %%)", torque.count,
                torque.slope(), 100 * torque.worst),
           verdict(enough && torque.worst <= 0.02)},
          {"the reaction force is proportional to the spring's length",
           text("correlation %.5f, slope %.1f N/m (the shaft's stiffness is 800), springs up to %.2f mm",
                reaction.correlation(), reaction.slope(), 1e3 * longest),
           verdict(enough && reaction.correlation() > 0.999 && std::abs(reaction.slope() / 800 - 1) < 0.01)}};
}

std::vector<Finding> check_surface(const RunLog& log, const Surgeon& surgeon) {
  Relation torque;
  std::size_t pairs = 0, deeper = 0, stronger = 0;
  int most = 0;
  const Vec3d hole_W = surgeon.spot().p_W;
  // How far a slice's side has gone beyond the wall of the hole, which stands upright.
  const auto depth = [&](const SliceRow& s) {
    const LogRow& r = log.rows[s.tick];
    const Vec3d centre = r.probe * Vec3d(0, 0, s.lever_m) - hole_W;
    return centre.head<2>().norm() + kShaftRadius - 0.003;
  };
  for (std::size_t i = 0; i < log.slices.size(); ++i) {
    const SliceRow& s = log.slices[i];
    if (s.reaction_N > 0.01) torque.add(s.lever_m * s.reaction_N, s.torque_Nm);
    int colliding = 1;
    for (std::size_t j = i + 1; j < log.slices.size() && log.slices[j].tick == s.tick; ++j) {
      const SliceRow& next = log.slices[j];
      ++colliding;
      if (next.slice != s.slice + 1) continue;
      ++pairs;
      deeper += depth(next) > depth(s) ? 1 : 0;
      stronger += next.reaction_N > s.reaction_N ? 1 : 0;
    }
    most = std::max(most, colliding);
  }
  Relation total;
  for (const LogRow& r : log.rows)
    if (r.shaft_torque_Nm > 1e-5) total.add(r.shaft_torque_Nm, r.wrench.torque.norm());
  const auto share = [&](std::size_t n) {
    return 100 * static_cast<double>(n) / static_cast<double>(std::max<std::size_t>(pairs, 1));
  };
  return {
      rate_kept(log),
      {"on each slice torque = lever arm x reaction force",
       text("%zu slices in contact, at most %d at once: ratio %.4f, worst %.2f %% off (limit 2 %%)", torque.count, most,
            torque.slope(), 100 * torque.worst),
       verdict(torque.count >= 500 && torque.worst <= 0.02)},
      {"the total torque is the sum of the slices'",
       text("%zu ticks: ratio of the scene's torque to the sum %.4f, worst %.3f %% off (limit 0.1 %%)", total.count,
            total.slope(), 100 * total.worst),
       verdict(total.count >= 500 && total.worst <= 0.001)},
      {"slices with the longer lever arm are further in",
       text("%zu pairs of neighbours in contact: the upper one is further in in %.1f %%, and pushes harder in %.1f %%",
            pairs, share(deeper), share(stronger)) +
           "\n         (the shaft turns about the tip, so it moves sideways in proportion to the lever arm; a slice "
           "that\n         reaches over the edge has part of its rim in the open and pushes less)",
       verdict(pairs >= 200 && share(deeper) >= 95)}};
}

std::vector<Finding> compare_roughness(const RunLog& line_log, const RunLog& surface_log, const Surgeon& surgeon) {
  const Torques line = torques_of(line_log, surgeon), surface = torques_of(surface_log, surgeon);
  const double l = roughness(line.raw);
  const double s = roughness(surface.raw);
  const auto row = [](const char* name, const Torques& t) {
    return text("%s: %.4f mN m raw, %.4f mN m filtered; mean torque %.2f mN m (raw %.2f %% of it)", name,
                1e3 * roughness(t.raw), 1e3 * roughness(t.filtered), 1e3 * t.mean,
                t.mean > 0 ? 100 * roughness(t.raw) / t.mean : 0.0);
  };
  return {{text("roughness while the shaft goes round the edge: rms of the torque above 10 Hz, raw and through a "
                "first-order\n         filter of %g Hz",
                kFilterCutoff),
           row("line   ", line) + "\n         " + row("surface", surface), Verdict::kInformation},
          {"the thesis saw Line's torque noisier than Surface's, and proposed a filter",
           text("here Line's is %.1f times as rough as Surface's: %s", s > 0 ? l / s : 0.0,
                l > s ? "as the thesis saw it" : "not what the thesis saw"),
           Verdict::kInformation}};
}

}  // namespace drill
