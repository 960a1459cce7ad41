// SPDX-License-Identifier: MIT
#include "structure_show.hpp"

#include "algorithms.hpp"
#include "checks.hpp"
#include "csv.hpp"
#include "run.hpp"
#include "scene.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/veto.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/structure/tool_distance.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>

namespace drill {
namespace {

using namespace trephine;
using Field = std::shared_ptr<const StructureField>;

// Lengths in burr radii.
constexpr double kGuardMargin = 2.0 / 3, kVetoMargin = 1.0 / 3;  // 1 mm and 0.5 mm for a burr of 1.5 mm
constexpr double kSmoothing = 0.4;
constexpr double kStart = 2.5;   // of the burr's centre over the surface
constexpr double kBeyond = 2.0;  // the structure's near side: so much deeper the hand wants the burr's lowest point
constexpr double kReach = 5;     // distances that are told apart

/// A hand that pushes the drill straight onto a structure, holds it there and withdraws.
class PushingHand {
 public:
  PushingHand(const Approach& way, const Mat3d& frame_W, double radius, double cut_speed, double wanted_seconds)
      : way_(way),
        frame_W_(frame_W),
        above_(kStart * radius),
        below_(way.depth + (kBeyond - 1) * radius),
        // A third as fast as the burr can cut, at most: a faster hand runs ahead of the drill.
        seconds_(std::max(wanted_seconds, 3 * (above_ + below_) / (kDown * cut_speed))) {}

  [[nodiscard]] HandTarget operator()(double time) const noexcept {
    const double share = time / seconds_;
    const double down = std::min(share / kDown, 1.0) - std::max((share - kHold) / (1 - kHold), 0.0);
    const double height = above_ - (above_ + below_) * down;
    return {make_pose<double>(frame_W_, way_.entry_W + height * frame_W_.col(2)), share < kHold ? 1U : 0U};
  }
  [[nodiscard]] double seconds() const noexcept { return seconds_; }

 private:
  static constexpr double kDown = 0.7, kHold = 0.92;  // shares of the time at which these end

