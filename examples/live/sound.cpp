// SPDX-License-Identifier: MIT
#include "sound.hpp"

#ifdef TREPHINE_LIVE_HAS_OPENAL
#include <AL/al.h>
#include <AL/alc.h>

#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#endif

namespace live {

#ifdef TREPHINE_LIVE_HAS_OPENAL

struct Sound::Player {
  static constexpr std::size_t kPieces = 3, kSamples = DrillVoice::kRate / 200;  // 5 ms

  explicit Player(std::function<DrillState()> s) : state(std::move(s)) {
    device = alcOpenDevice(nullptr);
    if (device == nullptr) return;
    context = alcCreateContext(device, nullptr);
    if (context == nullptr) return;
    thread = std::thread([this] { play(); });
  }
  ~Player() {
    over.store(true);
    if (thread.joinable()) thread.join();
    if (context != nullptr) alcDestroyContext(context);
    if (device != nullptr) alcCloseDevice(device);
  }
  void play() {
    alcMakeContextCurrent(context);
    ALuint source = 0;
    std::array<ALuint, kPieces> buffers{};
    alGenSources(1, &source);
    alGenBuffers(kPieces, buffers.data());
    DrillVoice voice;
    std::array<std::int16_t, kSamples> samples{};
    const auto queue = [&](ALuint buffer) {
      voice.fill(samples, state());
      alBufferData(buffer, AL_FORMAT_MONO16, samples.data(), static_cast<ALsizei>(sizeof samples), DrillVoice::kRate);
      alSourceQueueBuffers(source, 1, &buffer);
    };
    for (const ALuint b : buffers) queue(b);
    while (!over.load()) {
      ALint done = 0, playing = 0;
      alGetSourcei(source, AL_BUFFERS_PROCESSED, &done);
      for (; done > 0; --done) {
        ALuint buffer = 0;
        alSourceUnqueueBuffers(source, 1, &buffer);
        queue(buffer);
      }
      // It stops by itself where the pieces came too late.
      alGetSourcei(source, AL_SOURCE_STATE, &playing);
      if (playing != AL_PLAYING) alSourcePlay(source);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    alDeleteSources(1, &source);
    alDeleteBuffers(kPieces, buffers.data());
    alcMakeContextCurrent(nullptr);
  }

  std::function<DrillState()> state;
  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  std::atomic<bool> over{false};
  std::thread thread;
};

Sound::Sound(std::function<DrillState()> state) : player_(std::make_unique<Player>(std::move(state))) {
  if (player_->context != nullptr)
    text_ = alcGetString(player_->device, ALC_DEVICE_SPECIFIER);
  else
    text_ = "none: no sound device";
}

#else

struct Sound::Player {};
Sound::Sound(std::function<DrillState()>) : text_("none: built without OpenAL (Debian: libopenal-dev)") {}

#endif

Sound::~Sound() = default;

}  // namespace live
