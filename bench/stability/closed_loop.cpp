// SPDX-License-Identifier: MIT
#include "stability/closed_loop.hpp"

#include "common/percentile.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <numeric>
#include <random>
#include <sstream>
#include <utility>

namespace trephine::bench {

namespace {

double rms(const std::vector<double>& x, std::size_t from, std::size_t to) {
  if (to <= from) return 0;
  double mean = 0, squares = 0;
  for (std::size_t i = from; i < to; ++i) mean += x[i] / static_cast<double>(to - from);
  for (std::size_t i = from; i < to; ++i) squares += (x[i] - mean) * (x[i] - mean) / static_cast<double>(to - from);
  return std::sqrt(squares);
}

/// Beyond Rule E, for a stiffness known only at the end: E is kept with the two integrals that K and K_θ multiply, and
/// with what the tick grants in which contact begins, of which only the part in bone counts: there K |Δx| is the force.
struct Leak {
  double energy, linear, angular, entries;
};

/// ∫ v² dt over a tick from the velocities at its ends and the way between: Simpson's rule.
double speed_squared(const Vec3d& v0, const Vec3d& v1, const Vec3d& way, double dt) {
  const Vec3d middle = 1.5 / dt * way - 0.25 * (v0 + v1);
  return dt / 6 * (v0.squaredNorm() + 4 * middle.squaredNorm() + v1.squaredNorm());
}

/// 95th percentile: what changes of force per motion are found, without the law's jumps.
double found_in(const std::vector<double>& ratios) { return ratios.empty() ? 0 : percentile(ratios, 0.95); }

/// Peak to peak about a straight way, whatever drift there is [m]: the median over windows of an eighth of a second.
double tremble_of(const std::vector<double>& x, std::size_t from, double dt) {
  const auto window = std::max<std::size_t>(8, static_cast<std::size_t>(0.125 / dt));
  std::vector<double> found;
  for (std::size_t at = from; at + window <= x.size(); at += window) {
    const double middle = 0.5 * static_cast<double>(window - 1);
    double mean = 0, slope = 0, squares = 0;
    for (std::size_t i = 0; i < window; ++i) mean += x[at + i] / static_cast<double>(window);
    for (std::size_t i = 0; i < window; ++i) {
      const double t = static_cast<double>(i) - middle;
      slope += t * (x[at + i] - mean);
      squares += t * t;
    }
    double low = 0, high = 0;
    for (std::size_t i = 0; i < window; ++i) {
      const double about = x[at + i] - mean - slope / squares * (static_cast<double>(i) - middle);
      low = std::min(low, about);
      high = std::max(high, about);
    }
    found.push_back(high - low);
  }
  return found.empty() ? 0 : percentile(found, 0.5);
}

}  // namespace

Law law_of(AnyTool& tool, bool spindle) {
  return [&tool, spindle](const Posed& X, double dt) { return tool.tick({X, spindle}, dt).wrench; };
}

LoopReport run_loop(const Law& law, const LoopOptions& o) {
  using Hand = std::function<HandTarget(double)>;
  const Posed start = o.device.X_DH;
  SimulatedDevice<Hand> device(o.device, o.hand ? o.hand : Hand([start](double) { return HandTarget(start); }));
  LoopReport r;
  DeviceState state;
  std::vector<double> height;
  std::vector<Vec3d> forces, turns;
  std::vector<Leak> leaks;
  std::vector<double> linear_ratios, angular_ratios;
  const auto ticks = static_cast<std::size_t>(std::llround(o.seconds / o.dt));
  std::deque<Vec3d> biases(static_cast<std::size_t>(o.device.delay_ticks) + 1, Vec3d::Zero());
  Posed before = device.X_DH();
  Wrenchd last;
  Leak sum{0, 0, 0, 0};
  Twist velocity = device.velocity();
  bool touched = false;
  double way_in = 0, turn_in = 0;  // the last tick's [m], [rad]
  const double hold = o.dt * (0.5 + o.device.delay_ticks);
  constexpr double kLever = 0.01;  // [m] what a turn counts as motion with
  for (std::size_t i = 0; i < ticks; ++i) {
    if (device.read(state) != DeviceStatus::kOk) {
      r.escaped = true;
      break;
    }
    const Posed& X = state.X_DH;
    const Wrenchd wrench = law(X, o.dt);
    const Vec3d df = wrench.force - last.force, dt = wrench.torque - last.torque;
    r.most_force = std::max(r.most_force, wrench.force.norm());
    if (i > 0) r.force_step = std::max(r.force_step, df.norm());
    last = wrench;
    if (device.write({wrench.force + o.bias, wrench.torque}) != DeviceStatus::kOk) {
      r.escaped = true;
      break;
    }
    biases.push_back(o.bias);
    biases.pop_front();
    // Held over the tick: the work of the scene's part, exact whatever the path.
    const Wrenchd acting = device.applied();
    device.advance(o.dt);
    const Posed now = device.X_DH();
    const Vec3d move = now.translation() - before.translation();
    const Vec3d turn = turn_between(before, now);
    before = now;
    const Twist then = std::exchange(velocity, device.velocity());
    sum.energy += (acting.force - biases.front()).dot(move) + acting.torque.dot(turn);
    const bool touches = wrench.force.squaredNorm() > 0 || wrench.torque.squaredNorm() > 0 ||
                         acting.torque.squaredNorm() > 0 || (acting.force - biases.front()).squaredNorm() > 0;
    if (touches) {
      if (!touched) sum.entries += hold / o.dt * (wrench.force.norm() * way_in + wrench.torque.norm() * turn_in);
      sum.linear +=
          hold * speed_squared(then.linear, velocity.linear, move, o.dt) + 0.5 * o.device.linear.quantum * move.norm();
      sum.angular += hold * speed_squared(then.angular, velocity.angular, turn, o.dt) +
                     0.5 * o.device.angular.quantum * turn.norm();
      const double way = std::hypot(move.norm(), kLever * turn.norm());
      if (way > 1e-6) {
        linear_ratios.push_back(df.norm() / way);
        angular_ratios.push_back(dt.norm() / (way / kLever));
      }
    }
    touched = touches;
    way_in = move.norm();
    turn_in = turn.norm();
    leaks.push_back(sum);
    height.push_back(now.translation().dot(o.along));
    forces.push_back(wrench.force);
    turns.push_back(turn_between(start, now));
    if (o.trace)
      o.trace(static_cast<double>(i) * o.dt, wrench, sum.energy,
              o.stiffness * sum.linear + o.angular_stiffness * sum.angular + sum.entries);
    if (!now.translation().allFinite() || (now.translation() - start.translation()).norm() > o.escape) {
      r.escaped = true;
      break;
    }
  }
  r.last = before;
  const double K = o.stiffness > 0 ? o.stiffness : found_in(linear_ratios);
  const double K_turn = o.angular_stiffness > 0 ? o.angular_stiffness : found_in(angular_ratios);
  for (const Leak& leak : leaks) {
    r.energy = std::max(r.energy, leak.energy);
    r.beyond = std::max(r.beyond, leak.energy - K * leak.linear - K_turn * leak.angular - leak.entries);
  }
  if (r.escaped) {
    r.amplitude = r.tremble = r.late = o.escape;
    return r;
  }
  const auto tail = static_cast<std::size_t>(o.settle / o.dt);
  const std::size_t from = height.size() > tail ? height.size() - tail : 0;
  const auto ends = std::minmax_element(height.begin() + static_cast<std::ptrdiff_t>(from), height.end());
  r.amplitude = *ends.second - *ends.first;
  r.tremble = tremble_of(height, from, o.dt);
  r.early = rms(height, height.size() / 20, height.size() / 20 + height.size() / 8);
  r.late = rms(height, height.size() - height.size() / 8, height.size());
  Vec3d mean = Vec3d::Zero(), low = turns[from], high = turns[from];
  for (std::size_t i = from; i < forces.size(); ++i) {
    mean += forces[i] / static_cast<double>(forces.size() - from);
    low = low.cwiseMin(turns[i]);
    high = high.cwiseMax(turns[i]);
  }
  r.turn = (high - low).maxCoeff();
  r.mean_force = mean;
  double squares = 0;
  for (std::size_t i = from; i < forces.size(); ++i)
    squares += (forces[i] - mean).squaredNorm() / static_cast<double>(forces.size() - from);
  r.ripple = std::sqrt(squares);
  return r;
}

bool comes_to_rest(const LoopReport& r, double amplitude) {
  return !r.escaped && (r.amplitude <= amplitude || r.late < 0.5 * r.early);
}

SimulatedDeviceOptions device_of(double mass, double damping, const std::string& hand) {
  SimulatedDeviceOptions o;
  constexpr double kArm2 = 1e-3;  // [m²] rotation follows translation by the square of an arm of 3 cm
  o.linear = {.inertia = mass, .damping = damping};
  o.angular = {.inertia = mass * kArm2, .damping = damping * kArm2};
  o.hand_linear = o.hand_angular = {};
  if (hand == "light") {
    o.hand_linear = {.inertia = 0.02, .damping = 2, .stiffness = 100};
    o.hand_angular = {.inertia = 2e-5, .damping = 2e-3, .stiffness = 0.1};
  } else if (hand == "firm") {
    o.hand_linear = {.inertia = 0.04, .damping = 8, .stiffness = 400};
    o.hand_angular = {.inertia = 4e-5, .damping = 8e-3, .stiffness = 0.4};
  }
  o.substeps = 1;
  return o;
}

double largest_stable(double low, double high, double within, const std::function<bool(double)>& stable) {
  // Upward first: beyond the border there are islands of rest that a bisection over all would take for it.
  constexpr double kStride = 1.6;
  if (!stable(low)) return low;
  double above = low;
  do {
    low = above;
    if (low >= high) return high;
    above = std::min(high, kStride * low);
  } while (stable(above));
  while (above / low > within) {
    const double x = std::sqrt(low * above);
    (stable(x) ? low : above) = x;
  }
  return std::sqrt(low * above);
}

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
  constexpr double kFriction = 0.05, kQuantum = 0.055e-3;  // [N], [m]
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
  o.device.X_DH = inside ? touch : moved(touch, 1e-3 * place.outward);
  const double k = o.device.hand_linear.stiffness;
  if (!(k > 0)) {
    o.bias = newton * way_in(place);
    return o;
  }
  Posed target = moved(touch, newton / k * way_in(place));
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
