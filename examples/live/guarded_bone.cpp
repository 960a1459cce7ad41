// SPDX-License-Identifier: MIT
#include "guarded_bone.hpp"

#include "../drill/structures.hpp"

#include <trephine/stage/motion.hpp>
#include <trephine/structure/labelled_field.hpp>
#include <trephine/structure/structure_veto.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <future>
#include <limits>
#include <stdexcept>
#include <utility>
#include <variant>

namespace live {
namespace {

using namespace trephine;
using Field = std::shared_ptr<const StructureField>;

/// The box of voxels that holds all structures.
template <VoxelLabel Label>
VoxelBox box_of_all(const LabelGrid<Label>& labels) {
  VoxelBox all = labels.box_of(labels.structures().front().label);
  for (const Structure& s : labels.structures()) {
    const VoxelBox box = labels.box_of(s.label);
    for (std::size_t a = 0; a < 3; ++a) {
      all.lo[a] = std::min(all.lo[a], box.lo[a]);
      all.hi[a] = std::max(all.hi[a], box.hi[a]);
    }
  }
  return all;
}

/// Least distance [m] between the bone's volume and a box of voxels, along G's axes; 0 or less where they meet.
double gap_to_bone(const drill::Grid& bone, const Posed& X_GS, const VoxelBox& box, const Vec3d& spacing) {
  Vec3d lo = Vec3d::Constant(std::numeric_limits<double>::max()), hi = -lo;
  for (std::size_t corner = 0; corner < 8; ++corner) {
    Vec3d u;
    for (std::size_t a = 0; a < 3; ++a)
      u[static_cast<Eigen::Index>(a)] = (corner >> a & 1) != 0 ? box.hi[a] : box.lo[a];
    const Vec3d p_G = X_GS * Vec3d(u.cwiseProduct(spacing));
    lo = lo.cwiseMin(p_G);
    hi = hi.cwiseMax(p_G);
  }
  const Vec3d size = bone.spacing().cwiseProduct(Vec3d(bone.size()[0], bone.size()[1], bone.size()[2]));
  return std::max((-hi).maxCoeff(), (lo - size).maxCoeff());
}

/// Names the structures that lie farther from the bone's volume than the field reaches: a drill in bone never meets
/// their guard, and they may be another scan's.
template <VoxelLabel Label>
void note_unreached(const LabelGrid<Label>& labels, const drill::Grid& bone, const Posed& X_GS, double reach,
                    std::vector<std::string>& notes) {
  for (const Structure& s : labels.structures()) {
    const double gap = gap_to_bone(bone, X_GS, labels.box_of(s.label), labels.spacing());
    if (!(gap > reach)) continue;
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "' lies %.0f mm beside the bone, farther than any guard reaches (%.1f mm); is it of this scan?",
                  1e3 * gap, 1e3 * reach);
    notes.push_back("structure '" + s.name + text.data());
  }
}

/// The share of a structure's voxels that are no bone.
template <VoxelLabel Label>
double soft_share(const LabelGrid<Label>& labels, const Structure& structure, const drill::Bone& bone,
                  const Posed& X_GS) {
  const VoxelBox box = labels.box_of(structure.label);
  const auto& n = bone.grid.size();
  std::size_t soft = 0;
  for (int k = box.lo[2]; k <= box.hi[2]; ++k)
    for (int j = box.lo[1]; j <= box.hi[1]; ++j)
      for (int i = box.lo[0]; i <= box.hi[0]; ++i) {
        if (labels.at(i, j, k) != structure.label) continue;
        const Vec3d u =
            (X_GS * Vec3d(labels.spacing().cwiseProduct(Vec3d(i, j, k)))).cwiseQuotient(bone.grid.spacing());
        const Vec3d v = u.array().round();
        const bool inside = (v.array() >= 0).all() && v.x() < n[0] && v.y() < n[1] && v.z() < n[2];
        const auto at = [&](Eigen::Index a) { return static_cast<int>(v[a]); };
        soft += inside && bone.grid.at(at(0), at(1), at(2)) >= bone.isovalue ? 0 : 1;
      }
  return static_cast<double>(soft) / static_cast<double>(labels.voxel_count(structure.label));
}

/// Makes structures soft as their names say.
template <VoxelLabel Label>
void soften(GuardedBone& guarded, const LabelGrid<Label>& labels, const drill::Bone& bone) {
  constexpr double kLeast = 0.1;  // a thin nerve's image is mostly the bone's around it
  for (const Structure& s : guarded.structures) {
    std::optional<Membrane> membrane = membrane_named(s.name);
    if (membrane && soft_share(labels, s, bone, guarded.X_GS) < kLeast) {
      membrane.reset();
      guarded.notes.push_back("structure '" + s.name + "' is bone in this volume, so it is not felt as soft");
    }
    guarded.soft.push_back(membrane);
  }
}

/// Builds on other threads, and tells how far it is: each quarter.
template <VoxelLabel Label>
Field built(const LabelGrid<Label>& labels, double reach, const TellDone& tell) {
  BuildProgress progress;
  auto field = std::async(std::launch::async,
                          [&]() -> Field { return build_structure_field(labels, {.reach = reach}, &progress); });
  int quarter = 1;
  while (field.wait_for(std::chrono::milliseconds(50)) != std::future_status::ready) {
    const float done = progress.done.load(std::memory_order_relaxed);
    if (done < 0.25F * static_cast<float>(quarter)) continue;
    tell(static_cast<double>(done));
    quarter = static_cast<int>(4 * done) + 1;
  }
  return field.get();
}

void make_floors(GuardedBone& guarded, const drill::Bone& bone) {
  const std::size_t count = guarded.structures.size();
  const auto floor = [&](const StructureVeto& veto) {
    return make_cut_floor(*guarded.field, guarded.X_GS, bone.grid, bone.isovalue,
                          std::vector<StructureVeto>(count, veto));
  };
  guarded.watch = floor({.mode = StructureVeto::Mode::kWatch});
  guarded.refuse = floor({.margin = kVetoShare * guarded.margin});
}
}  // namespace

