// SPDX-License-Identifier: MIT
#pragma once

#include "drive.hpp"

#include <trephine/sessions.hpp>

#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <span>
#include <stdexcept>
#include <string>

/// Files of sessions from a string of bytes: each is read, or refused in a sentence. Ends the process where that does
/// not hold, or where more comes out than went in.
namespace trephine::fuzz {

/// A file of this process' own.
inline const std::filesystem::path& session_path() {
  static const std::filesystem::path path =
      std::filesystem::temp_directory_path() / ("trephine_fuzz_" + std::to_string(std::random_device()()));
  static const int at_exit = std::atexit([] { std::filesystem::remove(path); });
  static_cast<void>(at_exit);
  return path;
}

inline void read_file(const std::string& bytes) {
  write_file(session_path(), "read_file", bytes);
  try {
    const Session session = load_session(session_path());
    require(session.ticks.size() <= bytes.size() && session.changes.size() <= bytes.size(), "records are of bytes");
  } catch (const std::runtime_error& refused) {
    require(std::string(refused.what()).rfind("trephine::", 0) == 0, "a refusal says who refuses");
  }
}

/// The bytes as a file; as the ticks of a recording of each version, and as a chunk of each version's log, of a bone if
/// the bytes say so, with hashes that are right.
inline void read_session(std::span<const std::uint8_t> data) {
  const std::string bytes(data.begin(), data.end());
  read_file(bytes);
  for (std::uint32_t version = 1; version <= recording_detail::kVersion; ++version) {
    const std::size_t a_tick = recording_detail::tick_bytes_of(version), ticks = bytes.size() / a_tick;
    std::string file(recording_detail::kMagic, sizeof(recording_detail::kMagic));
    for (const std::uint32_t word : {recording_detail::kByteOrder, version, static_cast<std::uint32_t>(a_tick), 0U})
      append_number(file, word);
    append_number(file, static_cast<std::uint64_t>(ticks));
    file += bytes.substr(0, ticks * a_tick);
    append_number(file, recording_detail::fnv1a(file));
    read_file(file);
  }
  for (std::uint32_t version = 1; version <= session_detail::kLogVersion; ++version) {
    std::string file = session_detail::log_head().substr(0, 12), chunk(session_detail::kChunkMark), records;
    append_number(file, version);
    file += session_detail::log_head().substr(16, 8);
    append_number(file, recording_detail::fnv1a(file));
    if (!bytes.empty() && (bytes.front() & 1) != 0) {
      records = "\x06";
      session_detail::put_bone(records, {.geometry = {.size = {20, 20, 9}, .spacing = Vec3d::Constant(1e-3)},
                                         .density = static_cast<DensityType>(bytes.front() >> 1 & 3)});
    }
    records += bytes;
    append_number(chunk, static_cast<std::uint32_t>(records.size()));
    append_number(chunk, std::uint64_t{0});
    chunk += records;
    append_number(chunk, recording_detail::fnv1a(chunk));
    read_file(file + chunk + bytes);
  }
}

}  // namespace trephine::fuzz
