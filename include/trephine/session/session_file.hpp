// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/throwing.hpp>
#include <trephine/session/bone_records.hpp>
#include <trephine/session/followed_bone.hpp>
#include <trephine/session/log_format.hpp>
#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/session/tick_bytes.hpp>
#include <trephine/session/tick_deltas.hpp>

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// What a file of a session held, and what it lacks.
struct SessionReport {
  std::uint64_t ticks = 0;
  DroppedRecords dropped;        ///< in the session, because the disk did not follow
  std::uint64_t lost_bytes = 0;  ///< at the file's end, from the first chunk that is incomplete or damaged
  bool complete = false;         ///< the session was closed: nothing is missing at the end

  /// One sentence, in English.
  [[nodiscard]] std::string text() const {
    std::string s = std::to_string(ticks) + " ticks";
    if (dropped.count > 0) s += ", " + std::to_string(dropped.count) + " records dropped while the disk stalled";
    if (lost_bytes > 0) s += ", " + std::to_string(lost_bytes) + " bytes at the end are damaged or incomplete";
    return s + (complete ? "" : ", the session was not closed");
  }
};

namespace session_detail {

/// Reads a SessionLog's file chunk by chunk, in little memory.
class LogReader {
 public:
  LogReader(std::ifstream& in, const std::filesystem::path& path) : in_(in), path_(path) {
    in_.seekg(0, std::ios::end);
    const std::streamoff size = in_.tellg();
    if (size < 0) fail("cannot be read");
    size_ = static_cast<std::uint64_t>(size);
    in_.seekg(0);
    std::string head(kLogHeadBytes, '\0');
    if (size_ < head.size() || !read(head.data(), head.size()))
      fail("too short for a session (" + std::to_string(size_) + " bytes)");
    recording_detail::Cursor cursor(head.data() + kLogMagic.size());
    if (cursor.take<std::uint32_t>() != recording_detail::kByteOrder)
      fail("was written on a machine of the other byte order");
    version_ = cursor.take<std::uint32_t>();
    if (version_ < 1 || version_ > kLogVersion)
      fail("has version " + std::to_string(version_) + ", this reads 1 to " + std::to_string(kLogVersion));
    const auto tick_version = cursor.take<std::uint32_t>();
    const auto tick_bytes = cursor.take<std::uint32_t>();
    if (tick_version != recording_detail::kVersion || tick_bytes != recording_detail::kTickBytes)
      fail("has ticks of version " + std::to_string(tick_version) + " and " + std::to_string(tick_bytes) + " bytes");
    if (cursor.take<std::uint64_t>() != recording_detail::fnv1a({head.data(), head.size() - kHashBytes}))
      fail("is damaged (hash of its head differs)");
    good_ = head.size();
  }

  /// Returns the records of the next chunk; empty at the end of the file or of what is whole.
  [[nodiscard]] std::string_view next() {
    const std::uint64_t left = size_ - good_;
    if (left < kChunkHeadBytes + kHashBytes) return {};
    chunk_.resize(kChunkHeadBytes);
    if (!read(chunk_.data(), kChunkHeadBytes) || !std::string_view(chunk_).starts_with(kChunkMark)) return {};
    recording_detail::Cursor cursor(chunk_.data() + kChunkMark.size());
    const auto length = static_cast<std::size_t>(cursor.take<std::uint32_t>());
    if (length == 0 || length > kLargestChunk || left - kChunkHeadBytes - kHashBytes < length) return {};
    if (cursor.take<std::uint64_t>() != number_) return {};
    chunk_.resize(kChunkHeadBytes + length + kHashBytes);
    if (!read(chunk_.data() + kChunkHeadBytes, length + kHashBytes)) return {};
    recording_detail::Cursor hash(chunk_.data() + kChunkHeadBytes + length);
    if (hash.take<std::uint64_t>() != recording_detail::fnv1a({chunk_.data(), kChunkHeadBytes + length})) return {};
    ++number_;
    good_ += chunk_.size();
    return std::string_view(chunk_).substr(kChunkHeadBytes, length);
  }

  [[nodiscard]] std::uint32_t version() const noexcept { return version_; }
  /// Bytes that `next` has not given.
  [[nodiscard]] std::uint64_t left() const noexcept { return size_ - good_; }

  [[noreturn]] void fail(const std::string& what) const {
    throw_error<std::runtime_error>("trephine::visit_session: " + path_text(path_) + ": " + what);
  }

 private:
  [[nodiscard]] bool read(char* to, std::size_t count) {
    return static_cast<bool>(in_.read(to, static_cast<std::streamsize>(count)));
  }

  std::ifstream& in_;
  const std::filesystem::path& path_;
  std::uint32_t version_ = 0;
  std::uint64_t size_ = 0, good_ = 0, number_ = 0;
  std::string chunk_;
};

/// Hands records to a visitor, chunk by chunk.
template <class Visitor>
class RecordReader {
 public:
  RecordReader(std::uint32_t version, Visitor& visitor, SessionReport& report)
      : version_(version), visitor_(visitor), report_(report) {}

  /// Reads a chunk. Returns false if it has records that are none.
  [[nodiscard]] bool read(std::string_view records) {
    ticks_.restart();
    before_ = {};
    while (!records.empty()) {
      const auto kind = static_cast<FileRecord>(records.front());
      records.remove_prefix(1);
      if (report_.complete) return false;  // after the end
      if (!read_record(kind, records)) return false;
    }
    return true;
  }