void print_done(double share) {
  std::printf("         distances to structures: %.0f %%\n", 100 * share);
  std::fflush(stdout);
}

double largest_burr(const drill::Bone& bone) {
  const Vec3d size =
      bone.grid.spacing().cwiseProduct(Vec3d(bone.grid.size()[0], bone.grid.size()[1], bone.grid.size()[2]));
  return std::max(std::min(6e-3, 0.2 * size.minCoeff()), bone.burr.tip_radius);
}

std::shared_ptr<const GuardedBone> guard_copy(const GuardedBone& guarded, const drill::Bone& copy) {
  auto again = std::make_shared<GuardedBone>(guarded);
  make_floors(*again, copy);
  return again;
}

std::shared_ptr<const GuardedBone> guard_bone(const drill::Bone& bone, const drill::AnyLabels& any, double margin,
                                              std::vector<std::string> notes, const TellDone& tell) {
  auto guarded = std::make_shared<GuardedBone>();
  guarded->notes = std::move(notes);
  guarded->margin = margin;
  guarded->smoothing = std::clamp(0.6 * margin, 0.1e-3, 0.6e-3);
  std::visit(
      [&](const auto& labels) {
        if (labels.structures().empty()) throw std::runtime_error("the labels hold no structure");
        guarded->structures = labels.structures();
        guarded->X_GS = relative_pose(bone.grid.X_WG(), labels.X_WS());
        guarded->box = box_of_all(labels);
        if (gap_to_bone(bone.grid, guarded->X_GS, guarded->box, labels.spacing()) >= 0)
          throw std::runtime_error("the labels lie beside the bone; are they of another scan?");
        // Far enough for the largest burr, or for as large a one as the field can serve.
        const Burr largest{.tip_radius = largest_burr(bone), .shaft_radius = 0, .shaft_length = 0};
        const double most = 127 * labels.spacing().maxCoeff();
        soften(*guarded, labels, bone);
        const SoftOptions soft{.smoothing = guarded->smoothing};
        const double wanted =
            std::max({SoftStructures::required_reach(largest, guarded->soft, soft),
                      GuardPotential::required_reach(largest, margin, guarded->smoothing),
                      bone.tool ? GuardPotential::required_reach(*bone.tool, margin, guarded->smoothing) : 0.0,
                      required_veto_reach(bone.grid, kVetoShare * margin), labels.spacing().maxCoeff()});
        guarded->largest_radius = largest.tip_radius - std::max(wanted - most, 0.0);
        if (!(guarded->largest_radius >= bone.burr.tip_radius))
          throw std::runtime_error("the labels' voxels are too fine for a burr of this size; give a smaller --tool");
        note_unreached(labels, bone.grid, guarded->X_GS, std::min(wanted, most), guarded->notes);
        guarded->field = built(labels, std::min(wanted, most), tell);
      },
      any);
  make_floors(*guarded, bone);
  return guarded;
}

