// SPDX-License-Identifier: MIT
// The window's workbench behind functions that a page calls. Texts are UTF-8, and what a function returns by pointer is
// good until the next call. All of it belongs to the browser's main thread; the haptic loop is a thread of the session.
#include "../live/session_writer.hpp"
#include "../live/simulate.hpp"
#include "../live/words.hpp"
#include "files.hpp"
#include "json.hpp"
#include "opening.hpp"

#include <trephine/core/units.hpp>
#include <trephine/tool/named_tools.hpp>

#include <emscripten/emscripten.h>
#include <emscripten/html5.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace web {
namespace {

using namespace live;
using Clock = std::chrono::steady_clock;

/// The page's only engine.
class Engine {
 public:
  /// The bone that is open stays until the other is there.
  void open(Opening::Load load) {
    refused_.clear();
    opening_.emplace(std::move(load));
    warm_up();
  }
  void refuse(const std::string& why) { refused_ = "!" + why; }

  /// "" once a bone is open, a text while it is loaded, or "!" and why there is none.
  const char* opening() {
    if (opening_ && opening_->done()) take_opened();
    if (!refused_.empty()) return keep(refused_);
    return opening_ ? keep(opening_->text()) : "";
  }

  bool frame(double dt, int width, int height) {
    if (!has_context()) return false;
    if (bench_ == nullptr) {
      if (lost_) return false;
      glBindFramebuffer(GL_FRAMEBUFFER, 0);
      glClearColor(0.055F, 0.065F, 0.080F, 1);
      glClear(GL_COLOR_BUFFER_BIT);
      return false;
    }
    const double now = seconds();
    if (playback_) {
      (void)playback_->play(now - play_start_, [this](const Event& e) { bench_->apply(e); });
      if (playback_->is_over()) playback_.reset();
    }
    width_ = std::max(width, 16);
    height_ = std::max(height, 16);
    bench_->update(std::min(dt, 0.1), width_, height_);
    (void)bench_->take_shot();
    writer_->frame(now, *bench_, std::exchange(pressed_, {}));
    // The browser tells of a lost context later than it loses it.
    if (lost_ || emscripten_is_webgl_context_lost(context_) == EM_TRUE) return false;
    bool drawn = false;
    try {
      drawn = bench_->draw();
      if (drawn) {
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        bench_->picture().present(width, height);
      }
    } catch (const std::exception& e) {
      if (emscripten_is_webgl_context_lost(context_) == EM_FALSE) close(e.what());
    }
    return drawn;
  }

  /// The bench, for what the hand does: none while a session plays.
  [[nodiscard]] Workbench* by_hand() { return playback_ ? nullptr : bench_.get(); }
  [[nodiscard]] Workbench* bench() { return bench_.get(); }

  void act(Action action) {
    if (bench_ == nullptr || action == Action::kNone || action == Action::kQuit) return;
    bench_->act(action);
    pressed_.push_back(action);
  }
  void choose(std::string_view renderer) {
    for (int i = 0; bench_ != nullptr && i < 2; ++i)
      if (to_string(bench_->session().options().drill.renderer) != renderer) act(Action::kRenderer);
  }
  void set_law(bool on) {
    if (bench_ != nullptr && bench_->session().options().drill.mills_by_law() != on) act(Action::kLaw);
  }

  const char* state() {
    Json json;
    json.object([&] {
      if (bench_ != nullptr) write_state(json);
    });
    return keep(json.text());
  }

  const float* history(int most) {
    samples_.clear();
    if (bench_ != nullptr) samples_ = bench_->session().history().last(static_cast<std::size_t>(std::max(most, 0)));
    return samples_.empty() ? nullptr : &samples_.front().force;
  }
  [[nodiscard]] int history_count() const { return static_cast<int>(samples_.size()); }

