// SPDX-License-Identifier: MIT
#pragma once

#include "canvas.hpp"
#include "drawn_structures.hpp"
#include "pictured_bone.hpp"

#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/shape.hpp>

#include <optional>
#include <string>
#include <vector>

namespace drill {

/// A parallel projection, so that the scale bar holds everywhere in the picture. G, metres.
struct Camera {
  Vec3f centre;  ///< what is in the middle of the picture
  Vec3f right;
  Vec3f up;
  Vec3f back;        ///< toward the eye; right, up, back are unit and right-handed
  float height = 0;  ///< of the scene in the picture [m]
};

/// A camera that looks at `centre` from the direction `from`, with `up` upward as far as that goes.
[[nodiscard]] Camera look_at(const Vec3f& centre, const Vec3f& from, const Vec3f& up, float height);

/// What is drawn. Poses are X_GT.
struct Picture {
  const PicturedBone* bone = nullptr;
  const PicturedBone* uncut = nullptr;  ///< the bone before the run: what is missing now is shown as freshly cut
  Camera camera{};
  trephine::Burr burr{};
  const trephine::RevolvedTool* shape = nullptr;  ///< of the drill, if it is no round burr
  std::optional<trephine::Pose<float>> tool;      ///< the drill, in steel
  std::optional<trephine::Pose<float>> ghost;     ///< a second one, translucent
  const DrawnStructures* structures = nullptr;    ///< in their colours, labelled
  std::vector<Vec3f> points;                      ///< red dots where it touches, but where bone hides them
  std::optional<Vec3f> light;                     ///< toward the key light; from the upper left unless given
  bool section = false;                           ///< leave out the bone on the eye's side of the camera's centre
  std::string tool_label, ghost_label, points_label;
  std::string title;
  std::string subtitle;
};

/// Draws at the given size, with 2 x 2 rays a pixel, on all cores: the scene, and title, legend and scale bar above and
/// below it.
[[nodiscard]] Canvas draw(const Picture& picture, int width = 1280, int height = 960);

}  // namespace drill
