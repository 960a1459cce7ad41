// SPDX-License-Identifier: MIT
#include "pick_report.hpp"
#include "pick_text.hpp"

#include <algorithm>

namespace pick {
namespace {

std::string figures(const Measured& m) {
  return text("%7.2f %7.2f %8.2f %8.2f %8.2f", m.median_us, m.p999_us, 100 * m.errors.force_p95, m.errors.direction_p99,
              100 * m.errors.torque_p95);
}

std::string introduction(const Subject& s) {
  const Vec3d mm = 1e3 * s.spacing;
  const Burr& b = s.scene.burr;
  const Limits& l = s.options.sweep.limits;
  std::string out =
      text("bone     %s: %d x %d x %d voxels of %.3g x %.3g x %.3g mm, isovalue %.6g %s\n", s.bone.c_str(), s.size[0],
           s.size[1], s.size[2], mm.x(), mm.y(), mm.z(), s.scene.density.value_or(s.scene.isovalue), s.unit.c_str());
  for (const auto& note : s.notes) out += "         " + note + "\n";
  if (s.scene.tool_name.empty())
    out += text("tool     burr of %.3g mm diameter; shaft of %.3g mm diameter, %.3g mm long\n", 2e3 * b.tip_radius,
                2e3 * b.shaft_radius, 1e3 * b.shaft_length);
  else
    out += text("tool     %s: %.3g mm diameter\n", s.scene.tool_name.c_str(), 2e3 * b.tip_radius);
  out +=
      text("device   %s%s%g N/m, %g N, ", s.scene.device.c_str(), s.scene.device.empty() ? "" : ": ", s.scene.stiffness,
           s.scene.max_force) +
      (s.scene.max_torque > 0 ? text("%g N m\n", s.scene.max_torque) : std::string("no torque, so none is compared\n"));
  out += text("limits   force %.3g %% (p95), direction %.3g deg (p99), torque %.3g %% (p95); %.4g us a tick (p99.9)\n",
              100 * l.force, l.direction_deg, 100 * l.torque, s.options.budget_us);
  return out;
}

std::string about_trial(Algorithm a, const Trial& t) {
  const auto kinds = count_kinds(t.cases);
  std::string cases;
  for (std::size_t k = 0; k < kinds.size(); ++k) cases += text("%s%d %s", k == 0 ? "" : ", ", kinds[k], kKindNames[k]);
  const Ticks& ticks = t.truth.ticks;
  const Errors& e = t.truth.check;
  return text("\n%s: %d settings on %zu ticks of contact runs (%s)\n", title_of(a), static_cast<int>(t.measured.size()),
              t.truth.wrenches.size(), cases.c_str()) +
         text(
             "  errors over %d ticks, directions over %.0f %% of them; left out: %d in the air, %d beyond the device, "
             "%d (%.1f %%)\n  where even the two finest settings disagree; else these agree within %.2f %%, %.2f deg, "
             "%.2f %%\n",
             ticks.used, 100 * (1 - e.excluded()), ticks.free, ticks.beyond, ticks.undecided,
             100 * ticks.undecided_share(), 100 * e.force_p95, e.direction_p99, 100 * e.torque_p95);
}

std::string front_table(const Trial& t, const Choice& c) {
  std::vector<Measured> front;
  std::copy_if(t.measured.begin(), t.measured.end(), std::back_inserter(front), [](const auto& m) { return m.front; });
  std::sort(front.begin(), front.end(), [](const auto& a, const auto& b) { return a.p999_us < b.p999_us; });
  std::string out =
      "    median   p99.9    force    direct.  torque   on the front\n"
      "        us      us      %         deg      %\n";
  for (const Measured& m : front) {
    const bool chosen = c.recommended && c.recommended->setting == m.setting;
    out += (chosen ? "  *" : "   ") + figures(m) + "   " + describe(m.setting) + "\n";
  }
  return out;
}

std::string about_choice(Algorithm a, const Choice& c, const Subject& s) {
  const auto costs = [](const Measured& m) {
    return text("%s: %.3g us (median %.3g), force %.2g %%, direction %.2g deg, torque %.2g %%",
                describe(m.setting).c_str(), m.p999_us, m.median_us, 100 * m.errors.force_p95, m.errors.direction_p99,
                100 * m.errors.torque_p95);
  };
  if (c.recommended)
    return text("\n// %s, %s\n", title_of(a), costs(*c.recommended).c_str()) + as_code(c.recommended->setting, s.scene);
  std::string out = text("\n%s: nothing keeps to limits and budget (with a tenth to spare).\n", title_of(a));

  if (!c.within_limits) out += "  The nearest to the truth of all that was tried: " + costs(c.nearest) + "\n";
  if (c.within_limits)
    out += "\n// over the budget: " + costs(*c.within_limits) + "\n" + as_code(c.within_limits->setting, s.scene);
  return out;
}

}  // namespace

std::string as_text(const Subject& subject, const Study& study) {
  std::string out = introduction(subject);
  for (std::size_t i = 0; i < study.trials.size(); ++i)
    out += about_trial(study.algorithms[i], study.trials[i]) + front_table(study.trials[i], study.choices[i]);
  out += "\n";
  if (study.verdict.winner) {
    out +=
        text("recommended: %s; %s.\n", title_of(study.algorithms[*study.verdict.winner]), study.verdict.reason.c_str());
  } else {
    out += study.verdict.reason + "\n";
  }
  // The winner's first.
  std::vector<std::size_t> order(study.trials.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  if (study.verdict.winner) std::swap(order.front(), order[*study.verdict.winner]);
  for (const std::size_t i : order) out += about_choice(study.algorithms[i], study.choices[i], subject);
  return out;
}

std::string as_csv(const Study& study) {
  std::string out =
      "renderer,variant,vertices,sphere,slices,per_slice,step_voxel,tick_us_median,tick_us_p999,repetitions,"
      "force_error_rel_p50,force_error_rel_p95,direction_error_deg_p99,torque_error_rel_p95,misses,excluded_share,"
      "undecided_share,worst_share_of_limit,front,recommended\n";
  for (std::size_t i = 0; i < study.trials.size(); ++i)
    for (const Measured& m : study.trials[i].measured) {
      if (const auto* l = std::get_if<LineSetting>(&m.setting)) {
        out += text("line,,%d,,,,%.9g", l->vertices, l->step);
      } else if (std::holds_alternative<CoupledSetting>(m.setting)) {
        out += "coupled,,,,,,";
      } else {
        const auto& s = std::get<SurfaceSetting>(m.setting);
        out += text("surface,,%d,%d,%d,%d,%.9g", 1 + s.sphere + s.slices * (1 + s.per_slice), s.sphere, s.slices,
                    s.per_slice, s.search_step);
      }
      const auto& chosen = study.choices[i].recommended;
      out += text(",%.9g,%.9g,%d,%.9g,%.9g,%.9g,%.9g,%d,%.9g,%.9g,%.9g,%d,%d\n", m.median_us, m.p999_us, m.repetitions,
                  m.errors.force_p50, m.errors.force_p95, m.errors.direction_p99, m.errors.torque_p95, m.errors.misses,
                  m.errors.excluded(), study.trials[i].truth.ticks.undecided_share(), m.worst_share, m.front ? 1 : 0,
                  chosen && chosen->setting == m.setting ? 1 : 0);
    }
  return out;
}

}  // namespace pick