  const char* session() {
    if (bench_ == nullptr) return "";
    return keep(session_.str() + trephine::number_text(seconds()) + " quit\n");
  }
  /// Plays a session from the start: on the whole bone, with the drill as it was when the bone was opened.
  const char* play(const char* text) {
    if (bench_ == nullptr) return "There is no bone to play it on.";
    try {
      std::vector<Event> events = events_of(text);
      act(Action::kRestore);
      act(Action::kHome);
      bench_->session().change(first_);
      playback_.emplace(std::move(events), Playback::End::kHand);
      play_start_ = seconds();
      return "";
    } catch (const std::exception& e) {
      return keep(e.what());
    }
  }
  const char* run_script(const char* text) {
    Json json;
    json.object([&] {
      try {
        if (bench_ == nullptr) throw std::runtime_error("there is no bone to play it on");
        Loaded copy{as_loaded(bench_->bone()), bench_->spot()};
        if (bench_->guarded() != nullptr) copy.guarded = guard_copy(*bench_->guarded(), copy.bone);
        copy.potential = first_.drill.potential;
        copy.soft = first_.drill.soft;
        const Simulated end = simulate(std::move(copy), options_, events_of(text));
        json.member("removed_mm3", end.removed_mm3);
        write_vector(json, "force", end.force);
        json.member("ticks", end.ticks);
        json.member("tick_us_median", end.tick_us_median);
      } catch (const std::exception& e) {
        json.member("refused", e.what());
      }
    });
    return keep(json.text());
  }

  /// Keeps a file of the open bone for `file`; false where there is none.
  bool write(std::string (*file_of)(const drill::Bone&)) {
    file_.clear();
    if (bench_ == nullptr) return false;
    try {
      file_ = file_of(bench_->bone());
      return true;
    } catch (const std::exception&) {
      return false;
    }
  }
  [[nodiscard]] const std::string& file() const { return file_; }

  void context_lost() {
    lost_ = true;
    ready_.reset();
    if (bench_ != nullptr) bench_->drop_pictures();
  }
  void context_restored() {
    lost_ = false;
    emscripten_webgl_enable_extension(context_, "EXT_color_buffer_float");
    if (bench_ != nullptr) make([this] { bench_->make_pictures(); });
  }

  const char* words() {
    Json json;
    json.object([&] {
      json.member("actions", [&] {
        json.array([&] {
          for (const Key& k : kKeys)
            json.element([&] {
              json.object([&] {
                json.member("name", k.name);
                json.member("help", k.help);
              });
            });
        });
      });
      json.member("mouse", [&] {
        json.array([&] {
          for (const MouseHelp& m : kMouseHelp)
            json.element([&] {
              json.object([&] {
                json.member("gesture", m.gesture);
                json.member("help", m.help);
              });
            });
        });
      });
      const auto names = [&](std::string_view name, const auto& list, const auto& name_of) {
        json.member(name, [&] {
          json.array([&] {
            for (const auto& e : list) json.element(std::string_view(name_of(e)));
          });
        });
      };
      names("families", trephine::kToolFamilies, [](const trephine::ToolFamily& f) { return f.name; });
      json.member("burr", kBurrName);
      names("renderers", std::array{Renderer::kCoupled, Renderer::kLine, Renderer::kSurface},
            [](Renderer r) { return to_string(r); });
      names("protections", kProtectionNames, [](std::string_view name) { return name; });
    });
    return keep(json.text());
  }

 private:
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  const char* keep(std::string text) {
    text_ = std::move(text);
    return text_.c_str();
  }
  [[nodiscard]] static std::vector<Event> events_of(const char* text) {
    std::istringstream in{std::string(text)};
    return read_events(in, "session");
  }

  bool has_context() {
    if (context_ != 0) return context_ > 0;
    EmscriptenWebGLContextAttributes attributes;
    emscripten_webgl_init_context_attributes(&attributes);
    attributes.majorVersion = 2;
    attributes.alpha = attributes.depth = attributes.antialias = false;
    attributes.powerPreference = EM_WEBGL_POWER_PREFERENCE_HIGH_PERFORMANCE;
    context_ = emscripten_webgl_create_context("#canvas", &attributes);
    if (context_ > 0) emscripten_webgl_make_context_current(context_);
    return context_ > 0;
  }

