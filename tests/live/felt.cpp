// SPDX-License-Identifier: MIT
// Soft structures in the window: bone over the dura is drilled away, and the dura is felt, tears, and is healed.
#include "held_drill.hpp"
#include "support/near.hpp"
#include "window_bench.hpp"
#include "words.hpp"

#include <trephine/core/units.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace live_felt {

using namespace live;
using namespace trephine::literals;
using trephine::LabelGrid;
using trephine::test::near;
using trephine::test::within;

constexpr double kVoxel = 0.4_mm, kDura = 8.2_mm, kTop = 10.2_mm;  // heights of the bone's faces
constexpr int kWide = 40, kHigh = 40;

double height(int k) { return kVoxel * k; }

/// A plate of bone over soft tissue.
drill::Bone plate() {
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kHigh; ++k) {
    const double out = std::max(kDura - height(k), height(k) - kTop);
    voxels.insert(voxels.end(), kWide * kWide, static_cast<std::int16_t>(std::lround(600 * std::erfc(out / kVoxel))));
  }
  return {.name = "plate",
          .unit = "levels",
          .grid = drill::Grid({.size = {kWide, kWide, kHigh}, .spacing = Vec3d::Constant(kVoxel)},
                              std::span<const std::int16_t>(voxels)),
          .isovalue = 600,
          .burr = {.tip_radius = 1.2_mm, .shaft_radius = 0.6_mm, .shaft_length = 30_mm},
          .notes = {}};
}

/// All below the plate is dura, if it is named so.
std::shared_ptr<const GuardedBone> guarded(const drill::Bone& bone, const std::string& name) {
  std::vector<std::uint8_t> voxels;
  for (int k = 0; k < kHigh; ++k) voxels.insert(voxels.end(), kWide * kWide, height(k) < kDura ? 3 : 0);
  const LabelGrid<std::uint8_t> labels({.size = {kWide, kWide, kHigh}, .spacing = Vec3d::Constant(kVoxel)}, voxels,
                                       {{.label = 3, .name = name}});
  return guard_bone(bone, labels, 1_mm, {}, [](double /*share*/) {});
}

DrillSettings settings_for(const drill::Bone& bone, const std::shared_ptr<const GuardedBone>& guarded) {
  DrillSettings settings{.burr = bone.burr, .guarded = guarded};
  settings.strength = {.soft = 0, .cortical = 2400};
  settings.tuning.vibration = settings.tuning.teeth = 0;
  settings.potential = potential_for(*guarded, settings.burr);
  settings.soft = soft_for(*guarded, settings.burr);
  return settings;
}

/// The drill upright, its burr `depth` below the plate's lower face.
Posed over(double depth, double x = 0, double y = 0) {
  const double middle = 0.5 * kVoxel * (kWide - 1);
  return trephine::make_pose<double>(trephine::Mat3d::Identity(),
                                     Vec3d(middle + x, middle + y, kDura + 1.2_mm - depth));
}

TEST_CASE("soft structures: the burr goes through the bone, rests on the dura, and tears it at the law's depth") {
  for (const bool law : {false, true}) {
    CAPTURE(law);
    drill::Bone bone = plate();
    DrillSettings settings = settings_for(bone, guarded(bone, "dura mater"));
    settings.law = law;
    REQUIRE(settings.soft != nullptr);
    Inboxes inboxes;
    const auto drill = make_drill(bone.grid, bone.isovalue, settings, inboxes);
    // A hole wider than the burr, a millimetre deeper than the plate.
    double removed = 0, early = 0;
    int held = 0;
    for (int i = 0; i < 800; ++i) {
      const auto r = drill->tick({.X_WT = over(-2.4_mm + 10e-6 * i)}, 1e-3);
      held += r.contact.count > 0 ? 1 : 0;
      early += r.structures.soft_force;
    }
    CHECK(held > 500);
    CHECK(early == 0);  // bone over it carries the burr
    static_cast<void>(drill->tick({.X_WT = over(-6_mm)}, 1e-3));
    for (const double angle : {0.0, 1.6, 3.2, 4.8})
      for (int i = 0; i < 2600; ++i) {
        const double depth = std::min(-2.4_mm + 2e-6 * i, 1_mm), side = 0.7_mm;
        const bool back = i >= 2400;
        const auto r = drill->tick(
            {.X_WT = over(back ? -6_mm : depth, side * std::cos(angle), side * std::sin(angle)), .spindle_on = !back},
            1e-3);
        removed += r.removed_mm3;
      }
    CHECK(removed > 15);
    CHECK(drill->structures().torn < 0);

    const trephine::MembraneLaw dura = settings.soft->law(0);
    int touches = 0, wrong = 0, tears = 0;
    double depth = 0, force = 0, after = 0;
    removed = 0;
    for (int i = 0; i < 6000; ++i) {
      const auto r = drill->tick({.X_WT = over(-1_mm + 2e-6 * i), .spindle_on = true}, 1e-3);
      const StructureReport report = drill->structures();
      touches += r.contact.count;
      removed += r.removed_mm3;
      force = std::max(force, report.pressed_N);
      if (r.structures.tears && tears++ == 0) depth = kDura + 1.2_mm - drill->tool_W().translation().z();
      if (tears == 0 && report.pressed_N > 0.3)
        wrong += report.pressed == 0 && r.structures.soft_force == report.pressed_N &&
                         std::abs(r.wrench.force.z() - report.pressed_N) < 0.03 + 0.01 * report.pressed_N
                     ? 0
                     : 1;
      if (i == 5999) after = r.wrench.force.norm();
    }
    MESSAGE("tears at ", 1e3 * depth, " mm and ", force, " N; ", after, " N after it");
    CHECK(touches == 0);
    CHECK(removed == 0);
    CHECK(wrong == 0);
    CHECK(tears >= 50);
    CHECK(depth == within(dura.rupture_depth, 0.1_mm));
    CHECK(force == near(dura.rupture_force, 0.02));
    CHECK(after < 0.3 * force);
    CHECK(drill->structures().torn == 0);
    CHECK(felt_in_words(settings.guarded->structures, drill->structures()).ends_with(" N on the dura mater, torn"));
    REQUIRE(drill->soft() != nullptr);
    drill->soft()->heal();
    static_cast<void>(drill->tick({.X_WT = over(-6_mm)}, 1e-3));
    CHECK(felt_in_words(settings.guarded->structures, drill->structures()).empty());
  }
}

