// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/file_bytes.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/throwing.hpp>
#include <trephine/session/bone_records.hpp>
#include <trephine/session/log_format.hpp>
#include <trephine/session/record_queue.hpp>
#include <trephine/session/recorded_tick.hpp>
#include <trephine/voxel/density_type.hpp>
#include <trephine/voxel/grid_reader.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <atomic>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Options of a SessionLog.
struct SessionLogOptions {
  std::size_t records = 16384;  ///< that may wait for the disk: 16 s at 1 kHz; about 450 bytes each
  double flush = 0.2;           ///< longest time between writes while the disk follows [s], 0.01 to 0.5

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    if (!(flush >= 0.01 && flush <= 0.5)) refuse("SessionLogOptions", "flush must be 0.01 to 0.5 s", flush);
  }
};

/// Writes a session to a file while it runs: ticks, changes of tool, and events with a number.
/// \code
/// SessionLog log("session.log");
/// loop.run_for(60s, log);  // an observer of the servo loop, as a Recorder is
/// log.close();
/// \endcode
/// The haptic thread adds records to a bounded queue, and a thread of the log writes them, so a disk that stalls never
/// holds up a tick. Records that find the queue full are dropped and counted, and the file says how many and where.
/// A chunk is written at least every `flush` seconds and handed to the operating system. If the process is killed, the
/// file lacks what was in the queue and in the unwritten chunk, and readers keep the rest (`visit_session`). A loss of
/// power may take what the system had not yet written.
///
/// A log that follows a bone also writes the voxels that changed, brick by brick, and costs the haptic thread nothing
/// for it: the log's thread reads the bone as a GridReader does, each `flush` seconds and at the end. Bricks therefore
/// come up to this much and the queue's delay after the ticks that cut them. Where in between a voxel changed is
/// unknown, and a brick that is read while it is cut holds voxels of several ticks until it is read again. After
/// `close` the bone in the file is the bone as it is. Its pose is that at the beginning.
///
/// Threads: `record`, `operator()`, `tool_changed` and `event` on a single thread, the haptic one; they are noexcept
/// and bounded, without memory, lock or clock. `dropped` and `failed` on any thread. Construction, `follow`, `close`
/// and destruction on any thread while no other uses the log; the last two wait for the disk.
class SessionLog {
 public:
  /// Takes the bytes of the file, in order; false if they cannot be written, after which nothing more is. It may wait.
  using Sink = std::function<bool(std::string_view bytes)>;

  /// Writes to the file `path`, which it replaces if it exists. Throws std::runtime_error if it cannot be written,
  /// std::invalid_argument if an option is out of range.
  explicit SessionLog(const std::filesystem::path& path, const SessionLogOptions& options = {})
      : options_(options), name_(path_text(path)), queue_(options.records) {
    options.validate();
    file_.open(path, std::ios::binary | std::ios::trunc);
    start([this](std::string_view bytes) {
      file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush();
      return file_.good();
    });
  }
  /// Writes to a sink instead, which the log's thread calls; the first time the constructor.
  explicit SessionLog(Sink sink, const SessionLogOptions& options = {})
      : options_(options), name_("a sink"), queue_(options.records) {
    options.validate();
    start(std::move(sink));
  }
  ~SessionLog() { end_thread(); }
  SessionLog(const SessionLog&) = delete;
  SessionLog& operator=(const SessionLog&) = delete;

  /// Follows the bone from now on: a VoxelGrid, or a compiled::Bone. Call it once, before the first tick, while the
  /// bone is at rest; it copies and hashes all densities. The bone must live, and must not be moved to another place in
  /// memory, until the log is closed. The isovalue is for readers. Throws std::invalid_argument if the log follows a
  /// bone already.
  template <VoxelDensity Density>
  void follow(const VoxelGrid<Density>& bone, std::optional<double> isovalue = {}) {
    follow_by<Density, GridReader<Density>>(bone, isovalue);
  }
  template <class Bone>
    requires requires(const Bone& bone) {
      typename Bone::Reader;
      { bone.density_type() } -> std::same_as<DensityType>;
    }
  void follow(const Bone& bone, std::optional<double> isovalue = {}) {
    with_density_type(bone.density_type(), [&]<class Density>(std::type_identity<Density>) {
      follow_by<Density, typename Bone::Reader>(bone, isovalue);
    });
  }

  /// Adds a tick.
  RecordStatus record(const TickInput& input, double dt, const TickResult& result) noexcept {
    return add(dt, [&](detail::LogRecord& to) {
      to.kind = detail::LogRecord::Kind::kTick;
      to.tick = {input, dt, result};
    });
  }
  /// For `ServoLoop` and `visit_session`: adds the tick that they observed.
  template <ObservedTick Tick>
  void operator()(const Tick& tick) noexcept {
    (void)record(tick.input, tick.dt, tick.result);
  }
  /// From the next tick on the tool with this number is in the hand.
  RecordStatus tool_changed(int tool) noexcept { return add_number(detail::LogRecord::Kind::kTool, tool); }
  /// Something happened that the program has a number for.
  RecordStatus event(std::int64_t number) noexcept { return add_number(detail::LogRecord::Kind::kEvent, number); }