  /// Has shaders compiled while the first bone is made.
  void warm_up() {
    if (warmed_ || !has_context() || lost_) return;
    warmed_ = true;
    try {
      ready_.emplace().warm_up();
    } catch (const std::exception&) {
      ready_.reset();  // the bone's own picture tells why
    }
  }
  /// Does what needs the graphics card; where that refuses, the bone is closed with its reason.
  template <class Work>
  void make(Work&& work) {
    try {
      work();
    } catch (const std::exception& e) {
      close(e.what());
    }
  }
  /// Closes the bone, for a reason or for the next one.
  void close(const std::string& why) {
    playback_.reset();
    writer_.reset();
    bench_.reset();
    if (!why.empty()) refuse(why);
  }

  void take_opened() {
    std::optional<Loaded> loaded = std::move(opening_->loaded());
    const std::string refused = opening_->refused();
    opening_.reset();
    if (!loaded) return refuse(refused);
    if (!has_context() || lost_) return refuse("this browser has no WebGL 2, which the picture needs");
    close("");
    make([&] {
      LiveOptions shown = options_;
      shown.aside = 0;  // the page's instruments lie beside or below the picture
      bench_ = std::make_unique<Workbench>(std::move(*loaded), shown, Showing::kDrawn, std::exchange(ready_, {}));
      first_ = bench_->session().options();
      session_.str({});
      pressed_.clear();
      writer_.emplace(session_, *bench_);
      start_ = Clock::now();
    });
  }

  static void write_vector(Json& json, std::string_view name, const Vec3d& v) {
    json.member(name, [&] {
      json.array([&] {
        for (int a = 0; a < 3; ++a) json.element(v[a]);
      });
    });
  }

  void write_state(Json& json) {
    Workbench& bench = *bench_;
    const TickView& v = bench.view();
    const SessionOptions& options = bench.session().options();
    const DrillSettings& drill = options.drill;
    const std::vector<TickSample> last = bench.session().history().last(1);
    json.member("title", title_of(drill));
    json.member("spindle", v.spindle_on);
    json.member("touch", touch_in_words(v));
    json.member("alert", v.passes || v.status != trephine::Status::kOk);
    json.member("status", state_in_words(v));
    json.member("removed_mm3", v.removed_mm3);
    json.member("force_N", v.wrench.force.norm());
    json.member("torque_mNm", 1e3 * v.wrench.torque.norm());
    json.member("tick_us", last.empty() ? 0.0 : static_cast<double>(last.back().tick_us));
    json.member("ticks", v.tick);
    json.member("late", v.missed);
    json.member("thrust_N", v.cutting.thrust);
    json.member("cutting_torque_mNm", 1e3 * v.cutting.torque);
    json.member("rpm", v.cutting.spindle / trephine::rpm(1));
    json.member("law", drill.mills_by_law());
    json.member("renderer", to_string(drill.renderer));
    json.member("tool", drill.tool_name.empty() ? std::string(kBurrName) : drill.tool_name);
    json.member("family", family_of(drill.tool_name));
    json.member("diameter_mm", 2e3 * drill.burr.tip_radius);
    json.member("protection", to_string(bench.protection()));
    json.member("guarded", bench.guarded() != nullptr);
    json.member("structure", [&] { write_structure(json); });
    const char* const hint = hint_for(bench, seconds());
    json.member("hint", hint != nullptr ? hint : "");
    json.member("note", bench.note());
    json.member("clipped", bench.clipped());
    json.member("can_undo", bench.can_undo());
    json.member("marks", bench.marks());
    json.member("panels", bench.panels());
    json.member("help", bench.help());
    json.member("failed", bench.session().failed());
    json.member("report", bench.session().report());
    json.member("playing", playback_.has_value());
    json.member("contacts", v.contact.count);
    json.member("draw_ms", bench.draw_ms());
    json.member("limit_N", drill.tuning.force);
    json.member("bone", bench.bone().name);
    json.member("notes", [&] {
      json.array([&] {
        for (const std::string& note : bench.bone().notes) json.element(std::string_view(note));
      });
    });
    write_vector(json, "position", Vec3d(1e3 * v.tool.translation()));
    // Where the hand wants the drill, in pixels of the last frame.
    const auto pixel = bench.camera().pixel(bench.hand().pose().translation(), width_, height_);
    json.member("pixel", [&] {
      json.array([&] {
        for (int a = 0; a < 2; ++a) json.element(pixel[a]);
      });
    });
  }

