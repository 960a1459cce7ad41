// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/session/bone_records.hpp>
#include <trephine/session/followed_bone.hpp>
#include <trephine/session/record_queue.hpp>
#include <trephine/session/recorded_tick.hpp>
#include <trephine/session/tick_bytes.hpp>
#include <trephine/session/tick_deltas.hpp>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

/// The file of a SessionLog. A head: 8 bytes "TREPHLOG"; uint32 byte-order mark 0x01020304, uint32 version 2, uint32
/// version of its ticks (that of a recording), uint32 bytes a tick; uint64 FNV-1a hash of all this. Then chunks, each
/// on its own: uint32 mark "CHNK", uint32 bytes of its records, uint64 number from 0; the records; uint64 FNV-1a hash
/// of all this. A record begins with its kind in a byte:
/// 1, a tick, packed (`tick_deltas.hpp`); 2, another tool, with its number as int64; 3, an event, with its number as
/// int64; 4, dropped records, with their count as uint64 and the time of their ticks as double [s]; 5, the end, after
/// which nothing follows; 6, the bone that the log follows; 7, a brick of this bone that changed (`bone_records.hpp`).
/// Numbers have the writer's byte order, and a reader of the other order refuses the file.
///
/// Version 1 packs ticks otherwise and has no bone. Such files still load.
namespace trephine::inline TREPHINE_ALIGNED::session_detail {

inline constexpr std::string_view kLogMagic{"TREPHLOG", 8};
inline constexpr std::string_view kChunkMark{"CHNK", 4};
inline constexpr std::uint32_t kLogVersion = 2;
inline constexpr std::size_t kLogHeadBytes = 8 + 4 * 4 + 8;
inline constexpr std::size_t kChunkHeadBytes = 4 + 4 + 8;
inline constexpr std::size_t kHashBytes = 8;
/// [bytes] of records after which a chunk is full; a quarter of a second at 1 kHz is half of that.
inline constexpr std::size_t kFullChunk = std::size_t{1} << 16;
/// Records that are gathered before it is asked whether the chunk is full.
inline constexpr std::size_t kRecordsAtOnce = 16;
/// [bytes] of the largest tick, and of the count of dropped records before it.
inline constexpr std::size_t kLargestRecord = 1 + kLargestTick + 1 + 16;
/// [bytes] of records in a chunk at most: a reader takes no more memory for what a file says.
inline constexpr std::size_t kLargestChunk = kFullChunk + (kRecordsAtOnce + 1) * kLargestRecord + 1 + kBoneBytes;
static_assert(kFullChunk + 1 + kLargestBrick < kLargestChunk, "after each brick it is asked whether the chunk is full");

enum class FileRecord : std::uint8_t {
  kTick = 1,
  kTool = 2,
  kEvent = 3,
  kDropped = 4,
  kEnd = 5,
  kBone = 6,
  kBrick = 7
};

[[nodiscard]] inline std::string log_head() {
  std::string bytes(kLogMagic);
  append_number(bytes, recording_detail::kByteOrder);
  append_number(bytes, kLogVersion);
  append_number(bytes, recording_detail::kVersion);
  append_number(bytes, static_cast<std::uint32_t>(recording_detail::kTickBytes));
  append_number(bytes, recording_detail::fnv1a(bytes));
  return bytes;
}

/// Gathers records and makes chunks of them. It allocates: not for the haptic thread.
class ChunkWriter {
 public:
  void add(const detail::LogRecord& record) {
    add_dropped(record.dropped);
    if (record.kind == detail::LogRecord::Kind::kTick) {
      put(FileRecord::kTick);
      ticks_.pack(records_, record.tick);
    } else {
      put(record.kind == detail::LogRecord::Kind::kTool ? FileRecord::kTool : FileRecord::kEvent);
      append_number(records_, record.number);
    }
    ++count_;
  }
  /// Tells of records that were dropped since the last call; `dropped` counts from the start.
  void add_dropped(const DroppedRecords& dropped) {
    if (dropped.count == dropped_.count) return;
    put(FileRecord::kDropped);
    append_number(records_, dropped.count - dropped_.count);
    append_number(records_, dropped.time - dropped_.time);
    dropped_ = dropped;
  }
  void add_bone(const FollowedBone& bone) {
    put(FileRecord::kBone);
    put_bone(records_, bone);
  }
  /// A brick of `put_brick`.
  void add_brick(std::string_view brick) {
    put(FileRecord::kBrick);
    records_ += brick;
  }
  void add_end() { put(FileRecord::kEnd); }

  [[nodiscard]] bool is_empty() const noexcept { return records_.empty(); }
  [[nodiscard]] bool is_full() const noexcept { return records_.size() >= kFullChunk; }
  /// Ticks, tools and events that the next chunk will hold.
  [[nodiscard]] std::size_t count() const noexcept { return count_; }

  /// The bytes of a chunk with all records since the last; they live until the next call.
  [[nodiscard]] std::string_view take_chunk() {
    chunk_ = kChunkMark;
    append_number(chunk_, static_cast<std::uint32_t>(records_.size()));
    append_number(chunk_, number_++);
    chunk_ += records_;
    append_number(chunk_, recording_detail::fnv1a(chunk_));
    records_.clear();
    ticks_.restart();
    count_ = 0;
    return chunk_;
  }

 private:
  void put(FileRecord kind) { append_number(records_, static_cast<std::uint8_t>(kind)); }

  std::string records_, chunk_;
  TickPacker ticks_;
  DroppedRecords dropped_;
  std::uint64_t number_ = 0;
  std::size_t count_ = 0;
};

}  // namespace trephine
