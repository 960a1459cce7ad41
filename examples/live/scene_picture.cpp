// SPDX-License-Identifier: MIT
#include "scene_picture.hpp"

#include "shaders.hpp"

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace live {
namespace {

/// Millimetres: the shaders' lengths.
constexpr double kMm = 1e3;

GLint place(const gl::Program& program, const char* name) { return glGetUniformLocation(program.name(), name); }
void set(const gl::Program& p, const char* name, const Vec3d& v) {
  glUniform3f(place(p, name), static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()));
}
void set(const gl::Program& p, const char* name, double v) { glUniform1f(place(p, name), static_cast<float>(v)); }
void set(const gl::Program& p, const char* name, bool v) { glUniform1i(place(p, name), v ? 1 : 0); }
void set(const gl::Program& p, const char* name, float x, float y) { glUniform2f(place(p, name), x, y); }

void set_tool(const gl::Program& p, const std::string& name, const Posed& X_GT) {
  const Eigen::Matrix3f axes = X_GT.linear().cast<float>();
  glUniformMatrix3fv(place(p, (name + ".axes").c_str()), 1, GL_FALSE, axes.data());
  set(p, (name + ".tip").c_str(), Vec3d(kMm * X_GT.translation()));
}

/// The outline of a tool, or none: places in mm, and what is round.
void set_outline(const gl::Program& p, const SceneView& view) {
  std::vector<float> ends, arcs, middles;
  if (view.shape) {
    const auto push = [](std::vector<float>& to, std::array<double, 4> v) {
      for (const double x : v) to.push_back(static_cast<float>(x));
    };
    for (const trephine::ToolOutline::Piece& q : view.shape->outline().pieces()) {
      push(ends, {kMm * q.rho, kMm * q.z, kMm * q.end_rho, kMm * q.end_z});
      push(arcs, {kMm * q.centre_rho, kMm * q.centre_z, kMm * q.radius, q.side});
      push(middles, {q.middle_rho, q.middle_z, q.cosine, 0});
    }
    const trephine::ToolBounds b = view.shape->bounds();
    // A drill's flutes go on behind its cone.
    const double fluted = view.flutes == 2 ? 0.6 * b.z_high : b.head_top;
    glUniform4f(place(p, "shape"), static_cast<float>(kMm * b.z_low), static_cast<float>(kMm * b.z_high),
                static_cast<float>(kMm * b.radius), static_cast<float>(kMm * fluted));
  }
  const auto count = static_cast<GLsizei>(ends.size() / 4);
  glUniform1i(place(p, "pieces"), count);
  set(p, "flutes", static_cast<double>(view.flutes));
  if (count == 0) return;
  glUniform4fv(place(p, "ends"), count, ends.data());
  glUniform4fv(place(p, "arcs"), count, arcs.data());
  glUniform4fv(place(p, "middles"), count, middles.data());
}

/// The R2 sequence: places that fill a pixel evenly however many are taken.
double spread(int i, double ratio) { return std::fmod(0.5 + i * ratio, 1.0) - 0.5; }

}  // namespace

ScenePicture::ScenePicture(const StructureTexture* structures)
    : structures_(structures),
      ray_cast_(gl::make_program(shaders::kWholePicture, shaders::kRayCast,
                                 structures != nullptr ? shaders::kWithStructures : shaders::kPlain)),
      copy_(gl::make_program(shaders::kWholePicture, shaders::kCopy)),
      marks_(gl::make_program(shaders::kMarkVertex, shaders::kMarkFragment)),
      nothing_(gl::make_vertex_array()),
      mark_array_(gl::make_vertex_array()),
      mark_buffer_(gl::make_buffer()) {
  glUseProgram(ray_cast_.name());
  glUniform1i(place(ray_cast_, "densities"), 0);
  glUniform1i(place(ray_cast_, "distances"), 1);
  glUniform1i(place(ray_cast_, "shares"), 2);
  if (structures_ != nullptr) set_structures();
  glUseProgram(copy_.name());
  glUniform1i(place(copy_, "picture"), 3);
  glBindVertexArray(mark_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, mark_buffer_.name());
  constexpr GLsizei kStride = 8 * sizeof(float);
  const auto at = [](std::size_t floats) { return reinterpret_cast<const void*>(floats * sizeof(float)); };
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, kStride, at(0));
  glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, kStride, at(3));
  glVertexAttribPointer(2, 1, GL_FLOAT, GL_FALSE, kStride, at(7));
  for (GLuint i = 0; i < 3; ++i) glEnableVertexAttribArray(i);
  glBindVertexArray(0);
}