  Approach way_;
  Mat3d frame_W_;
  double above_, below_;
  double seconds_;
};

/// Distance of ball and shaft from one structure, whose signed distance is `distance(p)`, at places `step` apart.
template <class Distance>
double distance_from_one(const Distance& distance, const Burr& burr, const Posed& X_ST, double step) {
  const Vec3d tip = X_ST.translation(), axis = X_ST.linear().col(2);
  double least = distance(tip) - burr.tip_radius;
  for (double z = 0; z < burr.shaft_length;) {
    const double d = distance(tip + z * axis) - burr.shaft_radius;
    least = std::min(least, d);
    z += std::max(d - least, step);
  }
  return least;
}

/// Clears the labels in the ball; returns how many of `structure` there were.
int clear_ball(const StructureLabels& labels, std::vector<std::uint8_t>& left, int structure, const Vec3d& p_S,
               double radius) noexcept {
  const Vec3d u = p_S.cwiseQuotient(labels.spacing());
  const Vec3d r = Vec3d::Constant(radius).cwiseQuotient(labels.spacing());
  const Eigen::Vector3i lo = (u - r).array().ceil().cast<int>(), hi = (u + r).array().floor().cast<int>();
  int cleared = 0;
  for (int k = lo.z(); k <= hi.z(); ++k)
    for (int j = lo.y(); j <= hi.y(); ++j)
      for (int i = lo.x(); i <= hi.x(); ++i) {
        if (labels.at(i, j, k) == 0 || (labels.spacing().cwiseProduct(Vec3d(i, j, k)) - p_S).norm() > radius) continue;
        std::uint8_t& label = left[labels.index(i, j, k)];
        if (std::exchange(label, std::uint8_t{0}) == structure + 1) ++cleared;
      }
  return cleared;
}

Field field_of(const StructureLabels& labels, std::span<const std::uint8_t> voxels, double reach) {
  return build_structure_field({labels.size(), labels.spacing(), voxels}, {.reach = reach});
}

using Voxels = std::vector<std::array<int, 3>>;

/// Voxels of bone whose centre lies in the structure.
Voxels bone_in(const StructureField& field, int structure, const Posed& X_SG, const Grid& bone, double isovalue) {
  Voxels found;
  for (int k = 0; k < bone.size()[2]; ++k)
    for (int j = 0; j < bone.size()[1]; ++j)
      for (int i = 0; i < bone.size()[0]; ++i)
        if (bone.at(i, j, k) >= isovalue &&
            field.distance(structure, X_SG * Vec3d(bone.spacing().cwiseProduct(Vec3d(i, j, k)))) < 0)
          found.push_back({i, j, k});
  return found;
}

/// How many of the voxels are gone.
std::ptrdiff_t gone(const Voxels& voxels, const Grid& bone, double isovalue) {
  return std::count_if(voxels.begin(), voxels.end(),
                       [&](const auto& v) { return bone.at(v[0], v[1], v[2]) < isovalue; });
}

Show drilled(Protection protection, const StructureShow& all, const std::vector<Voxels>& bone_of, const Bone& about,
             const Options& options) {
  const StructureField& field = *all.field;
  const StructureLabels& labels = all.made.labels;
  const double R = about.burr.tip_radius;
  const int count = all.made.count();
  Show show{.protection = protection, .bone = fresh_copy(about.grid), .left = {}, .runs = {}};
  show.runs.resize(static_cast<std::size_t>(count));
  const Posed X_GS = show.bone.X_WG().inverse() * labels.X_WS();
  std::vector<std::uint8_t> left(labels.voxels().begin(), labels.voxels().end());

  // The library's own figures, but for the margins.
  const std::vector<GuardedStructure> guarded(static_cast<std::size_t>(count), {.margin = kGuardMargin * R});
  const auto potential = std::make_shared<const GuardPotential>(all.field, X_GS, about.burr, guarded,
                                                                GuardPotentialOptions{.smoothing = kSmoothing * R});
  const StructureVeto veto = protection == Protection::kVeto ? StructureVeto{.margin = kVetoMargin * R}
                                                             : StructureVeto{.mode = StructureVeto::Mode::kWatch};
  const std::vector<StructureVeto> vetoes(static_cast<std::size_t>(count), veto);
  const auto floor = make_cut_floor(field, X_GS, show.bone, about.isovalue, vetoes);
  const CoupledToolRenderer renderer{
      about.burr,
      CoupledOptions{.stiffness = kStiffness, .rotational_stiffness = 0.3, .force = kMaxForce, .torque = kMaxTorque}};

  for (int s = 0; s < count; ++s) {
    ShowRun& run = show.runs[static_cast<std::size_t>(s)];
    run.structure = s;
    floor->reset_counts();
    auto scene =
        scene_with(show.bone, about, renderer, DeviceLimits{.force = kMaxForce, .torque = kMaxTorque}, bite(about),
                   Veto{floor}, StructureGuard{potential, {.push = protection != Protection::kNothing}});
    const PushingHand hand(all.made.approaches[static_cast<std::size_t>(s)], all.made.frame_W, R, bite(about).speed,
                           options.seconds / 2);
    run.rows.reserve(static_cast<std::size_t>(1000 * hand.seconds()) + 16);
    const Voxels& its_bone = bone_of[static_cast<std::size_t>(s)];
    const std::ptrdiff_t gone_before = gone(its_bone, show.bone, about.isovalue);
    int cleared = 0;
    double least = field.reach(), true_least = least;
    const double step = field.spacing().minCoeff();
    const auto watch = [&](const LogRow& row) noexcept {
      const Posed X_ST = labels.X_WS().inverse() * row.drawn;
      const auto by_labels = [&](const Vec3d& p_S) { return field.distance(s, p_S); };
      const double distance = distance_from_one(by_labels, about.burr, X_ST, step);
      if (all.made.truth) {
        const auto by_formula = [&](const Vec3d& p_W) { return all.made.truth(s, p_W); };
        true_least = std::min(true_least, distance_from_one(by_formula, about.burr, row.drawn, step));
      }
      if (distance < least) {
        least = distance;
        run.deepest = row.drawn;
      }
      if (hand(row.time).buttons != 0) cleared += clear_ball(labels, left, s, X_ST.translation(), R);
      const Vec3d& push = row.structures.push.force;
      const ToolDistance nearest = trephine::tool_distance(field, about.burr, X_ST);
      run.rows.push_back({row.time, distance, (row.wrench.force - push).norm(), push.norm(), row.removed_mm3,
                          floor->refused_mm3(s), row.structures, nearest.structure, nearest.distance});
    };
    const std::string label = labels.structures()[static_cast<std::size_t>(s)].name + ", " + name_of(protection);
    (void)perform("coupled", scene, hand, 0, options.real_time, label, watch);
    run.swept_mm3 = 1e9 * labels.spacing().prod() * cleared;
    run.taken_mm3 =
        1e9 * show.bone.spacing().prod() * static_cast<double>(gone(its_bone, show.bone, about.isovalue) - gone_before);
    run.watched_mm3 = floor->taken_mm3(s);
    run.true_distance = true_least;
  }
  show.left = field_of(labels, left, field.reach());
  return show;
}

}  // namespace

const char* name_of(Protection protection) {
  switch (protection) {
    case Protection::kNothing:
      return "nothing";
    case Protection::kGuard:
      return "guard";
    case Protection::kVeto:
      break;
  }
  return "guard and veto";
}

double ShowRun::least_distance() const {
  double least = rows.front().distance;
  for (const ShowRow& row : rows) least = std::min(least, row.distance);
  return least;
}

double ShowRun::greatest_guard() const {
  double greatest = 0;
  for (const ShowRow& row : rows) greatest = std::max(greatest, row.guard_N);
  return greatest;
}

StructureShow show_structures(const Bone& bone, const Options& options, MadeStructures made) {
  StructureShow show{.made = std::move(made), .field = {}, .shows = {}};
  const StructureLabels& labels = show.made.labels;
  show.field = field_of(labels, labels.voxels(), kReach * bone.burr.tip_radius);
  const Posed X_SG = labels.X_WS().inverse() * bone.grid.X_WG();
  std::vector<Voxels> bone_of;
  for (int s = 0; s < show.made.count(); ++s)
    bone_of.push_back(bone_in(*show.field, s, X_SG, bone.grid, bone.isovalue));
  for (const Protection p : kProtections) show.shows.push_back(drilled(p, show, bone_of, bone, options));
  return show;
}

void print_table(const StructureShow& show) {
  const bool exact = static_cast<bool>(show.made.truth);
  std::printf("\n%-14s %-15s %10s %8s %8s %10s %9s %9s %9s\n", "structure", "protection", "nearest",
              exact ? "exact" : "", "guard", "removed", "swept", "taken", "refused");
  std::printf("%-14s %-15s %10s %8s %8s %10s %9s %9s %9s\n", "", "", "mm", exact ? "mm" : "", "N", "mm3", "mm3", "mm3",
              "mm3");
  for (int s = 0; s < show.made.count(); ++s)
    for (const Show& each : show.shows) {
      const ShowRun& run = each.runs[static_cast<std::size_t>(s)];
      std::array<char, 16> by_formula{};
      if (exact) std::snprintf(by_formula.data(), by_formula.size(), "%.2f", 1e3 * run.true_distance);
      std::printf("%-14s %-15s %10.2f %8s %8.2f %10.3g %9.3g %9.3g %9.3g\n",
                  show.made.labels.structures()[static_cast<std::size_t>(s)].name.c_str(), name_of(each.protection),
                  1e3 * run.least_distance(), by_formula.data(), run.greatest_guard(), run.rows.back().removed_mm3,
                  run.swept_mm3, run.taken_mm3, run.rows.back().refused_mm3);
    }
  std::printf(
      "nearest: least distance of the drawn tool from the structure, negative inside; guard: its greatest push;\n"
      "%s"
      "swept: of the structure, bone or not, where the turning burr was; taken: bone in it that is gone;\n"
      "refused: bone in it or its margin that the veto kept.\n",
      exact ? "exact: the same by the structure's formula instead of its labels;\n" : "");
}

void write_csv(const StructureShow& show, const std::string& path) {
  Csv csv(path,
          "time_s,structure,protection,drawn_distance_m,contact_N,guard_N,removed_mm3,refused_mm3,device_nearest,"
          "device_nearest_m,drawn_nearest,drawn_nearest_m,push_fx_N,push_fy_N,push_fz_N,tick_refused_mm3,"
          "tick_taken_mm3,warns");
  const auto name_at = [&](int structure) {
    return structure < 0 ? "none" : show.made.labels.structures()[static_cast<std::size_t>(structure)].name.c_str();
  };
  for (const Show& each : show.shows)
    for (const ShowRun& run : each.runs)
      for (const ShowRow& r : run.rows)
        csv.row(r.time, name_at(run.structure), name_of(each.protection), r.distance, r.contact_N, r.guard_N,
                r.removed_mm3, r.refused_mm3, name_at(r.tick.nearest), r.tick.distance, name_at(r.drawn_nearest),
                r.drawn_distance, r.tick.push.force, r.tick.refused_mm3, r.tick.taken_mm3, r.tick.warns ? 1 : 0);
  csv.close();
}

int check(const StructureShow& show) {
  Checks checks;
  for (int s = 0; s < show.made.count(); ++s) {
    const auto at = static_cast<std::size_t>(s);
    const std::string name = show.made.labels.structures()[at].name;
    bool counts_agree = true, ticks_agree = true, exact_agree = true, exact_whole = true;
    for (const Show& each : show.shows) {
      const ShowRun& run = each.runs[at];
      if (each.protection == Protection::kNothing)
        checks.expect(run.least_distance() < 0 && run.swept_mm3 > 0,
                      name + ": without protection the burr sweeps part of it");
      if (each.protection == Protection::kVeto)
        checks.expect(run.least_distance() > 0 && run.swept_mm3 == 0 && run.taken_mm3 == 0,
                      name + ": with the veto it stays whole");
      if (show.made.truth) {
        const double off = std::abs(run.true_distance - run.least_distance());
        exact_agree = exact_agree && (run.true_distance < 0 || off < show.made.labels.spacing().maxCoeff() / 2);
        exact_whole = exact_whole && (each.protection != Protection::kVeto || run.true_distance > 0);
      }
      if (each.protection != Protection::kVeto)
        counts_agree = counts_agree && std::abs(run.watched_mm3 - run.taken_mm3) < 1e-6;
      double refused = 0, taken = 0;
      for (const ShowRow& row : run.rows) {
        refused += row.tick.refused_mm3;
        taken += row.tick.taken_mm3;
      }
      ticks_agree = ticks_agree && refused >= run.rows.back().refused_mm3 - 1e-6 && taken >= run.watched_mm3 - 1e-6;
    }
    checks.expect(ticks_agree, name + ": ticks add up to what was refused and taken");
    checks.expect(counts_agree, name + ": the library counts the bone that is gone");
    if (!show.made.truth) continue;
    checks.expect(exact_whole, name + ": with the veto no drill comes into its formula");
    checks.expect(exact_agree, name + ": outside of it, labels and formula agree within half a label voxel");
  }
  return checks.failed();
}

}  // namespace drill
