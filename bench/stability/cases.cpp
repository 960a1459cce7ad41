// SPDX-License-Identifier: MIT
#include "stability/cases.hpp"

#include <algorithm>
#include <random>
#include <sstream>

namespace trephine::bench {
namespace {

constexpr double kFriction = 0.05;     // [N]
constexpr double kQuantum = 0.055e-3;  // [m]

}  // namespace

std::string Case::text() const {
  std::ostringstream s;
  s << "b " << damping << " delay " << delay << " hand " << hand;
  if (friction > 0) s << " friction " << friction << " N";
  if (quantum > 0) s << " quantum " << 1e3 * quantum << " mm";
  return s.str();
}

SimulatedDeviceOptions Case::device() const {
  SimulatedDeviceOptions o = device_of(kDeviceMass, damping, hand);
  o.linear.friction = friction;
  o.linear.quantum = quantum;
  o.angular.quantum = quantum > 0 ? 1e-4 : 0;
  o.delay_ticks = delay;
  o.substeps = friction > 0 ? 10 : 1;
  return o;
}

double Case::theory() const {
  const SimulatedDeviceOptions o = device();
  return (o.linear.damping + o.hand_linear.damping) / (1e-3 * (0.5 + delay));
}

std::vector<Case> swept_cases(int count) {
  const Case usual{.hand = "light"};
  std::vector<Case> cases{usual};
  const auto changed = [&](auto member, auto value) {
    Case c = usual;
    c.*member = value;
    cases.push_back(c);
  };
  for (const double b : {0.005, 0.05, 5.0}) changed(&Case::damping, b);
  changed(&Case::friction, kFriction);
  changed(&Case::quantum, kQuantum);
  for (const int d : {1, 2}) changed(&Case::delay, d);
  for (const char* hand : {"none", "firm"}) changed(&Case::hand, hand);
  std::mt19937 random(13);
  const auto pick = [&](const auto& from) { return from[random() % from.size()]; };
  for (int i = 0; i < count;) {
    const Case c{.damping = pick(std::vector{0.005, 0.05, 0.5, 5.0}),
                 .delay = pick(std::vector{0, 1, 2}),
                 .hand = pick(std::vector<std::string>{"none", "light", "firm"}),
                 .friction = pick(std::vector{0.0, kFriction}),
                 .quantum = pick(std::vector{0.0, kQuantum})};
    if (std::find(cases.begin(), cases.end(), c) != cases.end()) continue;
    cases.push_back(c);
    ++i;
  }
  return cases;
}

Vec3d way_in(const Place& place) {
  if (place.name == "slot") return Vec3d(0.7, 0, -0.7);
  if (place.name == "shaft in a hole") return Vec3d(0.7, 0.2, 0);
  return -place.outward;
}

double bias_for(double K) { return std::min(1.0, 0.7e-3 * K); }

LoopOptions press(const Place& place, const Setup& setup, const SimulatedDeviceOptions& device, double newton) {
  LoopOptions o;
  o.device = device;
  o.along = place.outward;
  const Posed touch = place.start(setup);
  const bool inside = place.name == "slot" || place.name == "shaft in a hole";
  o.device.X_DH = touch;
  if (!inside) o.device.X_DH.translation() += 1e-3 * place.outward;
  const double k = o.device.hand_linear.stiffness;
  if (!(k > 0)) {
    o.bias = newton * way_in(place);
    return o;
  }
  Posed target = touch;
  target.translation() += newton / k * way_in(place);
  if (place.name == "slot") target.translation().x() += kPlaceVoxel;
  const Posed from = o.device.X_DH;
  o.hand = [from, target](double t) {  // in a quarter of a second
    const double s = std::min(1.0, 4 * t);
    return HandTarget(make_pose<double>(from.linear(), (1 - s) * from.translation() + s * target.translation()));
  };
  return o;
}

Law along(Law law, Vec3d n) {
  return [law = std::move(law), n](const Posed& X, double dt) {
    return Wrenchd{law(X, dt).force.dot(n) * n, Vec3d::Zero()};
  };
}

}  // namespace trephine::bench
