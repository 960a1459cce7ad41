// SPDX-License-Identifier: MIT
#include "pictures.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace drill {
namespace {

using trephine::Posed;
using trephine::Vec3d;

/// What all pictures of a run have in common, in G.
class Studio {
 public:
  Studio(const Bone& bone, const Surgeon& surgeon)
      : bone_(bone), X_GW_(bone.grid.X_WG().inverse()), R_(static_cast<float>(bone.burr.tip_radius)) {
    const trephine::Mat3d frame = X_GW_.linear() * surgeon.frame_W();
    lean_ = frame.col(0).cast<float>();
    across_ = frame.col(1).cast<float>();
    out_ = frame.col(2).cast<float>();
    up_ = (X_GW_.linear() * Vec3d::UnitZ()).cast<float>();
    spot_ = (X_GW_ * surgeon.spot().p_W).cast<float>();
  }

  [[nodiscard]] trephine::Pose<float> in_G(const Posed& X_W) const { return Posed(X_GW_ * X_W).cast<float>(); }
  [[nodiscard]] Vec3f in_G(const Vec3d& p_W) const { return (X_GW_ * p_W).cast<float>(); }

  /// From obliquely above, so that one looks into the hole and the shaft leans to the right.
  [[nodiscard]] Camera oblique(float height_in_radii, float raised, float steep = 0.75F) const {
    return look_at(spot_ + raised * R_ * out_, steep * out_ - across_, out_, height_in_radii * R_);
  }
  /// Square to the plane in which the shaft leans.
  [[nodiscard]] Camera along_section(float height_in_radii, float raised) const {
    return look_at(spot_ + raised * R_ * out_, -across_, out_, height_in_radii * R_);
  }
  /// All of the bone, with the spot on the near side.
  [[nodiscard]] Camera overall(const PicturedBone& surface) const {
    const Vec3f middle = 0.5F * (surface.lo() + surface.hi());
    const bool on_top = std::abs(out_.dot(up_)) > 0.8F;
    const Vec3f from = out_ - 0.9F * across_.cross(out_).normalized() + (on_top ? -0.9F * across_ : 0.30F * up_);
    Camera camera = look_at(middle, from, on_top ? out_ : up_, 1);
    // Just large enough for all bone and the drill.
    Eigen::AlignedBox2f seen;
    const auto include = [&](const Vec3f& p) {
      seen.extend(Eigen::Vector2f((p - middle).dot(camera.right), (p - middle).dot(camera.up)));
    };
    const Grid& grid = bone_.grid;
    for (int k = 0; k < grid.size()[2]; k += 2)
      for (int j = 0; j < grid.size()[1]; j += 2)
        for (int i = 0; i < grid.size()[0]; i += 2)
          if (grid.at(i, j, k) >= bone_.isovalue) include(grid.spacing().cwiseProduct(Vec3d(i, j, k)).cast<float>());
    const float tool = 1.3F * static_cast<float>(bone_.burr.shaft_length);
    include(spot_ + std::min(tool, 0.35F * (surface.hi() - surface.lo()).norm()) * out_);
    camera.centre += seen.center().x() * camera.right + seen.center().y() * camera.up;
    constexpr float kAspect = 0.62F;  // of the scene, height over width
    camera.height = 1.1F * std::max(seen.sizes().y(), kAspect * seen.sizes().x());
    return camera;
  }

  /// Low over the bone, so that its relief and the hole's edge show.
  [[nodiscard]] Vec3f raking_light() const { return -0.75F * lean_ + 0.62F * out_ - 0.25F * across_; }

  [[nodiscard]] Picture picture(const PicturedBone& surface) const {
    Picture p;
    p.bone = &surface;
    p.burr = bone_.burr;
    p.shape = bone_.tool ? &*bone_.tool : nullptr;
    return p;
  }

  [[nodiscard]] std::string about_bone() const {
    const auto& n = bone_.grid.size();
    const Vec3d mm = 1e3 * bone_.grid.spacing();
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), "%d x %d x %d voxels of %.3g x %.3g x %.3g mm, surface at %g %s", n[0],
                  n[1], n[2], mm.x(), mm.y(), mm.z(), bone_.density(bone_.isovalue), bone_.unit.c_str());
    return text.data();
  }

  [[nodiscard]] const Bone& bone() const { return bone_; }

 private:
  const Bone& bone_;
  Posed X_GW_;
  float R_;
  Vec3f lean_, across_, out_, up_, spot_;
};

std::string capitalised(std::string text) {
  if (!text.empty() && text[0] >= 'a' && text[0] <= 'z') text[0] = static_cast<char>(text[0] - 'a' + 'A');
  return text;
}

std::string in_millimetres(const Bone& bone) {
  if (bone.tool) return bone.tool_name + " mm";
  const trephine::Burr& burr = bone.burr;
  std::array<char, 120> text{};
  std::snprintf(text.data(), text.size(), "burr %.3g mm, shaft %.3g mm in diameter", 2e3 * burr.tip_radius,
                2e3 * burr.shaft_radius);
  return text.data();
}

}  // namespace

