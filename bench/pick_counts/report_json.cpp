// SPDX-License-Identifier: MIT
#include "report.hpp"
#include "text.hpp"

namespace pick {
namespace {

std::string quoted(const std::string& s) {
  std::string out = "\"";
  for (const char c : s) {
    if (c == '"' || c == '\\')
      out += std::string("\\") + c;
    else if (c == '\n')
      out += "\\n";
    else if (static_cast<unsigned char>(c) < 0x20)
      out += text("\\u%04x", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      out += c;
  }
  return out + "\"";
}

/// "key": number
std::string field(const char* key, double value) { return text("\"%s\": %.9g", key, value); }

std::string setting_json(const Setting& setting) {
  if (const auto* l = std::get_if<LineSetting>(&setting))
    return text(
        "\"algorithm\": \"line\", \"vertices\": %d, \"step_voxel\": %.9g, \"iterations\": %d, \"stepping\": "
        "\"%s\"",
        l->vertices, l->step, l->iterations(), l->ray_cast ? "RayCast" : "TranslateRotate");
  if (std::holds_alternative<CoupledSetting>(setting)) return "\"algorithm\": \"coupled\"";
  const auto& s = std::get<SurfaceSetting>(setting);
  return text(
      "\"algorithm\": \"surface\", \"sphere\": %d, \"slices\": %d, \"per_slice\": %d, \"step_voxel\": %.9g, "
      "\"weights\": \"%s\"",
      s.sphere, s.slices, s.per_slice, s.search_step, s.patches ? "PatchWeights" : "AreaWeights");
}

std::string measured_json(const Measured& m) {
  return "{" + setting_json(m.setting) + ", " + field("tick_us_median", m.median_us) + ", " +
         field("tick_us_p999", m.p999_us) + ", " + field("force_error_rel_p95", m.errors.force_p95) + ", " +
         field("direction_error_deg_p99", m.errors.direction_p99) + ", " +
         field("torque_error_rel_p95", m.errors.torque_p95) + ", " + text("\"misses\": %d, ", m.errors.misses) +
         field("excluded_share", m.errors.excluded()) + ", " + field("worst_share_of_limit", m.worst_share) + "}";
}

std::string optional_json(const std::optional<Measured>& m) { return m ? measured_json(*m) : "null"; }

std::string trial_json(Algorithm algorithm, const Trial& trial, const Choice& choice, const Scene& scene) {
  const Ticks& t = trial.truth.ticks;
  std::string front;
  for (const Measured& m : trial.measured)
    if (m.front) front += (front.empty() ? "" : ",\n       ") + measured_json(m);
  return text(
             "    {\"algorithm\": \"%s\", \"cases\": %zu, \"ticks\": %zu, \"ticks_counted\": %d, \"ticks_in_air\": %d, "
             "\"ticks_beyond_device\": %d, \"ticks_undecided\": %d,\n",
             name_of(algorithm), trial.cases.size(), trial.truth.wrenches.size(), t.used, t.free, t.beyond,
             t.undecided) +
         "     \"truth_known_within\": {" + field("force_rel_p95", trial.truth.check.force_p95) + ", " +
         field("direction_deg_p99", trial.truth.check.direction_p99) + ", " +
         field("torque_rel_p95", trial.truth.check.torque_p95) + "},\n" +
         "     \"recommended\": " + optional_json(choice.recommended) + ",\n" + "     \"code\": " +
         (choice.recommended ? quoted(as_code(choice.recommended->setting, scene)) : std::string("null")) + ",\n" +
         "     \"within_limits\": " + optional_json(choice.within_limits) + ",\n" +
         "     \"within_budget\": " + optional_json(choice.within_budget) + ",\n" +
         "     \"nearest\": " + measured_json(choice.nearest) + ",\n" + "     \"front\": [" + front + "]}";
}

}  // namespace

std::string as_json(const Subject& s, const Study& study) {
  const Limits& l = s.options.sweep.limits;
  const trephine::Burr& b = s.scene.burr;
  std::string notes, trials;
  for (const auto& note : s.notes) notes += (notes.empty() ? "" : ", ") + quoted(note);
  for (std::size_t i = 0; i < study.trials.size(); ++i)
    trials += (i == 0 ? "" : ",\n") + trial_json(study.algorithms[i], study.trials[i], study.choices[i], s.scene);
  const auto& winner = study.verdict.winner;
  return "{\n  \"bone\": " + quoted(s.bone) + ", \"notes\": [" + notes + "],\n  " +
         text("\"size\": [%d, %d, %d], \"spacing_m\": [%.9g, %.9g, %.9g], ", s.size[0], s.size[1], s.size[2],
              s.spacing.x(), s.spacing.y(), s.spacing.z()) +
         field("isovalue", s.scene.isovalue) + ",\n  \"tool\": {" + field("tip_radius_m", b.tip_radius) + ", " +
         field("shaft_radius_m", b.shaft_radius) + ", " + field("shaft_length_m", b.shaft_length) + "},\n  " +
         field("stiffness_N_m", s.scene.stiffness) + ", " + field("max_force_N", s.scene.max_force) + ", " +
         field("max_torque_Nm", s.scene.max_torque) + ",\n  " + field("budget_us", s.options.budget_us) +
         ", \"limits\": {" + field("force_rel_p95", l.force) + ", " + field("direction_deg_p99", l.direction_deg) +
         ", " + field("torque_rel_p95", l.torque) + "},\n  \"met\": " + (winner ? "true" : "false") +
         ", \"algorithm\": " + (winner ? quoted(name_of(study.algorithms[*winner])) : std::string("null")) +
         ", \"reason\": " + quoted(study.verdict.reason) + ",\n  \"trials\": [\n" + trials + "\n  ]\n}\n";
}

}  // namespace pick
