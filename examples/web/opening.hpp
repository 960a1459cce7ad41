// SPDX-License-Identifier: MIT
#pragma once

#include "../live/loaded.hpp"

#include <atomic>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace web {

/// Loads a bone on a thread of its own: a browser's main thread must not wait for seconds. Main thread.
class Opening {
 public:
  /// Tells how far it is.
  using Tell = std::function<void(const std::string& text)>;
  using Load = std::function<live::Loaded(const Tell& tell)>;

  explicit Opening(Load load)
      : thread_([this, load = std::move(load)] {
          try {
            loaded_.emplace(load([this](const std::string& text) { say(text); }));
          } catch (const std::exception& e) {
            refused_ = e.what();
          }
          done_.store(true, std::memory_order_release);
        }) {}
  ~Opening() { thread_.join(); }
  Opening(const Opening&) = delete;
  Opening& operator=(const Opening&) = delete;

  [[nodiscard]] bool done() const { return done_.load(std::memory_order_acquire); }
  [[nodiscard]] std::string text() const {
    const std::lock_guard lock(mutex_);
    return text_;
  }
  /// After `done`: what was loaded, or nothing, and then `refused` says why.
  [[nodiscard]] std::optional<live::Loaded>& loaded() { return loaded_; }
  [[nodiscard]] const std::string& refused() const { return refused_; }

 private:
  void say(const std::string& text) {
    const std::lock_guard lock(mutex_);
    text_ = text;
  }

  mutable std::mutex mutex_;
  std::string text_ = "makes the bone";
  std::optional<live::Loaded> loaded_;
  std::string refused_;
  std::atomic<bool> done_{false};
  std::thread thread_;
};

/// Opens a made bone: "tooth", or "temporal" with its structures. Throws std::invalid_argument for another name.
[[nodiscard]] Opening::Load made_bone(const std::string& kind, double margin);
/// Opens voxels of a scan, x fastest; lengths in metres.
[[nodiscard]] Opening::Load scanned_bone(std::string name, const trephine::GridGeometry& geometry,
                                         std::vector<std::int16_t> voxels, double isovalue);

}  // namespace web