namespace {
/// Returns what `make` makes for a revolved tool or a burr.
template <class Make>
auto made_for(const AnyTool& tool, const Make& make) {
  return tool.visit([&](const auto& one) {
    if constexpr (requires { one.outline(); })
      return make(one);
    else
      return make(one.burr());
  });
}
}  // namespace

std::shared_ptr<const GuardPotential> potential_for(const GuardedBone& guarded, const AnyTool& tool) {
  const std::vector<GuardedStructure> all(guarded.structures.size(), {.margin = guarded.margin});
  return made_for(tool, [&](const auto& one) {
    return std::make_shared<const GuardPotential>(guarded.field, guarded.X_GS, one, all,
                                                  GuardPotentialOptions{.smoothing = guarded.smoothing});
  });
}

std::shared_ptr<const SoftStructures> soft_for(const GuardedBone& guarded, const AnyTool& tool) {
  const auto is_soft = [](const std::optional<Membrane>& m) { return m.has_value(); };
  if (std::none_of(guarded.soft.begin(), guarded.soft.end(), is_soft)) return nullptr;
  return made_for(tool, [&](const auto& one) {
    return std::make_shared<const SoftStructures>(guarded.field, guarded.X_GS, one, guarded.soft,
                                                  SoftOptions{.smoothing = guarded.smoothing});
  });
}

std::optional<Membrane> membrane_named(const std::string& name) {
  std::vector<std::string> words(1);
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool is_upper = name[i] >= 'A' && name[i] <= 'Z', is_lower = name[i] >= 'a' && name[i] <= 'z';
    const bool begins = !is_upper && !is_lower ? true : is_upper && i > 0 && name[i - 1] >= 'a' && name[i - 1] <= 'z';
    if (begins) words.emplace_back();
    if (is_upper || is_lower) words.back().push_back(static_cast<char>(is_upper ? name[i] - 'A' + 'a' : name[i]));
  }
  const auto has = [&](const auto&... word) {
    return ((std::find(words.begin(), words.end(), word) != words.end()) || ...);
  };
  // Most sinuses of the skull hold air.
  const bool is_vein = words.size() == 1 || has("sigmoid", "transverse", "sagittal", "straight", "venous", "petrosal");
  if (has("sinus", "sinuses") && is_vein) return sinus_wall();
  if (has("dura")) return dura();
  if (has("nerve", "nerves")) return nerve();
  return std::nullopt;
}

std::shared_ptr<const GuardedBone> guard_made_structures(const drill::Bone& bone, const drill::Spot& spot,
                                                         double margin) {
  return guard_bone(bone, drill::make_structures(bone, drill::Surgeon(spot, bone.burr, {})).labels, margin);
}

}  // namespace live