  void write_structure(Json& json) const {
    const StructureReport& r = bench_->view().structures;
    if (bench_->guarded() == nullptr || r.nearest < 0) return json.null();
    const trephine::Structure& s = bench_->guarded()->structures[static_cast<std::size_t>(r.nearest)];
    json.object([&] {
      json.member("name", s.name);
      json.member("colour", [&] {
        json.array([&] {
          for (const float c : s.colour) json.element(static_cast<double>(c));
        });
      });
      json.member("distance_mm", 1e3 * r.distance);
      json.member("words", nearness_in_words(bench_->protection(), r));
      json.member("warns", warns(bench_->protection(), r));
      json.member("push_N", r.push_N);
      json.member("taken_mm3", r.taken_mm3);
      json.member("refused_mm3", r.refused_mm3);
      json.member("felt", felt_in_words(bench_->guarded()->structures, r));
    });
  }

  LiveOptions options_;
  std::optional<Opening> opening_;
  std::optional<ScenePicture> ready_;
  std::string refused_, text_, file_;
  std::unique_ptr<Workbench> bench_;
  SessionOptions first_;
  std::ostringstream session_;
  std::optional<SessionWriter> writer_;
  std::vector<Action> pressed_;
  std::optional<Playback> playback_;
  double play_start_ = 0;
  int width_ = 640, height_ = 480;
  Clock::time_point start_ = Clock::now();
  std::vector<TickSample> samples_;
  EMSCRIPTEN_WEBGL_CONTEXT_HANDLE context_ = 0;
  bool lost_ = false, warmed_ = false;
};

Engine& engine() {
  static Engine& only = *new Engine;  // threads may outlive statics
  return only;
}

/// Does something on the bench if the hand may.
template <class Do>
void by_hand(Do&& act) {
  if (Workbench* const bench = engine().by_hand()) act(*bench);
}

}  // namespace
}  // namespace web

using web::by_hand;
using web::engine;

