// SPDX-License-Identifier: MIT
#pragma once

#include "bone_texture.hpp"
#include "gl.hpp"
#include "orbit_camera.hpp"
#include "structure_texture.hpp"

#include <trephine/tool/revolved_tool.hpp>

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace live {

/// A round mark or a corner of a triangle. W, metres.
struct Mark {
  Vec3d p_W = Vec3d::Zero();
  std::array<float, 4> colour{};  ///< sRGB and opacity, 0..1
  double radius = 0;              ///< of a round mark; 0 in triangles
};

/// A half-space left out of the picture: what has normal · p > offset. W, metres.
struct ClipPlane {
  Vec3d normal_W = Vec3d::UnitX();
  double offset = 0;
};

/// What a picture shows.
struct SceneView {
  OrbitCamera camera{};
  trephine::Burr burr{};
  std::optional<trephine::RevolvedTool> shape{};  ///< drawn in place of the burr
  int flutes = 8;                                 ///< of the head; 0: diamond
  Posed tool_W = Posed::Identity();
  Posed ghost_W = Posed::Identity();  ///< where the hand holds the drill
  double ghost_opacity = 0;
  std::optional<Posed> tube_W{};  ///< of the second hand's tube
  double tube_radius = 0, tube_length = 0;
  double spin = 0;  ///< angle of the burr's flutes [rad]
  std::optional<ClipPlane> clip{};
  std::vector<Mark> sprites{};    ///< contact points, dust
  std::vector<Mark> triangles{};  ///< force arrow, three corners each
  bool only_bone = false;         ///< bone white, structures in their colours, all else black; for tests
};

/// Draws bone and tool by casting a ray a pixel on the graphics card. A still scene is drawn again and again with rays
/// displaced within their pixels, and the mean shown: kSamples of them make it smooth.
class ScenePicture {
 public:
  static constexpr int kSamples = 8;
  static constexpr double kNear = 1e-3, kFar = 4.0;  ///< depth range [m]

  /// Structures are only in the shader if there are any; they must outlive the picture.
  explicit ScenePicture(const StructureTexture* structures = nullptr);
  /// Draws a speck of nothing, so that the driver compiles all of the shaders before there is a bone.
  void warm_up();

  /// Draws at a size [pixels], coarsely: for moving scenes.
  void draw_moving(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width, int height);
  /// Adds a sample of a still scene; `first` starts a new mean. Returns true while more samples are of use.
  bool draw_still(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width, int height, bool first);
  /// Copies the last picture to the framebuffer in use, which is `width` x `height`.
  void present(int width, int height) const;

  /// Returns the last moving picture's depths in front of the eye [m], top row first; kFar where there is nothing.
  [[nodiscard]] std::vector<float> depths() const;
  /// Returns how many samples the mean of a still scene has.
  [[nodiscard]] int samples() const { return samples_; }
  [[nodiscard]] int width() const { return shown().width; }
  [[nodiscard]] int height() const { return shown().height; }

 private:
  struct Jitter {
    float x, y;
  };
  void draw(const SceneView& view, const BoneTexture& bone, const Posed& X_WG, int width, int height, bool fine,
            Jitter jitter);
  void draw_marks(const SceneView& view, const Posed& X_GW);
  void set_camera(const gl::Program& program, const OrbitCamera& camera, const Posed& X_GW, int width,
                  int height) const;
  [[nodiscard]] const gl::Target& shown() const { return still_ ? mean_ : frame_; }

  void set_structures() const;

  const StructureTexture* structures_;
  gl::Program ray_cast_, copy_, marks_;
  gl::VertexArray nothing_, mark_array_;
  gl::Buffer mark_buffer_;
  gl::Target frame_, mean_;
  int samples_ = 0;
  bool still_ = false;
};

}  // namespace live
