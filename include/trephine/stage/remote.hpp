// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/members.hpp>

#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// A part whose options can be replaced between ticks. They are validated before, so `adopt` does not throw.
template <class T>
concept Tunable = requires(T t, const typename T::Options& options) {
  { t.adopt(options) } noexcept;
};

/// A wrapper of a stage, a renderer or a Cutting whose options another thread may change while the scene ticks:
/// \code
/// Mailbox<Damping::Options> knob{};
/// auto scene = HapticScene{bone, 300, renderer, Remote{Damping{{.linear = 1}}, knob}, limits};
/// knob.post({.linear = 2});  // another thread; takes effect at the start of the next tick
/// \endcode
/// The mailbox must outlive the scene. All options of a post take effect in the same tick.
template <Tunable T>
class Remote : public T {
 public:
  using Options = typename T::Options;

  Remote(T start, Mailbox<Options>& inbox) : T(std::move(start)), inbox_(&inbox) {}

  Remote(const Remote&) = default;
  Remote(Remote&&) = default;
  /// Takes options and state; each keeps its own mailbox.
  Remote& operator=(const Remote& other) {
    T::operator=(other);
    return *this;
  }

  void begin_tick() noexcept {
    member::begin_tick(static_cast<T&>(*this));
    if (const Options* latest = inbox_->take()) this->adopt(*latest);
  }

 private:
  Mailbox<Options>* inbox_;
};

template <class T>
Remote(T, Mailbox<typename T::Options>&) -> Remote<T>;

}  // namespace trephine
