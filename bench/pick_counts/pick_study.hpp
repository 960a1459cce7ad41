// SPDX-License-Identifier: MIT
#pragma once

#include "common/percentile.hpp"
#include "pick_places.hpp"

#include <trephine/core/wrench.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace pick {

inline constexpr double kMinForce = 0.05;    ///< [N]: denominators are no smaller, directions not asked for below
inline constexpr double kMinTorque = 0.001;  ///< [N·m]: denominators are no smaller

/// |got − truth| as a share of the truth, but of no less than `least`.
[[nodiscard]] inline double relative_error(const Vec3d& truth, const Vec3d& got, double least) {
  return (got - truth).norm() / std::max(truth.norm(), least);
}

/// Angle between the two [degrees]; 180 where one of them is zero: a missing force points nowhere.
[[nodiscard]] inline double angle_deg(const Vec3d& a, const Vec3d& b) {
  if (!(a.norm() > 0) || !(b.norm() > 0)) return 180;
  return 180 / std::numbers::pi * std::atan2(a.cross(b).norm(), a.dot(b));
}

/// Force and torque as shares of the truth, direction in degrees.
struct Errors {
  double force_p50 = 0;
  double force_p95 = 0;
  double direction_p99 = 0;
  double torque_p95 = 0;
  int samples = 0;     ///< ticks that count
  int directions = 0;  ///< of these, with a force that is strong enough to have a direction
  int misses = 0;      ///< of those, without any force in the setting's answer

  /// Share of the samples that tell nothing about directions.
  [[nodiscard]] double excluded() const { return samples > 0 ? 1 - static_cast<double>(directions) / samples : 0; }
};

/// What errors may be.
struct Limits {
  double force = 0.035;
  double direction_deg = 5;
  double torque = 0.06;

  /// The worst of the three errors as a share of its limit: 1 just meets them.
  [[nodiscard]] double worst_share(const Errors& e) const {
    return std::max({e.force_p95 / force, e.direction_p99 / direction_deg, e.torque_p95 / torque});
  }
};

/// Errors over the ticks whose `counts` is not 0.
[[nodiscard]] inline Errors compare(std::span<const Wrenchd> truth, std::span<const Wrenchd> got,
                                    std::span<const std::uint8_t> counts) {
  std::vector<double> force, direction, torque;
  Errors e;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    if (counts[i] == 0) continue;
    ++e.samples;
    force.push_back(relative_error(truth[i].force, got[i].force, kMinForce));
    torque.push_back(relative_error(truth[i].torque, got[i].torque, kMinTorque));
    if (truth[i].force.norm() < kMinForce) continue;
    ++e.directions;
    if (!(got[i].force.norm() > 0)) ++e.misses;
    direction.push_back(angle_deg(truth[i].force, got[i].force));
  }
  const auto share = [](const std::vector<double>& v, double q) {
    return v.empty() ? 0 : trephine::bench::percentile(v, q);
  };
  e.force_p50 = share(force, 0.5);
  e.force_p95 = share(force, 0.95);
  e.direction_p99 = share(direction, 0.99);
  e.torque_p95 = share(torque, 0.95);
  return e;
}

/// What a tick can say: nothing in the air, beyond the device's limits, or where the truth is not known.
struct Ticks {
  std::vector<std::uint8_t> counts;
  int free = 0;       ///< the truth is no contact, and so is the check
  int beyond = 0;     ///< more than the device can give
  int undecided = 0;  ///< two very fine settings differ by more than the limits: a knife's edge between two answers
  int used = 0;

  [[nodiscard]] double undecided_share() const {
    return used + undecided > 0 ? static_cast<double>(undecided) / (used + undecided) : 0;
  }
};

