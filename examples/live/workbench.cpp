// SPDX-License-Identifier: MIT
#include "workbench.hpp"

#include "../drill/cutting.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/resample.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <stdexcept>

namespace live {
namespace {

/// The tool at `height` over the spot, leaning away from the viewer so that he sees where it works.
Posed start_pose(const drill::Spot& spot, const Vec3d& aside, double height) {
  const Vec3d axis = (spot.normal_W - 0.35 * aside).normalized();
  const Mat3d R = trephine::rotation_between<double>(Vec3d::UnitZ(), axis);
  return trephine::make_pose<double>(R, Vec3d(spot.p_W + height * spot.normal_W));
}

/// Along the surface, to the right and upward for one who looks at the spot.
Vec3d aside_of(const drill::Spot& spot) {
  Vec3d up = Vec3d::UnitZ() - spot.normal_W.z() * spot.normal_W;
  if (up.norm() < 0.2) up = -Vec3d::UnitY() + spot.normal_W.y() * spot.normal_W;
  up.normalize();
  return (0.6 * up + up.cross(spot.normal_W)).normalized();
}

/// The spot is `aside` heights of the picture left of its middle.
OrbitCamera start_camera(const drill::Spot& spot, double burr_radius, double aside) {
  OrbitCamera camera;
  camera.focus_W = spot.p_W;
  camera.distance = std::clamp(42 * burr_radius, 0.03, 0.3);
  camera.look_from(std::cos(0.75) * spot.normal_W + std::sin(0.75) * aside_of(spot));
  camera.pan(-aside, 0, 1);
  return camera;
}

}  // namespace

Workbench::Pictures::Pictures(const Loaded& loaded, const LeftStructures* left, std::optional<ScenePicture> ready)
    : bone(loaded.bone.grid, loaded.bone.isovalue),
      structures(left != nullptr ? std::make_unique<StructureTexture>(*loaded.guarded, *left) : nullptr),
      scene(ready && structures == nullptr ? std::move(*ready) : ScenePicture(structures.get())) {}

Workbench::Workbench(Loaded loaded, const LiveOptions& options, Showing showing, std::optional<ScenePicture> ready)
    : loaded_(std::move(loaded)),
      aside_(options.aside),
      camera_(start_camera(loaded_.spot, loaded_.bone.burr.tip_radius, aside_)),
      reader_(loaded_.bone.grid, false),
      left_(loaded_.guarded ? std::make_unique<LeftStructures>(*loaded_.guarded->field, loaded_.guarded->box,
                                                               loaded_.guarded->margin)
                            : nullptr),
      hand_(start_pose(loaded_.spot, aside_of(loaded_.spot), 3 * loaded_.bone.burr.tip_radius)) {
  if (showing == Showing::kDrawn) make_pictures(std::move(ready));
  session_ =
      std::make_unique<Session>(loaded_.bone.grid, loaded_.bone.isovalue,
                                SessionOptions{.drill = {.renderer = options.renderer,
                                                         .burr = first_burr(loaded_.bone),
                                                         .tool_name = loaded_.bone.tool_name,
                                                         .tool = loaded_.bone.tool,
                                                         .law = options.law,
                                                         .strength = drill::strength_of(loaded_.bone),
                                                         .motor = options.motor,
                                                         .tuning = {.feed = loaded_.bone.burr.tip_radius / kRadiusTime},
                                                         .guarded = loaded_.guarded,
                                                         .potential = loaded_.potential,
                                                         .soft = loaded_.soft,
                                                         .protection = options.protection},
                                               .rate = options.rate,
                                               .scale = options.scale,
                                               .device = options.device,
                                               .R_WU = camera_.axes(),
                                               .second_hand = options.second_hand,
                                               .simulated = showing == Showing::kSimulated},
                                hand_.pose());
}

void Workbench::make_pictures(std::optional<ScenePicture> ready) {
  drop_pictures();
  pictures_ = std::make_unique<Pictures>(loaded_, left_.get(), std::move(ready));
  changed_ = true;
}

void Workbench::post() { session_->wish({hand_.pose(), spindle_}); }

void Workbench::move_drill(double x, double y) {
  mouse_ = {x, y};
  hand_.move_under(camera_, x, y, width_, height_);
  post();
}
void Workbench::push_drill(double metres) {
  hand_.push(camera_, metres, tick_.tool.translation());
  post();
}
void Workbench::turn_drill(double dx, double dy) {
  hand_.turn(camera_, dx, dy, height_);
  post();
}
void Workbench::hold_spindle(bool down) { set_spindle(down); }

void Workbench::set_spindle(bool on) {
  if (on == spindle_) return;
  if (on) begin_stroke();
  spindle_ = on;
  post();
}

void Workbench::begin_stroke() {
  strokes_.begin(removed_seen_);
  if (left_) left_->begin_stroke();
}

void Workbench::protect(Protection protection) {
  session_->protect(protection);
  changed_ = true;
}

/// Takes what changed of the bone since the last call, for the picture and for undoing it.
void Workbench::update_bone() {
  Haloed haloed;
  uploaded_ = reader_.poll([&](std::size_t brick) {
    (void)reader_.copy_brick(brick, haloed);
    strokes_.changed(brick, haloed);
    if (pictures_) pictures_->bone.update(brick, haloed);
  });
}

/// What the burr took of structures, for the picture. A veto leaves them whole, also where a renderer lets the ball
/// sink into bone.
bool Workbench::update_structures() {
  if (!left_) return false;
  if (protection() == Protection::kVeto) {
    session_->path().take([](const BurrPiece&) {});
    return false;
  }
  const trephine::VoxelBox changed =
      left_->take(session_->path(), (X_WG() * loaded_.guarded->X_GS).inverse(Eigen::Isometry));
  show_left(changed);
  return changed.hi[0] >= changed.lo[0];
}

void Workbench::show_left(const trephine::VoxelBox& changed) {
  if (pictures_ && pictures_->structures) pictures_->structures->update(changed);
}

void Workbench::act(Action action) {
  changed_ = true;
  switch (action) {
    case Action::kNone:
      break;
    case Action::kHelp:
      help_ = !help_;
      break;
    case Action::kSpindle:
      set_spindle(!spindle_);
      break;
    case Action::kRenderer: {
      SessionOptions o = session_->options();
      o.drill.renderer = static_cast<Renderer>((static_cast<int>(o.drill.renderer) + 1) % 3);
      session_->change(o);
      break;
    }
    case Action::kLaw: {
      SessionOptions o = session_->options();
      o.drill.law = !o.drill.mills_by_law();
      if (o.drill.law) o.drill.renderer = Renderer::kCoupled;
      session_->change(o);
      break;
    }
    case Action::kSmallerBurr:
      change_burr(1 / 1.25);
      break;
    case Action::kLargerBurr:
      change_burr(1.25);
      break;
    case Action::kRestore:
      set_spindle(false);
      session_->restore();
      strokes_.clear();
      update_structures();
      if (left_) show_left(left_->restore());
      break;
    case Action::kUndo:
      set_spindle(false);
      if (strokes_.empty()) break;
      session_->bring_back(strokes_.take_last());
      update_structures();
      if (left_) show_left(left_->undo());
      break;
    case Action::kClip:
      if (clip_) {
        clip_.reset();
      } else {
        // Through the drill's axis, toward the viewer.
        const Vec3d axis = tick_.tool.linear().col(2), back = camera_.axes().col(2);
        Vec3d n = back - back.dot(axis) * axis;
        if (n.norm() < 0.05) n = axis.unitOrthogonal();
        n.normalize();
        clip_ = ClipPlane{n, n.dot(tick_.tool.translation())};
      }
      break;
    case Action::kProtection:
      protect(next(protection()));
      break;
    case Action::kMarks:
      marks_ = !marks_;
      break;
    case Action::kPanels:
      panels_ = !panels_;
      break;
    case Action::kPlace:
      place_under_mouse();
      break;
    case Action::kHome:
      go_home();
      break;
    case Action::kShot:
      shot_ = true;
      break;
    case Action::kCloser:
      camera_.zoom(2);
      break;
    case Action::kFarther:
      camera_.zoom(-2);
      break;
    case Action::kQuit:
      quit_ = true;
      break;
  }
}

std::string_view family_of(std::string_view tool_name) {
  return tool_name.empty() ? kBurrName : tool_name.substr(0, tool_name.rfind('-'));
}

void Workbench::choose_tool(const std::string& name) {
  changed_ = true;
  SessionOptions o = session_->options();
  o.drill.tool_name = name == kBurrName ? "" : name;
  o.drill.tool.reset();
  o.drill.burr = round_burr(o.drill.burr.tip_radius);
  try {
    if (name != kBurrName) {
      o.drill.renderer = Renderer::kCoupled;
      o.drill.tool = trephine::tool_by_name(name).tool;
      o.drill.burr = round_burr(o.drill.tool->burr().tip_radius);
      if (o.drill.burr.tip_radius > largest_burr(loaded_.bone))
        throw std::invalid_argument("the " + name + " is too large for this bone");
    }
    session_->change(o);
    note_.clear();
  } catch (const std::invalid_argument& e) {
    note_ = e.what();
  }
}

void Workbench::choose_family(std::string_view family) {
  choose_family(family, 2e3 * session_->options().drill.burr.tip_radius);
}

void Workbench::choose_family(std::string_view family, double mm) {
  for (const trephine::ToolFamily& f : trephine::kToolFamilies) {
    if (f.name != family) continue;
    std::array<char, 32> diameter{};
    std::snprintf(diameter.data(), diameter.size(), "-%.3g", std::clamp(0.1 * std::round(10 * mm), f.least, f.most));
    return choose_tool(std::string(family) + diameter.data());
  }
  choose_tool(std::string(kBurrName));
}

void Workbench::change_burr(double factor) {
  SessionOptions o = session_->options();
  if (o.drill.shape() != nullptr) {
    // Another tool of the family, at least a tenth of a millimetre wider or narrower.
    const double mm = 2e3 * o.drill.burr.tip_radius;
    const double wanted = factor > 1 ? std::max(mm * factor, mm + 0.1) : std::min(mm * factor, mm - 0.1);
    return choose_family(family_of(o.drill.tool_name), wanted);
  }
  trephine::Burr& burr = o.drill.burr;
  const drill::Grid& grid = loaded_.bone.grid;
  const double least = std::min(3 * grid.spacing().minCoeff(), burr.tip_radius);
  const double most = loaded_.guarded ? loaded_.guarded->largest_radius : largest_burr(loaded_.bone);
  const double radius = std::clamp(burr.tip_radius * factor, least, most);
  burr.shaft_radius *= radius / burr.tip_radius;
  burr.tip_radius = radius;
  session_->change(o);
}

void Workbench::go_home() {
  set_spindle(false);
  camera_ = start_camera(loaded_.spot, loaded_.bone.burr.tip_radius, aside_);
  hand_.set_pose(start_pose(loaded_.spot, aside_of(loaded_.spot), 3 * loaded_.bone.burr.tip_radius));
  session_->carry({hand_.pose(), spindle_});
}

std::optional<Vec3d> Workbench::bone_under(double x, double y) const {
  const ViewRay ray = camera_.ray(x, y, width_, height_);
  const Posed X_GW = X_WG().inverse(Eigen::Isometry);
  const Vec3d origin = X_GW * ray.origin, direction = X_GW.linear() * ray.direction;
  const Vec3d per_metre = reader_.spacing().cwiseInverse();
  const double step = 0.5 * reader_.spacing().minCoeff();
  const auto& n = reader_.size();
  for (double t = ScenePicture::kNear; t < 1.0; t += step) {
    const Vec3d u = (origin + t * direction).cwiseProduct(per_metre);
    const std::array<int, 3> v{static_cast<int>(std::lround(u.x())), static_cast<int>(std::lround(u.y())),
                               static_cast<int>(std::lround(u.z()))};
    bool inside = true;
    for (std::size_t a = 0; a < 3; ++a) inside = inside && v[a] >= 0 && v[a] < n[a];
    if (inside && reader_.voxel(v[0], v[1], v[2]) >= loaded_.bone.isovalue) return ray.origin + t * ray.direction;
  }
  return std::nullopt;
}

void Workbench::place_under_mouse() {
  const auto p = bone_under(mouse_.x(), mouse_.y());
  if (!p) return;
  set_spindle(false);
  const double radius = session_->options().drill.burr.tip_radius;
  const Vec3d to_eye = (camera_.eye_W() - *p).normalized();
  Posed X = hand_.pose();
  X.translation() = *p + 3 * radius * to_eye;
  hand_.set_pose(X);
  session_->carry({hand_.pose(), spindle_});
}

void Workbench::apply(const Event& event) {
  using Kind = Event::Kind;
  switch (event.kind) {
    case Kind::kHand:
      hand_.set_pose(event.pose);
      post();
      break;
    case Kind::kSpindle:
      set_spindle(event.on);
      break;
    case Kind::kView:
      camera_ = event.camera;
      break;
    case Kind::kKey:
      act(event.action);
      break;
    case Kind::kPush:
      push_drill(1e-3 * event.numbers[0]);
      break;
    case Kind::kMove:
      move_drill(event.numbers[0], event.numbers[1]);
      break;
    case Kind::kTurn:
      turn_drill(event.numbers[0], event.numbers[1]);
      break;
    case Kind::kProtect:
      protect(event.protection);
      break;
    case Kind::kTool:
      choose_tool(event.file);
      break;
    case Kind::kOrbit:
      turning_ = event.numbers[0] / 180 * std::numbers::pi;
      break;
    case Kind::kSize:
    case Kind::kLog:
    case Kind::kShot:
    case Kind::kQuit:
      break;
  }
}

void Workbench::update(double dt, int width, int height) {
  if (width != width_ || height != height_) changed_ = true;
  width_ = width;
  height_ = height;
  camera_.yaw += turning_ * dt;
  const bool was_on = tick_.spindle_on;
  tick_ = session_->view();
  // A device's own button starts a stroke too.
  if (tick_.spindle_on && !was_on && !spindle_) begin_stroke();
  update_bone();
  const bool took = update_structures();
  const double removed = std::max(tick_.removed_mm3 - removed_seen_, 0.0);
  removed_seen_ = tick_.removed_mm3;
  const bool had_dust = !dust_.empty();
  dust_.advance(dt, removed, tick_.tool, session_->options().drill.burr.tip_radius);
  if (tick_.spindle_on) spin_ = std::fmod(spin_ + 14 * dt, 2 * std::numbers::pi);
  changed_ = changed_ || uploaded_ > 0 || took || had_dust || tick_.spindle_on;
}

SceneView Workbench::scene_view() const {
  SceneView v;
  v.camera = camera_;
  const DrillSettings& drill = session_->options().drill;
  v.burr = drill.burr;
  if (const trephine::RevolvedTool* shape = drill.shape()) {
    v.shape = *shape;
    v.flutes = trephine::tool_by_name(drill.tool_name).edges.flutes;
  }
  v.tool_W = tick_.tool;
  v.ghost_W = tick_.probe;
  const double apart = (tick_.tool.translation() - tick_.probe.translation()).norm();
  v.ghost_opacity = std::clamp((apart - kShownApart) / (4 * kShownApart), 0.0, 1.0);
  if (session_->options().second_hand) {
    v.tube_W = tick_.second;
    v.tube_radius = SecondHand::kRadius;
    v.tube_length = SecondHand::kLength;
  }
  v.spin = spin_;
  v.clip = clip_;
  dust_.add_to(v.sprites);
  if (marks_) add_marks(v);
  return v;
}

void Workbench::add_marks(SceneView& v) const {
  for (std::size_t i = 0; i < tick_.contact_count; ++i)
    v.sprites.push_back({tick_.contacts[i], {0.90F, 0.12F, 0.10F, 1.0F}, 0.12 * v.burr.tip_radius});
  const Vec3d force = tick_.wrench.force;
  if (force.norm() < 0.05) return;
  // 8 mm a newton, from the tip; a flat arrow that faces the eye.
  const Vec3d tail = tick_.tool.translation(), way = 8e-3 * force, back = camera_.axes().col(2);
  const double length = way.norm(), head = std::min(3e-3, 0.5 * length);
  Vec3d side = way.cross(back);
  if (side.norm() < 1e-9) return;
  side.normalize();
  const Vec3d neck = tail + way * (1 - head / length), tip = tail + way;
  const std::array<float, 4> colour{0.98F, 0.78F, 0.15F, 0.95F};
  const double thin = 0.35e-3, wide = 1.1e-3;
  for (const Vec3d& p : {Vec3d(tail - thin * side), Vec3d(tail + thin * side), Vec3d(neck + thin * side),
                         Vec3d(tail - thin * side), Vec3d(neck + thin * side), Vec3d(neck - thin * side),
                         Vec3d(neck - wide * side), Vec3d(neck + wide * side), tip})
    v.triangles.push_back({p, colour, 0});
}

bool Workbench::moved_since(const SceneView& v) const {
  constexpr double kLength = 20e-6, kAngle = 2e-3;  // below them nothing shows
  const auto apart = [&](const Posed& a, const Posed& b) {
    return (a.translation() - b.translation()).norm() > kLength ||
           trephine::rotation_vector<double>(a.linear() * b.linear().transpose()).norm() > kAngle;
  };
  const auto& c = v.camera;
  const auto& d = drawn_.camera;
  return changed_ || apart(v.tool_W, drawn_.tool_W) || std::abs(v.ghost_opacity - drawn_.ghost_opacity) > 0.1 ||
         (v.tube_W && drawn_.tube_W && apart(*v.tube_W, *drawn_.tube_W)) ||
         (v.ghost_opacity > 0 && apart(v.ghost_W, drawn_.ghost_W)) || c.focus_W != d.focus_W || c.yaw != d.yaw ||
         c.pitch != d.pitch || c.distance != d.distance || v.burr.tip_radius != drawn_.burr.tip_radius;
}

bool Workbench::draw() {
  const SceneView v = scene_view();
  const auto start = std::chrono::steady_clock::now();
  if (moved_since(v)) {
    drawn_ = v;
    changed_ = false;
    still_ = false;
    const auto part = [&](int n) { return std::max(1, static_cast<int>(std::lround(moving_scale_ * n))); };
    pictures_->scene.draw_moving(v, pictures_->bone, X_WG(), part(width_), part(height_));
    gl::finish();
    draw_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    // A fast card draws moving scenes in full too.
    if (draw_ms_ < 5) moving_scale_ = 1;
    if (draw_ms_ > 60) moving_scale_ = 0.5;
    return true;
  }
  const bool first = !std::exchange(still_, true);
  const bool more = first || pictures_->scene.samples() < ScenePicture::kSamples;
  if (more) {
    (void)pictures_->scene.draw_still(drawn_, pictures_->bone, X_WG(), width_, height_, first);
    glFinish();
    draw_ms_ = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
  }
  return more;
}

void Workbench::draw_full() {
  drawn_ = scene_view();
  changed_ = false;
  still_ = true;
  for (bool first = true; pictures_->scene.draw_still(drawn_, pictures_->bone, X_WG(), width_, height_, first);)
    first = false;
}

}  // namespace live