  /// True if the queue has room for the next record. A program that is not bound to real time waits for it, and then
  /// drops nothing. The thread of `record`.
  [[nodiscard]] bool has_room() noexcept { return queue_.has_room(); }

  /// Records that are not in the file and will not be: dropped from a full queue, or lost with a failed disk.
  [[nodiscard]] std::uint64_t dropped() const noexcept {
    return queue_.dropped().count + unwritten_.load(std::memory_order_relaxed);
  }
  /// True once the disk has refused bytes, for instance because it is full: the file ends there.
  [[nodiscard]] bool failed() const noexcept { return failed_.load(std::memory_order_relaxed); }

  /// Writes all that is left and the end. Later records are dropped. Throws std::runtime_error if `failed()`.
  void close() {
    end_thread();
    if (failed())
      throw_error<std::runtime_error>("trephine::SessionLog: " + name_ +
                                      " could not be written to its end, which lacks " + std::to_string(dropped()) +
                                      " records");
  }

 private:
  static constexpr std::chrono::milliseconds kPoll{5};  // between looks at the queue: short beside the flush

  template <class Fill>
  RecordStatus add(double time, Fill&& fill) noexcept {
    return queue_.add(time, fill) ? RecordStatus::kOk : RecordStatus::kFull;
  }
  RecordStatus add_number(detail::LogRecord::Kind kind, std::int64_t number) noexcept {
    return add(0, [&](detail::LogRecord& to) {
      to.kind = kind;
      to.number = number;
    });
  }

  template <VoxelDensity Density, class Reader, class Bone>
  void follow_by(const Bone& bone, std::optional<double> isovalue) {
    if (follower_) refuse("SessionLog", "a log follows one bone", "a second one");
    follower_ = std::make_unique<session_detail::BoneFollowerOf<Density, Reader>>(bone, isovalue);
    follows_.store(true, std::memory_order_release);
  }

  void start(Sink sink) {
    sink_ = std::move(sink);
    if (!sink_(session_detail::log_head()))
      throw_error<std::runtime_error>("trephine::SessionLog: cannot write " + name_);
    thread_ = std::thread([this] { write_all(); });
  }

  void end_thread() noexcept {
    if (!thread_.joinable()) return;
    closing_.store(true, std::memory_order_release);
    thread_.join();
    file_.close();
  }

  /// The log's thread.
  void write_all() noexcept {
    using Clock = std::chrono::steady_clock;
    const std::chrono::duration<double> flush(options_.flush);
    Clock::time_point flushed = Clock::now();
    for (bool closing = false; !closing;) {
      closing = closing_.load(std::memory_order_acquire);
      while (take_records())
        if (chunks_.is_full()) write_chunk();
      if (closing || Clock::now() - flushed >= flush) {
        add_changes();  // after the ticks that made them
        write_chunk();
        flushed = Clock::now();
      }
      if (!closing) std::this_thread::sleep_for(kPoll);
    }
    guarded([this] {
      chunks_.add_dropped(queue_.dropped());
      chunks_.add_end();
    });
    write_chunk();
  }
  void add_changes() noexcept {
    guarded([this] {
      add_bone();
      if (!follows_bone_) return;
      follower_->take_changes([this](std::string_view brick) {
        chunks_.add_brick(brick);
        if (chunks_.is_full()) write_chunk();
      });
    });
  }
  /// The bone, once it is followed.
  void add_bone() {
    if (follows_bone_ || !follows_.load(std::memory_order_acquire)) return;
    follows_bone_ = true;
    chunks_.add_bone(follower_->bone());
  }
  /// Moves a few records to the chunk; false if there were none.
  bool take_records() noexcept {
    std::size_t taken = 0;
    guarded([&] {
      taken = queue_.take(session_detail::kRecordsAtOnce, [this](const detail::LogRecord& r) {
        add_bone();  // before ticks that came after it
        chunks_.add(r);
      });
    });
    return taken > 0;
  }
  void write_chunk() noexcept {
    if (chunks_.is_empty()) return;
    const std::size_t count = chunks_.count();
    guarded([this] {
      const std::string_view chunk = chunks_.take_chunk();
      if (!failed() && !sink_(chunk)) failed_.store(true, std::memory_order_relaxed);
    });
    if (failed()) unwritten_.fetch_add(count, std::memory_order_relaxed);
  }
  /// Memory may end and sinks may throw: then the file ends there, too.
  template <class Work>
  void guarded(const Work& work) noexcept {
    catch_all(work, [this] { failed_.store(true, std::memory_order_relaxed); });
  }

  SessionLogOptions options_;
  std::string name_;
  std::ofstream file_;
  Sink sink_;
  detail::RecordQueue queue_;
  session_detail::ChunkWriter chunks_;                      // the log's thread's
  bool follows_bone_ = false;                               // likewise
  std::unique_ptr<session_detail::BoneFollower> follower_;  // likewise, once `follows_` is set
  std::atomic<bool> follows_{false};
  std::atomic<bool> closing_{false};
  std::atomic<bool> failed_{false};
  std::atomic<std::uint64_t> unwritten_{0};
  std::thread thread_;
};

}  // namespace trephine