extern "C" {

// Emscripten's, which warns in the console where the main thread joins another. It does so when a bone is closed, for
// the tick that goes on, and no thread of ours ever waits for the main one.
void emscripten_check_blocking_allowed() {}

EMSCRIPTEN_KEEPALIVE const char* te_words() { return engine().words(); }

EMSCRIPTEN_KEEPALIVE void te_open(const char* kind) {
  try {
    engine().open(web::made_bone(kind, live::LiveOptions{}.margin));
  } catch (const std::exception& e) {
    engine().refuse(e.what());
  }
}
/// `frame` is the first voxel's centre [m] and the unit directions of x and y, in the patient's axes left, back, top.
EMSCRIPTEN_KEEPALIVE void te_open_volume(const char* name, int nx, int ny, int nz, double sx, double sy, double sz,
                                         const double* frame, const std::int16_t* voxels, double isovalue) {
  try {
    if (nx < 1 || ny < 1 || nz < 1) throw std::invalid_argument("a volume needs a voxel along each axis at least");
    const std::size_t count =
        static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
    using live::Vec3d;
    const Vec3d x(frame[3], frame[4], frame[5]), y(frame[6], frame[7], frame[8]);
    live::Mat3d R;
    R << x, y, x.cross(y);
    const live::Posed X_WG = trephine::make_pose<double>(R, Vec3d(frame[0], frame[1], frame[2]));
    engine().open(web::scanned_bone(name, {.size = {nx, ny, nz}, .spacing = Vec3d(sx, sy, sz), .X_WG = X_WG},
                                    std::vector<std::int16_t>(voxels, voxels + count), isovalue));
  } catch (const std::exception& e) {
    engine().refuse(e.what());
  }
}
EMSCRIPTEN_KEEPALIVE const char* te_opening() { return engine().opening(); }
EMSCRIPTEN_KEEPALIVE int te_frame(double dt, int width, int height) {
  return engine().frame(dt, width, height) ? 1 : 0;
}

// Pixels of the drawing buffer, from the upper left.
EMSCRIPTEN_KEEPALIVE void te_mouse_at(double x, double y) {
  by_hand([&](live::Workbench& b) { b.mouse_at(x, y); });
}
EMSCRIPTEN_KEEPALIVE void te_move(double x, double y) {
  by_hand([&](live::Workbench& b) { b.move_drill(x, y); });
}
EMSCRIPTEN_KEEPALIVE void te_push(double metres) {
  by_hand([&](live::Workbench& b) { b.push_drill(metres); });
}
EMSCRIPTEN_KEEPALIVE void te_turn(double dx, double dy) {
  by_hand([&](live::Workbench& b) { b.turn_drill(dx, dy); });
}
EMSCRIPTEN_KEEPALIVE void te_spindle(int on) {
  by_hand([&](live::Workbench& b) { b.hold_spindle(on != 0); });
}
// The view can be turned while a session plays.
EMSCRIPTEN_KEEPALIVE void te_orbit(double dx, double dy) {
  if (auto* const bench = engine().bench()) bench->orbit(dx, dy);
}
EMSCRIPTEN_KEEPALIVE void te_pan(double dx, double dy) {
  if (auto* const bench = engine().bench()) bench->pan(dx, dy);
}
EMSCRIPTEN_KEEPALIVE void te_zoom(double notches) {
  if (auto* const bench = engine().bench()) bench->zoom(notches);
}

EMSCRIPTEN_KEEPALIVE void te_act(const char* name) { engine().act(live::action_named(name)); }
EMSCRIPTEN_KEEPALIVE void te_tool(const char* family) {
  by_hand([&](live::Workbench& b) { b.choose_family(family); });
}
EMSCRIPTEN_KEEPALIVE void te_protect(const char* name) {
  const auto at = std::find(live::kProtectionNames.begin(), live::kProtectionNames.end(), std::string_view(name));
  if (at == live::kProtectionNames.end()) return;
  const auto number = static_cast<std::size_t>(at - live::kProtectionNames.begin());
  by_hand([&](live::Workbench& b) { b.protect(live::kProtections[number]); });
}
EMSCRIPTEN_KEEPALIVE void te_renderer(const char* name) { engine().choose(name); }
EMSCRIPTEN_KEEPALIVE void te_law(int on) { engine().set_law(on != 0); }

EMSCRIPTEN_KEEPALIVE const char* te_state() { return engine().state(); }
EMSCRIPTEN_KEEPALIVE const float* te_history(int most) { return engine().history(most); }
EMSCRIPTEN_KEEPALIVE int te_history_count() { return engine().history_count(); }

EMSCRIPTEN_KEEPALIVE const char* te_session() { return engine().session(); }
EMSCRIPTEN_KEEPALIVE const char* te_play(const char* text) { return engine().play(text); }
EMSCRIPTEN_KEEPALIVE const char* te_run_script(const char* text) { return engine().run_script(text); }

EMSCRIPTEN_KEEPALIVE int te_stl() { return engine().write(web::stl_of) ? 1 : 0; }
EMSCRIPTEN_KEEPALIVE int te_nrrd() { return engine().write(web::nrrd_of) ? 1 : 0; }
EMSCRIPTEN_KEEPALIVE const char* te_file() { return engine().file().data(); }
EMSCRIPTEN_KEEPALIVE std::size_t te_file_size() { return engine().file().size(); }

EMSCRIPTEN_KEEPALIVE void te_context_lost() { engine().context_lost(); }
EMSCRIPTEN_KEEPALIVE void te_context_restored() { engine().context_restored(); }

}  // extern "C"