void ScenePicture::warm_up() {
  constexpr int kSpeck = 4;  // pixels
  const std::vector<std::int16_t> air(64);
  const drill::Grid nothing({.size = {4, 4, 4}, .spacing = Vec3d::Constant(1e-3)}, air);
  const BoneTexture bone(nothing, 1);
  (void)draw_still({}, bone, Posed::Identity(), kSpeck, kSpeck, true);
}

/// What does not change from picture to picture. Its program is in use.
void ScenePicture::set_structures() const {
  const gl::Program& p = ray_cast_;
  const LeftStructures& left = structures_->left();
  glUniform1i(place(p, "structure_distances"), 4);
  glUniform1i(place(p, "structure_numbers"), 5);
  glUniform1i(place(p, "structure_colours"), 6);
  set(p, "structure_size", Vec3d(left.size()[0], left.size()[1], left.size()[2]));
  const Posed X_SG = structures_->X_GS().inverse(Eigen::Isometry);
  const Vec3d per_metre = left.spacing().cwiseInverse();
  const Eigen::Matrix3f to_samples = (per_metre.asDiagonal() * X_SG.linear() / kMm).cast<float>();
  glUniformMatrix3fv(place(p, "to_samples"), 1, GL_FALSE, to_samples.data());
  set(p, "first_sample", Vec3d(per_metre.cwiseProduct(X_SG.translation() - left.first_S())));
  set(p, "structure_range", kMm * gl::kShortUnit * left.quantum());
  set(p, "structure_voxel", kMm * left.spacing().minCoeff());
  set(p, "structure_margin", kMm * structures_->margin());
}

void ScenePicture::set_camera(const gl::Program& p, const OrbitCamera& camera, const Posed& X_GW, int width,
                              int height) const {
  const Mat3d axes = X_GW.linear() * camera.axes();
  const double half = std::tan(OrbitCamera::kFieldOfView / 2);
  set(p, "eye", Vec3d(kMm * (X_GW * camera.eye_W())));
  set(p, "right", Vec3d(half * width / height * axes.col(0)));
  set(p, "up", Vec3d(half * axes.col(1)));
  set(p, "back", Vec3d(axes.col(2)));
  set(p, "depth_range", static_cast<float>(kMm * kNear), static_cast<float>(kMm * kFar));
}

void ScenePicture::draw(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width, int height,
                        bool fine, Jitter jitter) {
  frame_.resize(width, height, GL_RGBA8, GL_UNSIGNED_BYTE, true);
  glBindFramebuffer(GL_FRAMEBUFFER, frame_.framebuffer.name());
  glViewport(0, 0, width, height);
  glDisable(GL_BLEND);
  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_ALWAYS);
  bone.bind();
  if (structures_ != nullptr) structures_->bind();
  const gl::Program& p = ray_cast_;
  glUseProgram(p.name());
  const Posed X_GW = X_WG.inverse(Eigen::Isometry);
  set_camera(p, view.camera, X_GW, width, height);
  set(p, "jitter", jitter.x / static_cast<float>(width), jitter.y / static_cast<float>(height));
  set(p, "size", Vec3d(bone.size()[0], bone.size()[1], bone.size()[2]));
  set(p, "per_mm", Vec3d((kMm * bone.spacing()).cwiseInverse()));
  set(p, "voxel", kMm * bone.spacing().minCoeff());
  set(p, "isovalue", bone.isovalue() / gl::kShortUnit);
  set(p, "densest", bone.densest() / gl::kShortUnit);
  glUniform3i(place(p, "bricks"), bone.bricks()[0], bone.bricks()[1], bone.bricks()[2]);
  set(p, "stride", fine ? 0.7 : 1.0);
  set(p, "fine", fine);
  set(p, "pixel", OrbitCamera::metres_per_pixel(1, height));
  const Mat3d axes = X_GW.linear() * view.camera.axes();
  set(p, "to_key", Vec3d((axes * Vec3d(-0.50, 0.60, 0.75)).normalized()));
  Vec3d clip = Vec3d::Zero();
  double offset = 0;
  if (view.clip) {
    clip = X_GW.linear() * view.clip->normal_W;
    offset = view.clip->offset + clip.dot(X_GW.translation());
  }
  glUniform4f(place(p, "clip"), static_cast<float>(clip.x()), static_cast<float>(clip.y()),
              static_cast<float>(clip.z()), static_cast<float>(kMm * offset));
  set_tool(p, "tool", X_GW * view.tool_W);
  set_tool(p, "ghost", X_GW * view.ghost_W);
  set_tool(p, "tube", X_GW * view.tube_W.value_or(Posed::Identity()));
  const double shown = view.tube_W ? kMm : 0;
  set(p, "tube_size", static_cast<float>(shown * view.tube_radius), static_cast<float>(shown * view.tube_length));
  set(p, "burr", Vec3d(kMm * Vec3d(view.burr.tip_radius, view.burr.shaft_radius, view.burr.shaft_length)));
  set_outline(p, view);
  set(p, "spin", view.spin);
  set(p, "ghostly", view.ghost_opacity);
  set(p, "flat_shading", view.only_bone);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  if (!view.only_bone) draw_marks(view, X_GW);
  glDisable(GL_DEPTH_TEST);
}