Shot shot_of_whole(const Bone& bone, const PicturedBone& surface, const Surgeon& surgeon) {
  const Studio studio(bone, surgeon);
  Picture whole = studio.picture(surface);
  whole.camera = studio.overall(surface);
  whole.tool = studio.in_G(surgeon(0.6 * surgeon.ends(Surgeon::kApproach)).X_DH);
  whole.tool_label = "drill: " + in_millimetres(bone);
  whole.title = capitalised(bone.name) + " before drilling";
  whole.subtitle = studio.about_bone();
  return {"before.png", whole};
}

Shot shot_of_spot(const Bone& bone, const PicturedBone& surface, const Surgeon& surgeon) {
  const Studio studio(bone, surgeon);
  Picture close = studio.picture(surface);
  close.tool_label = "drill: " + in_millimetres(bone);
  close.subtitle = studio.about_bone();
  close.camera = studio.oblique(12, 1.9F);
  close.light = studio.raking_light();
  close.tool = studio.in_G(surgeon(surgeon.ends(Surgeon::kApproach)).X_DH);
  close.title = "The spot, before drilling";
  return {"before_close.png", close};
}

std::vector<Shot> shots_of_run(const Bone& bone, const PicturedBone& before, const PicturedBone& after,
                               const Surgeon& surgeon, const RunLog& log) {
  const Studio studio(bone, surgeon);
  const bool line = log.algorithm == "line";
  const bool proxy = log.algorithm != "surface";
  const std::string name = capitalised(log.algorithm);
  const LogRow& row = log.rows[std::min(log.pictured, log.rows.size() - 1)];

  Picture lean = studio.picture(after);
  lean.uncut = &before;
  lean.camera = studio.oblique(10, 1.6F, 1.3F);
  lean.light = studio.raking_light();
  lean.tool = studio.in_G(row.drawn);
  lean.tool_label = "drill";
  if (proxy) {
    lean.tool_label = "drill as drawn: its proxy, held on the surface";
    lean.ghost = studio.in_G(row.probe);
    lean.ghost_label = "probe: where the hand holds it";
  }
  if (line) {
    lean.points_label = "intersection point of the shaft";
    if (row.contact.shaft) lean.points.push_back(studio.in_G(row.intersection));
  } else {
    lean.points_label = proxy ? "places in contact" : "vertices in contact";
    for (const Vec3d& p : log.touching) lean.points.push_back(studio.in_G(p));
  }
  std::array<char, 160> figures{};
  std::snprintf(figures.data(), figures.size(), "force %.2f N, torque %.2f mN*m, %.3g mm^3 of bone removed",
                row.wrench.force.norm(), 1e3 * row.wrench.torque.norm(), row.removed_mm3);
  lean.title = name + (row.contact.shaft ? ": the shaft leans on the rim" : ": the drill leans over in its hole");
  lean.subtitle = figures.data();

  Picture section = lean;
  section.section = true;
  section.light.reset();
  section.camera = studio.along_section(7.5F, 0.3F);
  section.title = name + ": the same, cut open along the hole";

  Picture hole = studio.picture(after);
  hole.uncut = &before;
  hole.camera = studio.oblique(6.5F, 0, 1.6F);
  hole.light = studio.raking_light();
  std::snprintf(figures.data(), figures.size(), "%.3g mm^3 of bone removed; %s", log.rows.back().removed_mm3,
                in_millimetres(bone).c_str());
  hole.title = name + ": the hole";
  hole.subtitle = figures.data();
  return {{log.algorithm + "_lean.png", lean},
          {log.algorithm + "_section.png", section},
          {log.algorithm + "_after.png", hole}};
}

Picture picture_of_structures(const Bone& bone, const PicturedBone& before, const PicturedBone& after,
                              const DrawnStructures& structures, const Surgeon& surgeon, int shown, const Show* show) {
  const Studio studio(bone, surgeon);
  Picture p = studio.picture(after);
  p.structures = &structures;
  p.section = true;
  p.camera = studio.along_section(13, -3.0F);
  p.tool_label = "drill";
  if (show == nullptr) {
    p.tool = studio.in_G(surgeon(surgeon.ends(Surgeon::kApproach)).X_DH);
    p.title = "Before, cut open";
    p.subtitle = "labels made by thresholds or formulas, not anatomy";
    return p;
  }
  double swept = 0, push = 0;
  for (const ShowRun& run : show->runs) {
    swept += run.swept_mm3;
    push = std::max(push, run.greatest_guard());
  }
  p.uncut = &before;
  p.tool = studio.in_G(show->runs[static_cast<std::size_t>(shown)].deepest);
  p.title = capitalised(show->protection == Protection::kNothing ? "no protection" : name_of(show->protection));
  std::array<char, 160> figures{};
  const int length = std::snprintf(figures.data(), figures.size(), "%.2g mm^3 of structures swept", swept);
  if (push > 0)
    std::snprintf(figures.data() + length, figures.size() - static_cast<std::size_t>(length), ", push up to %.2g N",
                  push);
  p.subtitle = figures.data();
  return p;
}

}  // namespace drill
