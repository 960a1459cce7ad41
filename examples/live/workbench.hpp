// SPDX-License-Identifier: MIT
#pragma once

#include "bone_texture.hpp"
#include "dust.hpp"
#include "left_structures.hpp"
#include "live_options.hpp"
#include "loaded.hpp"
#include "mouse_hand.hpp"
#include "scene_picture.hpp"
#include "script.hpp"
#include "session.hpp"
#include "strokes.hpp"

#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace live {

/// What a session's file and the instruments call the round burr.
inline constexpr std::string_view kBurrName = "burr";
/// Returns the family of a tool's name, and `kBurrName` for no name.
[[nodiscard]] std::string_view family_of(std::string_view tool_name);

/// How a workbench runs: drawn, beside a haptic thread, or without pictures, in simulated time.
enum class Showing { kDrawn, kSimulated };

/// All of the window but the window itself: bone, drill, hand and camera, what keys and mouse do, and the picture.
/// Needs a current OpenGL context if it is drawn. Window thread.
class Workbench {
 public:
  /// `ready`: a picture without structures whose shaders are compiled, which takes a second on a slow card.
  Workbench(Loaded loaded, const LiveOptions& options, Showing showing = Showing::kDrawn,
            std::optional<ScenePicture> ready = {});
  /// Makes all that is on the graphics card, anew after its context was lost. Throws std::runtime_error where the card
  /// has no room.
  void make_pictures(std::optional<ScenePicture> ready = {});
  /// Drops it, for a context that is lost; the drill goes on. `update` alone may be called until they are made again.
  void drop_pictures() { pictures_ = nullptr; }

  // What the user does. Pixels count from the upper left corner of a picture of the last frame's size.
  void act(Action action);
  void mouse_at(double x, double y) { mouse_ = {x, y}; }
  void move_drill(double x, double y);
  void push_drill(double metres);
  void turn_drill(double dx, double dy);
  void hold_spindle(bool down);
  void orbit(double dx, double dy) { camera_.orbit(dx, dy, height_); }
  void pan(double dx, double dy) { camera_.pan(dx, dy, height_); }
  void zoom(double notches) { camera_.zoom(notches); }
  /// Takes a tool by its name, or the round burr; the coupled renderer comes with a tool. A tool that cannot be leaves
  /// all as it is, with a note.
  void choose_tool(const std::string& name);
  /// Takes a tool of a family, as wide as the present one if the family has that.
  void choose_family(std::string_view family);
  /// Takes another protection of structures, if there are any.
  void protect(Protection protection);
  /// Does what an event says, but for the window's own: sizes, shots, the end.
  void apply(const Event& event);

  /// Reads the last tick and the changed bricks; once a frame, before drawing. `dt` [s] since the last frame.
  void update(double dt, int width, int height);
  /// Draws the scene: coarsely while something moves, in full when all is still. Returns true if it drew anything new.
  bool draw();
  /// Draws in full at once.
  void draw_full();
  [[nodiscard]] const ScenePicture& picture() const { return pictures_->scene; }
  [[nodiscard]] ScenePicture& picture() { return pictures_->scene; }

  // For the instruments.
  [[nodiscard]] Session& session() { return *session_; }
  [[nodiscard]] const Session& session() const { return *session_; }
  [[nodiscard]] const TickView& view() const { return tick_; }
  [[nodiscard]] const drill::Bone& bone() const { return loaded_.bone; }
  [[nodiscard]] const drill::Spot& spot() const { return loaded_.spot; }
  [[nodiscard]] const BoneTexture& texture() const { return pictures_->bone; }
  /// Structures, or nullptr.
  [[nodiscard]] const GuardedBone* guarded() const { return loaded_.guarded.get(); }
  [[nodiscard]] const StructureTexture* structures() const { return pictures_->structures.get(); }
  [[nodiscard]] Protection protection() const { return session_->options().drill.protection; }
  [[nodiscard]] const MouseHand& hand() const { return hand_; }
  [[nodiscard]] const OrbitCamera& camera() const { return camera_; }
  [[nodiscard]] bool spindle() const { return spindle_; }
  /// What was refused last, in a line; empty since.
  [[nodiscard]] const std::string& note() const { return note_; }
  [[nodiscard]] bool help() const { return help_; }
  [[nodiscard]] bool panels() const { return panels_; }
  [[nodiscard]] bool marks() const { return marks_; }
  [[nodiscard]] bool clipped() const { return clip_.has_value(); }
  [[nodiscard]] bool can_undo() const { return !strokes_.empty(); }
  [[nodiscard]] std::size_t uploaded() const { return uploaded_; }  ///< bricks in the last frame
  [[nodiscard]] double draw_ms() const { return draw_ms_; }
  [[nodiscard]] bool still() const { return still_; }
  [[nodiscard]] bool quit() const { return quit_; }
  /// True once after the key for a screenshot.
  [[nodiscard]] bool take_shot() { return std::exchange(shot_, false); }
  [[nodiscard]] SceneView scene_view() const;
  [[nodiscard]] const Posed& X_WG() const { return loaded_.bone.grid.X_WG(); }
  [[nodiscard]] std::optional<Vec3d> bone_under(double x, double y) const;

 private:
  void set_spindle(bool on);
  void change_burr(double factor);
  void choose_family(std::string_view family, double mm);
  void place_under_mouse();
  void go_home();
  void begin_stroke();
  void update_bone();
  bool update_structures();
  void show_left(const trephine::VoxelBox& changed);
  void post();
  [[nodiscard]] bool moved_since(const SceneView& view) const;
  void add_marks(SceneView& view) const;

  /// What is on the graphics card.
  struct Pictures {
    Pictures(const Loaded& loaded, const LeftStructures* left, std::optional<ScenePicture> ready);
    BoneTexture bone;
    std::unique_ptr<StructureTexture> structures;
    ScenePicture scene;
  };

  static constexpr double kShownApart = 0.15e-3;  // [m]: probe and tool are drawn apart from here on

  Loaded loaded_;
  double aside_;
  OrbitCamera camera_;
  Reader reader_;
  std::unique_ptr<LeftStructures> left_;  // nullptr without structures
  std::unique_ptr<Pictures> pictures_;    // nullptr where nothing is drawn
  Strokes strokes_;
  MouseHand hand_;
  std::unique_ptr<Session> session_;
  TickView tick_;
  Dust dust_;
  Vec2d mouse_ = Vec2d::Zero();
  std::optional<ClipPlane> clip_;
  SceneView drawn_;
  int width_ = 640, height_ = 480;
  double spin_ = 0;
  double turning_ = 0;  // of the view [rad/s]
  double moving_scale_ = 0.5;
  double draw_ms_ = 0;
  std::size_t uploaded_ = 0;
  double removed_seen_ = 0;
  bool spindle_ = false, marks_ = true, help_ = false, panels_ = true, still_ = false, quit_ = false, shot_ = false;
  bool changed_ = true;
  std::string note_;
};

}  // namespace live
