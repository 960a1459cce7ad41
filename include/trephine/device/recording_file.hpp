// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/throwing.hpp>
#include <trephine/device/recorder.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

/// Saves and loads recordings, so that a session on real hardware can be replayed elsewhere. Not for the haptic thread.
///
/// File format: 8 bytes "TREPHREC"; uint32 byte-order mark 0x01020304, uint32 version 3, uint32 bytes a tick, uint32 0;
/// uint64 ticks; the ticks; uint64 FNV-1a hash of all preceding bytes. A tick: 12 doubles of X_WT (rotation by columns,
/// then position [m]), dt [s], 3 of force [N], 3 of torque [N·m], contact depth [m], removed [mm³]; int32 contact
/// count; bytes spindle, tip, shaft, status. Then structures: doubles distance [m], 3 of the push's force [N], 3 of its
/// torque [N·m], refused and taken [mm³]; int32 nearest; byte warns, 3 bytes 0. Then cutting: doubles thrust [N],
/// torque [N·m], spindle [rad/s], feed [m/s]. Numbers are stored bit by bit, NaN included, in the writer's byte order.
/// A reader of the other byte order refuses the file.
///
/// Version 1 ends a tick before the structures, version 2 before the cutting. Such files still load, and what they lack
/// has the defaults.
namespace trephine::inline TREPHINE_ALIGNED {

namespace recording_detail {

inline constexpr char kMagic[8] = {'T', 'R', 'E', 'P', 'H', 'R', 'E', 'C'};
inline constexpr std::uint32_t kByteOrder = 0x01020304;
inline constexpr std::uint32_t kVersion = 3;
inline constexpr std::size_t kHeaderBytes = 32;
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

}  // namespace recording_detail

/// Writes the ticks to the file `path` and replaces it if it exists. Throws std::runtime_error if writing fails.
inline void save_recording(const std::filesystem::path& path, std::span<const RecordedTick> ticks) {
  namespace detail = recording_detail;
  std::string bytes;
  bytes.reserve(detail::kHeaderBytes + ticks.size() * detail::kTickBytes + 8);
  bytes.append(detail::kMagic, sizeof(detail::kMagic));
  append_number(bytes, detail::kByteOrder);
  append_number(bytes, detail::kVersion);
  append_number(bytes, static_cast<std::uint32_t>(detail::kTickBytes));
  append_number(bytes, std::uint32_t{0});
  append_number(bytes, static_cast<std::uint64_t>(ticks.size()));
  for (const RecordedTick& tick : ticks) detail::put_tick(bytes, tick);
  append_number(bytes, detail::fnv1a(bytes));
  write_file(path, "save_recording", bytes);
}

/// Reads a file of `save_recording`. Throws std::runtime_error with path and reason if the file is missing, no
/// recording, or of a later version or another byte order. It also throws if the length differs from the header's or
/// the content was altered. The length is checked against the header before memory for ticks is allocated.
[[nodiscard]] inline std::vector<RecordedTick> load_recording(const std::filesystem::path& path) {
  namespace detail = recording_detail;
  const auto fail = [&path](const std::string& what) {
    throw_error<std::runtime_error>("trephine::load_recording: " + path_text(path) + ": " + what);
  };
  std::ifstream in(path, std::ios::binary);
  if (!in) fail("cannot be opened");
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (in.bad()) fail("cannot be read");
  if (bytes.size() < detail::kHeaderBytes + 8)
    fail("too short for a recording (" + std::to_string(bytes.size()) + " bytes)");
  if (std::memcmp(bytes.data(), detail::kMagic, sizeof(detail::kMagic)) != 0) fail("is not a trephine recording");

  detail::Cursor cursor(bytes.data() + sizeof(detail::kMagic));
  if (cursor.take<std::uint32_t>() != detail::kByteOrder) fail("was written on a machine of the other byte order");
  const auto version = cursor.take<std::uint32_t>();
  if (version < 1 || version > detail::kVersion)
    fail("has version " + std::to_string(version) + ", this reads 1 to " + std::to_string(detail::kVersion));
  const std::size_t expected = detail::tick_bytes_of(version);
  const auto tick_bytes = cursor.take<std::uint32_t>();
  if (tick_bytes != expected) fail("has " + std::to_string(tick_bytes) + " bytes a tick");
  (void)cursor.take<std::uint32_t>();
  const auto count = cursor.take<std::uint64_t>();
  const std::size_t body = bytes.size() - detail::kHeaderBytes - 8;
  if (body % expected != 0 || count != body / expected)
    fail("has " + std::to_string(count) + " ticks by its header but holds " + std::to_string(body) + " bytes of " +
         std::to_string(expected) + " a tick (cut short?)");
  detail::Cursor tail(bytes.data() + bytes.size() - 8);
  if (tail.take<std::uint64_t>() != detail::fnv1a({bytes.data(), bytes.size() - 8})) fail("is damaged (hash differs)");

  std::vector<RecordedTick> ticks;
  ticks.reserve(static_cast<std::size_t>(count));
  for (std::uint64_t i = 0; i < count; ++i) ticks.push_back(detail::take_tick(cursor, version));
  return ticks;
}

}  // namespace trephine