 private:
  bool read_record(FileRecord kind, std::string_view& in) {
    switch (kind) {
      case FileRecord::kTick:
        if (!(version_ == 1 ? unpack_tick_1(in, before_, tick_) : ticks_.unpack(in, tick_))) return false;
        ++report_.ticks;
        visitor_(static_cast<const RecordedTick&>(tick_));
        return true;
      case FileRecord::kTool: {
        std::int64_t tool = 0;
        if (!take(in, tool) || !std::in_range<int>(tool)) return false;
        if constexpr (requires { visitor_.tool_changed(1); }) visitor_.tool_changed(static_cast<int>(tool));
        return true;
      }
      case FileRecord::kEvent: {
        std::int64_t number = 0;
        if (!take(in, number)) return false;
        if constexpr (requires { visitor_.event(number); }) visitor_.event(number);
        return true;
      }
      case FileRecord::kDropped: {
        DroppedRecords dropped;
        if (!take(in, dropped.count) || !take(in, dropped.time)) return false;
        report_.dropped.count += dropped.count;
        report_.dropped.time += dropped.time;
        if constexpr (requires { visitor_.dropped(dropped); }) visitor_.dropped(dropped);
        return true;
      }
      case FileRecord::kEnd:
        return report_.complete = true;
      case FileRecord::kBone:
        if (bone_ || !(bone_ = take_bone(in))) return false;
        if constexpr (requires { visitor_.geometry(*bone_); }) visitor_.geometry(std::as_const(*bone_));
        return true;
      case FileRecord::kBrick:
        if (!bone_ || !take_brick(in, *bone_, change_)) return false;
        if constexpr (requires { visitor_.brick(change_); }) visitor_.brick(std::as_const(change_));
        return true;
    }
    return false;
  }
  template <class Number>
  [[nodiscard]] static bool take(std::string_view& in, Number& number) {
    if (in.size() < sizeof(Number)) return false;
    number = recording_detail::Cursor(in.data()).take<Number>();
    in.remove_prefix(sizeof(Number));
    return true;
  }

  std::uint32_t version_;
  Visitor& visitor_;
  SessionReport& report_;
  TickPacker ticks_;
  TickWords before_{};  // of version 1
  RecordedTick tick_;
  std::optional<FollowedBone> bone_;
  BrickChange change_;
};

}  // namespace session_detail

/// Reads the file of a SessionLog, or a recording of any version, and calls `visitor(const RecordedTick&)` for each
/// tick. Where the visitor has them, it also calls `tool_changed(int)`, `event(std::int64_t)`,
/// `dropped(DroppedRecords)`, `geometry(const FollowedBone&)` and `brick(const BrickChange&)`, in the order of the
/// file. So `Scores` is a visitor, and a SessionLog is one, which leaves out the bone.
///
/// A log is read chunk by chunk in a few hundred kilobytes, up to the first chunk that is incomplete or damaged; the
/// report says how much is left. Throws std::runtime_error with path and reason if the file is missing, is neither log
/// nor recording, has another version or byte order, or has whole chunks with records that are none. What came before
/// has then been visited. A recording is loaded as a whole (`load_recording`). Not for the haptic thread.
template <class Visitor>
SessionReport visit_session(const std::filesystem::path& path, Visitor&& visitor) {
  std::ifstream in(path, std::ios::binary);
  SessionReport report;
  const auto fail = [&path](const std::string& what) {
    throw_error<std::runtime_error>("trephine::visit_session: " + path_text(path) + ": " + what);
  };
  if (!in) fail("cannot be opened");
  char magic[8] = {};
  in.read(magic, sizeof(magic));
  if (std::memcmp(magic, recording_detail::kMagic, sizeof(magic)) == 0) {
    in.close();
    for (const RecordedTick& tick : load_recording(path)) {
      visitor(tick);
      ++report.ticks;
    }
    report.complete = true;
    return report;
  }
  if (std::string_view(magic, sizeof(magic)) != session_detail::kLogMagic) fail("is no trephine session or recording");
  in.clear();
  session_detail::LogReader reader(in, path);
  session_detail::RecordReader records(reader.version(), visitor, report);
  while (!report.complete) {
    const std::string_view chunk = reader.next();
    if (chunk.empty()) break;
    if (!records.read(chunk)) reader.fail("has a chunk of records that are none");
  }
  report.lost_bytes = reader.left();
  return report;
}

/// A session in memory. Positions count the ticks before a record.
struct Session {
  struct Numbered {
    std::size_t position = 0;
    std::int64_t number = 0;
  };
  struct Gap {
    std::size_t position = 0;
    DroppedRecords dropped;
  };
  struct Change {
    std::size_t position = 0;  ///< all that changed came before, and the log read it somewhat later
    BrickChange brick;
  };
  std::vector<RecordedTick> ticks;
  std::vector<Numbered> tools, events;
  std::vector<Gap> gaps;
  std::optional<FollowedBone> bone;  ///< none unless the log followed it
  std::vector<Change> changes;       ///< of this bone (`apply_change`)
  SessionReport report;
};

/// Reads all of a session, about 400 bytes a tick and 8 a changed voxel. Throws as `visit_session` does.
[[nodiscard]] inline Session load_session(const std::filesystem::path& path) {
  struct Collector {
    Session session;
    void operator()(const RecordedTick& tick) { session.ticks.push_back(tick); }
    void tool_changed(int tool) { session.tools.push_back({session.ticks.size(), tool}); }
    void event(std::int64_t number) { session.events.push_back({session.ticks.size(), number}); }
    void dropped(const DroppedRecords& dropped) { session.gaps.push_back({session.ticks.size(), dropped}); }
    void geometry(const FollowedBone& bone) { session.bone = bone; }
    void brick(const BrickChange& change) { session.changes.push_back({session.ticks.size(), change}); }
  } collector;
  collector.session.report = visit_session(path, collector);
  return std::move(collector.session);
}

}  // namespace trephine
