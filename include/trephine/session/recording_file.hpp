// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/throwing.hpp>
#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/tick_bytes.hpp>

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

/// Saves and loads recordings, so that a session on real hardware can be replayed elsewhere. Not for the haptic thread.
///
/// File format: 8 bytes "TREPHREC"; uint32 byte-order mark 0x01020304, uint32 version 3, uint32 bytes a tick, uint32 0;
/// uint64 ticks; the ticks (`tick_bytes.hpp`); uint64 FNV-1a hash of all preceding bytes. A reader of the other byte
/// order refuses the file.
///
/// Version 1 ends a tick before the structures, version 2 before the cutting. Such files still load, and what they lack
/// has the defaults.
namespace trephine::inline TREPHINE_ALIGNED {

namespace recording_detail {

inline constexpr char kMagic[8] = {'T', 'R', 'E', 'P', 'H', 'R', 'E', 'C'};
inline constexpr std::size_t kHeaderBytes = 32;

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