void ScenePicture::draw_marks(const SceneView& view, const Posed& X_GW) {
  if (view.sprites.empty() && view.triangles.empty()) return;
  std::vector<float> data;
  data.reserve(8 * (view.sprites.size() + view.triangles.size()));
  for (const auto* list : {&view.triangles, &view.sprites})
    for (const Mark& m : *list) {
      const Eigen::Vector3f q = (kMm * (X_GW * m.p_W)).cast<float>();
      data.insert(data.end(), {q.x(), q.y(), q.z()});
      data.insert(data.end(), m.colour.begin(), m.colour.end());
      data.push_back(static_cast<float>(kMm * m.radius));
    }
  glUseProgram(marks_.name());
  set_camera(marks_, view.camera, X_GW, frame_.width, frame_.height);
  set(marks_, "half_picture", 0.5F * static_cast<float>(frame_.width), 0.5F * static_cast<float>(frame_.height));
  glBindVertexArray(mark_array_.name());
  glBindBuffer(GL_ARRAY_BUFFER, mark_buffer_.name());
  glBufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(data.size() * sizeof(float)), data.data(), GL_STREAM_DRAW);
  glDepthFunc(GL_LEQUAL);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  gl::let_shaders_size_points(true);
  const auto corners = static_cast<GLsizei>(view.triangles.size());
  set(marks_, "bias", 0.0);
  glDrawArrays(GL_TRIANGLES, 0, corners);
  // Contact points lie on the surface, which must not hide them by half.
  set(marks_, "bias", 0.6);
  glDrawArrays(GL_POINTS, corners, static_cast<GLsizei>(view.sprites.size()));
  gl::let_shaders_size_points(false);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glBindVertexArray(0);
}

void ScenePicture::draw_moving(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width,
                               int height) {
  draw(view, bone, X_WG, width, height, false, {0, 0});
  still_ = false;
}

bool ScenePicture::draw_still(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width, int height,
                              bool first) {
  if (first) samples_ = 0;
  if (samples_ >= kSamples) return false;
  const Jitter jitter{static_cast<float>(2 * spread(samples_, 0.7548776662)),
                      static_cast<float>(2 * spread(samples_, 0.5698402910))};
  draw(view, bone, X_WG, width, height, true, jitter);
  mean_.resize(width, height, GL_RGBA16F, GL_HALF_FLOAT, false);
  glBindFramebuffer(GL_FRAMEBUFFER, mean_.framebuffer.name());
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glUseProgram(copy_.name());
  glActiveTexture(GL_TEXTURE3);
  glBindTexture(GL_TEXTURE_2D, frame_.colour.name());
  set(copy_, "opacity", 1.0 / ++samples_);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glDisable(GL_BLEND);
  glActiveTexture(GL_TEXTURE0);
  still_ = true;
  return samples_ < kSamples;
}

void ScenePicture::present(int width, int height) const {
  glViewport(0, 0, width, height);
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glUseProgram(copy_.name());
  glActiveTexture(GL_TEXTURE3);
  glBindTexture(GL_TEXTURE_2D, shown().colour.name());
  set(copy_, "opacity", 1.0);
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glActiveTexture(GL_TEXTURE0);
}

std::vector<float> ScenePicture::depths() const {
  glBindFramebuffer(GL_FRAMEBUFFER, frame_.framebuffer.name());
  auto out = gl::read_pixels<float>(frame_.width, frame_.height, 1, GL_DEPTH_COMPONENT, GL_FLOAT);
  for (float& d : out) {
    const double z = kNear * kFar / (kFar - static_cast<double>(d) * (kFar - kNear));
    d = static_cast<float>(std::min(z, kFar));
  }
  return out;
}

}  // namespace live
