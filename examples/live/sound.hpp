// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/cutting_sound.hpp>

#include <memory>
#include <string>

namespace live {

/// Plays the drill on a thread of its own, where the build has OpenAL and the machine a sound device; silent elsewhere.
/// Three pieces of 5 ms wait to be played, so a change is heard after 15 ms and what the sound device adds.
class Sound {
 public:
  /// `heard` must outlive it: the haptic thread posts what the sound's thread plays.
  explicit Sound(trephine::Mailbox<trephine::CuttingSoundState>& heard);
  ~Sound();
  Sound(const Sound&) = delete;
  Sound& operator=(const Sound&) = delete;

  /// Returns the device's name, or why there is no sound.
  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  struct Player;
  std::unique_ptr<Player> player_;
  std::string text_;
};

}  // namespace live