TEST_CASE("soft structures: restore and undo heal them, and another tool or renderer does not") {
  drill::Bone bone = plate();
  const auto structures = guarded(bone, "dura");
  const drill::Spot spot{.p_W = over(0).translation(), .normal_W = Vec3d::UnitZ()};
  Workbench bench(Loaded{std::move(bone), spot, structures}, LiveOptions{}, Showing::kSimulated);
  const auto hand = [&](double depth) {
    Event e;
    e.kind = Event::Kind::kHand;
    e.pose = over(depth);
    bench.apply(e);
  };
  std::string torn;
  double most = 0;
  // Drills and presses until it tears, and withdraws.
  const auto tear = [&](double t) {
    if (t < 0.5) return hand(-4_mm);
    if (t < 0.6 && !bench.spindle()) bench.act(Action::kSpindle);
    if (t < 5) return hand(-4_mm + 12e-3 * (t - 0.5));
    if (t > 7 && bench.spindle()) bench.act(Action::kSpindle);
    hand(-4_mm);
  };
  double next = 0;
  int step = 0;
  bench.session().simulate([&](double time) {
    if (time < next) return true;
    next += 1.0 / 60;
    bench.update(1.0 / 60, 320, 240);
    const double t = std::fmod(time, 9);
    most = std::max(most, bench.view().structures.pressed_N);
    if (static_cast<int>(time / 9) > step) {
      torn += felt_in_words(structures->structures, bench.view().structures) + "|";
      ++step;
      if (step == 1) bench.act(Action::kUndo);
      if (step == 3) bench.act(Action::kLargerBurr);
      if (step == 4) bench.act(Action::kRenderer);
      for (int i = 0; step == 5 && i < 2; ++i) bench.act(Action::kRenderer);
      if (step == 6) bench.act(Action::kRestore);
    }
    if (step == 0 || step == 2) tear(t);
    return step < 7;
  });
  // Torn, undone, torn again, another burr, Line, the coupled tool, restored.
  INFO("at most ", most, " N");
  CHECK(torn == "dura torn||dura torn|dura torn||dura torn||");
}

TEST_CASE("soft structures: a name says what is felt, and a structure that is bone is not") {
  const auto thickness = [](const char* name) {
    const auto m = membrane_named(name);
    return m ? m->thickness : 0;
  };
  for (const char* name : {"dura", "Dura mater", "left_dura"}) CHECK(thickness(name) == trephine::dura().thickness);
  for (const char* name : {"sinus", "sigmoid sinus", "Superior_Sagittal_Sinus", "TransverseSinus"})
    CHECK(thickness(name) == trephine::sinus_wall().thickness);
  for (const char* name : {"nerve", "Facial Nerve", "facialNerve", "nerve_7"})
    CHECK(thickness(name) == trephine::nerve().thickness);
  for (const char* name : {"bone", "frontal sinus", "maxillary_sinus", "durability", "nervous", "epidural space", ""})
    CHECK(thickness(name) == 0);
  drill::Bone bone = plate();
  CHECK(soft_for(*guarded(bone, "tumour"), bone.burr) == nullptr);
  bone.isovalue = -1;  // all is bone
  const auto hard = guarded(bone, "dura");
  CHECK(soft_for(*hard, bone.burr) == nullptr);
  REQUIRE(hard->notes.size() == 1);
  CHECK(hard->notes[0].find("'dura' is bone") != std::string::npos);
}

}  // namespace live_felt
