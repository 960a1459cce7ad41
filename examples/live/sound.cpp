// SPDX-License-Identifier: MIT
#include "sound.hpp"

#include "heard_drill.hpp"

#ifdef TREPHINE_LIVE_HAS_OPENAL
#include <AL/al.h>
#include <AL/alc.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <thread>
#endif

namespace live {

#ifdef TREPHINE_LIVE_HAS_OPENAL

struct Sound::Player {
  static constexpr int kRate = 44100;                                // samples a second
  static constexpr std::size_t kPieces = 3, kSamples = kRate / 200;  // 5 ms

  explicit Player(trephine::Mailbox<trephine::CuttingSoundState>& heard) : sound(HeardDrill::kOptions, heard) {
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
    std::array<float, kSamples> signal{};
    std::array<std::int16_t, kSamples> samples{};
    const auto queue = [&](ALuint buffer) {
      sound.fill(signal, kRate);
      std::transform(signal.begin(), signal.end(), samples.begin(), [](float v) {
        return static_cast<std::int16_t>(std::lround(32767 * std::clamp(v, -1.0F, 1.0F)));
      });
      alBufferData(buffer, AL_FORMAT_MONO16, samples.data(), static_cast<ALsizei>(sizeof samples), kRate);
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

  trephine::CuttingSound sound;
  ALCdevice* device = nullptr;
  ALCcontext* context = nullptr;
  std::atomic<bool> over{false};
  std::thread thread;
};

Sound::Sound(trephine::Mailbox<trephine::CuttingSoundState>& heard) : player_(std::make_unique<Player>(heard)) {
  if (player_->context != nullptr)
    text_ = alcGetString(player_->device, ALC_DEVICE_SPECIFIER);
  else
    text_ = "none: no sound device";
}

#else

struct Sound::Player {};
Sound::Sound(trephine::Mailbox<trephine::CuttingSoundState>&)
    : text_("none: built without OpenAL (Debian: libopenal-dev)") {}

#endif

Sound::~Sound() = default;

}  // namespace live
