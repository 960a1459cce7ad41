// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/math.hpp>
#include <trephine/core/status.hpp>
#include <trephine/session/recorded_tick.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>

/// A tick as files of sessions hold it: 12 doubles of X_WT (rotation by columns, then position [m]), dt [s], 3 of force
/// [N], 3 of torque [N·m], contact depth [m], removed [mm³]; int32 contact count; bytes spindle, tip, shaft, status.
/// Then structures: doubles distance [m], 3 of the push's force [N], 3 of its torque [N·m], refused and taken [mm³];
/// int32 nearest; byte warns, 3 bytes 0; membranes are left out. Then cutting: doubles thrust [N], torque [N·m],
/// spindle [rad/s], feed [m/s]. Numbers are stored bit by bit, NaN included, in the writer's byte order.
namespace trephine::inline TREPHINE_ALIGNED::recording_detail {

inline constexpr std::uint32_t kByteOrder = 0x01020304;
inline constexpr std::uint32_t kVersion = 3;
/// Bytes a tick of a version, from 1.
constexpr std::size_t tick_bytes_of(std::uint32_t version) noexcept {
  const std::size_t first = 21 * sizeof(double) + 4 + 4;
  const std::size_t structures = version > 1 ? 9 * sizeof(double) + 4 + 4 : 0;
  const std::size_t cutting = version > 2 ? 4 * sizeof(double) : 0;
  return first + structures + cutting;
}
inline constexpr std::size_t kTickBytes = tick_bytes_of(kVersion);

/// Reads values in the order in which `append_number` wrote them. The caller checks the length first.
class Cursor {
 public:
  explicit Cursor(const char* at) : at_(at) {}
  template <class Value>
  Value take() {
    static_assert(std::is_arithmetic_v<Value>);
    Value value;
    std::memcpy(&value, at_, sizeof(Value));
    at_ += sizeof(Value);
    return value;
  }
  void take(Eigen::Ref<Vec3d> v) {
    for (int i = 0; i < 3; ++i) v[i] = take<double>();
  }

 private:
  const char* at_;
};

inline std::uint64_t fnv1a(std::span<const char> bytes) noexcept {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  return hash;
}

inline void put_tick(std::string& bytes, const RecordedTick& tick) {
  const auto put3 = [&bytes](const Vec3d& v) {
    for (int i = 0; i < 3; ++i) append_number(bytes, v[i]);
  };
  for (int column = 0; column < 3; ++column) put3(tick.input.X_WT.linear().col(column));
  put3(tick.input.X_WT.translation());
  append_number(bytes, tick.dt);
  put3(tick.result.wrench.force);
  put3(tick.result.wrench.torque);
  append_number(bytes, tick.result.contact.depth);
  append_number(bytes, tick.result.removed_mm3);
  append_number(bytes, static_cast<std::int32_t>(tick.result.contact.count));
  append_number(bytes, static_cast<std::uint8_t>(tick.input.spindle_on));
  append_number(bytes, static_cast<std::uint8_t>(tick.result.contact.tip));
  append_number(bytes, static_cast<std::uint8_t>(tick.result.contact.shaft));
  append_number(bytes, static_cast<std::uint8_t>(tick.result.status));
  const StructureSummary& s = tick.result.structures;
  append_number(bytes, s.distance);
  put3(s.push.force);
  put3(s.push.torque);
  append_number(bytes, s.refused_mm3);
  append_number(bytes, s.taken_mm3);
  append_number(bytes, static_cast<std::int32_t>(s.nearest));
  append_number(bytes, static_cast<std::uint8_t>(s.warns));
  bytes.append(3, '\0');
  const CuttingSummary& c = tick.result.cutting;
  for (const double number : {c.thrust, c.torque, c.spindle, c.feed}) append_number(bytes, number);
}

inline void take_structures(Cursor& cursor, StructureSummary& s) {
  s.distance = cursor.take<double>();
  cursor.take(s.push.force);
  cursor.take(s.push.torque);
  s.refused_mm3 = cursor.take<double>();
  s.taken_mm3 = cursor.take<double>();
  s.nearest = cursor.take<std::int32_t>();
  s.warns = cursor.take<std::uint8_t>() != 0;
  for (int i = 0; i < 3; ++i) (void)cursor.take<std::uint8_t>();
}

inline RecordedTick take_tick(Cursor& cursor, std::uint32_t version) {
  RecordedTick tick;
  for (int column = 0; column < 3; ++column) cursor.take(tick.input.X_WT.linear().col(column));
  cursor.take(tick.input.X_WT.translation());
  tick.dt = cursor.take<double>();
  cursor.take(tick.result.wrench.force);
  cursor.take(tick.result.wrench.torque);
  tick.result.contact.depth = cursor.take<double>();
  tick.result.removed_mm3 = cursor.take<double>();
  tick.result.contact.count = cursor.take<std::int32_t>();
  tick.input.spindle_on = cursor.take<std::uint8_t>() != 0;
  tick.result.contact.tip = cursor.take<std::uint8_t>() != 0;
  tick.result.contact.shaft = cursor.take<std::uint8_t>() != 0;
  tick.result.status = static_cast<Status>(cursor.take<std::uint8_t>());
  if (version > 1) take_structures(cursor, tick.result.structures);
  CuttingSummary& c = tick.result.cutting;
  if (version > 2)
    for (double* const number : {&c.thrust, &c.torque, &c.spindle, &c.feed}) *number = cursor.take<double>();
  return tick;
}

}  // namespace trephine