/// `check` is the answer of a setting half as fine as the truth.
[[nodiscard]] inline Ticks sort_ticks(std::span<const Wrenchd> truth, std::span<const Wrenchd> check,
                                      const Limits& limits, double most_force, double most_torque) {
  Ticks t;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double f = truth[i].force.norm();
    const double m = truth[i].torque.norm();
    const bool in_air = f == 0 && m == 0 && check[i].force.norm() == 0 && check[i].torque.norm() == 0;
    const bool differ = relative_error(truth[i].force, check[i].force, kMinForce) > limits.force ||
                        relative_error(truth[i].torque, check[i].torque, kMinTorque) > limits.torque ||
                        (f >= kMinForce && angle_deg(truth[i].force, check[i].force) > limits.direction_deg);
    const bool beyond = f > most_force || m > most_torque;
    const bool counts = !in_air && !beyond && !differ;
    t.counts.push_back(counts ? 1 : 0);
    ++(in_air ? t.free : beyond ? t.beyond : differ ? t.undecided : t.used);
  }
  return t;
}

/// What is chosen for the Line approximation. One step length serves the search for first contact and the proxies.
struct LineSetting {
  int vertices = 50;
  double step = 0.5;  ///< voxels

  /// Moves of the proxies a tick, so that short steps get as far as the default ones.
  [[nodiscard]] int iterations() const;
  friend bool operator==(const LineSetting&, const LineSetting&) = default;
};

/// What is chosen for the Surface approximation.
struct SurfaceSetting {
  int sphere = 26;
  int slices = 20;
  int per_slice = 8;
  double search_step = 0.5;  ///< voxels

  friend bool operator==(const SurfaceSetting&, const SurfaceSetting&) = default;
};

/// The coupled tool has nothing to choose.
struct CoupledSetting {
  friend bool operator==(const CoupledSetting&, const CoupledSetting&) = default;
};

/// In the order of Algorithm.
using Setting = std::variant<LineSetting, SurfaceSetting, CoupledSetting>;

[[nodiscard]] Algorithm algorithm_of(const Setting& setting);

/// In a few words, without the algorithm's name.
[[nodiscard]] std::string describe(const Setting& setting);

/// The tool and what the scene is made with, to be printed as code.
struct Scene {
  Burr burr;
  double stiffness = 800;           ///< [N/m]
  double isovalue = 0;              ///< of the grid
  double max_force = 3.3;           ///< [N]
  double max_torque = 0.1;          ///< [N·m]; 0: the device gives none, and none is compared
  std::optional<double> density{};  ///< the isovalue among the file's own densities, where the grid has others
  std::string tool_name{};          ///< as `trephine::tool_by_name`; empty: the burr, else it has the tool's size
  std::string device{};             ///< as `trephine::device_preset`, which gives stiffness and limits; empty: none

  /// The tool named, if any.
  [[nodiscard]] std::optional<trephine::RevolvedTool> tool() const;
  /// What the coupled tool gets of the device.
  [[nodiscard]] trephine::CoupledOptions coupled_options() const;
  /// What Surface gets of it: none without its name.
  [[nodiscard]] std::optional<trephine::StiffnessBudget> budget() const;
};

/// C++ that makes a HapticScene named `scene` of a grid named `bone` with this setting, after
/// `#include <trephine/everything.hpp>`. Each renderer has the cut and the stages that the documents advise for it.
[[nodiscard]] std::string as_code(const Setting& setting, const Scene& scene);

/// The combinations that are tried.
[[nodiscard]] std::vector<Setting> settings_to_try(Algorithm algorithm, bool quick);
/// The finest setting, which is taken for the truth, and one half as fine, which says where that can be relied on.
[[nodiscard]] Setting truth_setting(Algorithm algorithm, bool quick);
[[nodiscard]] Setting check_setting(Algorithm algorithm, bool quick);

/// A renderer with one setting, ready to be led through cases again and again.
class Player {
 public:
  virtual ~Player() = default;
  /// Leads the tool through all cases, each from a renderer without history. Adds the wrench of every tick (in G, on
  /// the tool about T's origin) to `wrenches` where that is given. `ns` has room for every tick's time and keeps the
  /// shorter of what it holds and what it took now: what the tick itself needs, without what else the machine does.
  virtual void play(const std::vector<Case>& cases, std::vector<float>& ns, std::vector<Wrenchd>* wrenches) = 0;
};

/// Throws std::invalid_argument for settings or a tool that the library refuses. The bone must outlive it.
[[nodiscard]] std::unique_ptr<Player> make_player(const Setting& setting, const Scene& scene, const Grid& bone);

/// What was measured of one setting.
struct Measured {
  Setting setting;
  Errors errors{};
  double worst_share = 0;  ///< of the limits, by the worst of the three errors
  double median_us = 0;    ///< of a tick's time
  double p999_us = 0;      ///< what is compared with the budget
  int repetitions = 0;     ///< timed; fewer for settings that others beat clearly
  bool front = false;      ///< no other setting of its algorithm is as quick and as near the truth
};

/// What the truth of one algorithm was on these cases.
struct Truth {
  Ticks ticks;
  Errors check;  ///< of the setting half as fine: how far the truth itself may be off
  std::vector<Wrenchd> wrenches;
};

struct SweepOptions {
  bool quick = false;
  Limits limits{};
  int repetitions = 5;
  /// Settings that others beat this many times in median time at no more error are timed twice only; infinite: none.
  double clearly = 1.3;
  unsigned order_seed = 1;  ///< of the order in which settings are timed
};

/// Says how far a part of the work is: its name, the share done.
using Progress = std::function<void(const std::string& part, double share)>;

/// One algorithm's part of a sweep.
struct Trial {
  std::vector<Case> cases;
  Truth truth;
  std::vector<Measured> measured;
};

/// Finds the truth of the algorithm on its cases.
[[nodiscard]] Truth find_truth(Algorithm algorithm, const Grid& bone, const std::vector<Case>& cases,
                               const Scene& scene, const SweepOptions& options, const Progress& progress);

/// Measures settings (each trial's algorithm: the settings' own) against the trials' truths. The errors of a setting do
/// not depend on the run; times are the shortest of several repetitions, in each of which all settings take turns in a
/// new order, so that whatever slows the machine slows them alike. Marks the fronts.
void measure(std::vector<Trial>& trials, const std::vector<std::vector<Setting>>& settings, const Grid& bone,
             const Scene& scene, const SweepOptions& options, const Progress& progress);

/// Marks those that no other one equals or beats in both time (p999_us) and error (worst_share) while being better in
/// one; of equals the first.
void mark_front(std::vector<Measured>& measured);

/// Other places on the bone and another hour give slightly other figures, so a choice keeps to this share of limits
/// and budget.
inline constexpr double kMargin = 0.9;

/// What is made of one algorithm's measurements.
struct Choice {
  /// The quickest that keeps to the limits and the budget.
  std::optional<Measured> recommended;
  /// Without one: the quickest that keeps to the limits, whatever it costs; and the nearest to the truth.
  std::optional<Measured> within_limits;
  Measured nearest;
};

/// `budget_us`: of a tick's p99.9. Throws std::invalid_argument for no measurements.
[[nodiscard]] Choice choose(const std::vector<Measured>& measured, double budget_us);

/// Which of them, and why, in a sentence. Indices into `choices`; none where nothing is recommended.
struct Verdict {
  std::optional<std::size_t> winner;
  std::string reason;
};
[[nodiscard]] Verdict decide(const std::vector<Choice>& choices, double budget_us);

/// A whole study of one bone: places, truth, measurements, choice.
struct StudyOptions {
  CaseOptions cases{};
  SweepOptions sweep{};
  double budget_us = 50;
  std::vector<Algorithm> algorithms{kAlgorithms.begin(), kAlgorithms.end()};
};

struct Study {
  std::vector<Algorithm> algorithms;
  std::vector<Trial> trials;    ///< one for each algorithm
  std::vector<Choice> choices;  ///< likewise
  Verdict verdict;
};

/// Throws std::runtime_error where the bone offers too few contacts to say anything.
[[nodiscard]] Study carry_out(const Grid& bone, const Scene& scene, const StudyOptions& options,
                              const Progress& progress);

}  // namespace pick
