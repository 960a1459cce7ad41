// SPDX-License-Identifier: MIT
#pragma once

#include "trephine_c.h"

#include <trephine/core/math.hpp>
#include <trephine/core/tolerances.hpp>

#include <cstddef>
#include <cstdio>
#include <cstring>
#include <new>
#include <sstream>
#include <stdexcept>
#include <type_traits>

/// The border between C and C++: no exception crosses it, and structs of older callers are read as far as they go.
namespace trephine_c {

struct NullArgument {};

struct WrongStruct {
  std::size_t got;
  std::size_t least;
  std::size_t most;
};

/// Of the calling thread. In place, so that running out of memory can be told too.
inline char* last_error() noexcept {
  thread_local char text[512] = "";
  return text;
}

/// Throws std::invalid_argument with the words strung together.
template <class... Words>
[[noreturn]] void fail(const Words&... words) {
  std::ostringstream text;
  (text << ... << words);
  throw std::invalid_argument(text.str());
}
template <class... Words>
void require(bool holds, const Words&... words) {
  if (!holds) fail(words...);
}
template <class... Pointer>
void require_pointers(const Pointer*... pointer) {
  if ((!pointer || ...)) throw NullArgument{};
}

/// Runs `body`; what it throws becomes a code and a message.
template <class Body>
trephine_result guarded(Body&& body) noexcept {
  const auto note = [](trephine_result code, const char* what) {
    std::snprintf(last_error(), 512, "%s", what);
    return code;
  };
  try {
    body();
    return TREPHINE_OK;
  } catch (const NullArgument&) {
    return note(TREPHINE_NULL_ARGUMENT, "trephine: a handle or pointer is null");
  } catch (const WrongStruct& e) {
    std::snprintf(
        last_error(), 512,
        "trephine: struct_size is %zu and this library knows %zu to %zu: call the struct's init function, and "
        "use a library that is not older than the header",
        e.got, e.least, e.most);
    return TREPHINE_WRONG_STRUCT;
  } catch (const std::bad_alloc&) {
    return note(TREPHINE_OUT_OF_MEMORY, "trephine: out of memory");
  } catch (const std::invalid_argument& e) {
    return note(TREPHINE_INVALID_ARGUMENT, e.what());
  } catch (const std::exception& e) {
    return note(TREPHINE_INTERNAL_ERROR, e.what());
  } catch (...) {
    return note(TREPHINE_INTERNAL_ERROR, "trephine: unknown error");
  }
}

/// Size of the struct in its first release; fields are only ever added at the end.
template <class Struct>
inline constexpr std::size_t kFirstSize = sizeof(Struct);
/// Without what the coupled tool brought along.
template <>
inline constexpr std::size_t kFirstSize<trephine_scene_options> =
    offsetof(trephine_scene_options, rotational_stiffness);

/// Without structures.
template <>
inline constexpr std::size_t kFirstSize<trephine_tick_result> = offsetof(trephine_tick_result, nearest);

template <class Struct>
void check_size(std::size_t size) {
  static_assert(std::is_trivially_copyable_v<Struct> && offsetof(Struct, struct_size) == 0);
  if (size < kFirstSize<Struct> || size > sizeof(Struct)) throw WrongStruct{size, kFirstSize<Struct>, sizeof(Struct)};
}
template <class Struct>
void check_struct(const Struct& s) {
  check_size<Struct>(s.struct_size);
}

template <class Struct>
void init_struct(Struct* to, std::size_t size, const Struct& defaults) {
  require_pointers(to);
  check_size<Struct>(size);
  std::memcpy(to, &defaults, size);
  to->struct_size = static_cast<std::uint32_t>(size);
}
/// What the caller's version of the struct does not have keeps its default.
template <class Struct>
[[nodiscard]] Struct read_struct(const Struct& from, Struct defaults) {
  check_struct(from);
  std::memcpy(&defaults, &from, from.struct_size);
  return defaults;
}
template <class Struct>
void write_struct(const Struct& from, Struct& to) {
  const std::uint32_t size = to.struct_size;
  std::memcpy(&to, &from, size);
  to.struct_size = size;
}

/// False where it is no pose; then X is as it was.
[[nodiscard]] inline bool to_pose(const trephine_pose& pose, trephine::Posed& X) noexcept {
  const auto& [p, q] = pose;
  const Eigen::Vector4d xyzw(q[0], q[1], q[2], q[3]);
  const double length = xyzw.norm();
  if (!(std::abs(length - 1) <= trephine::kRotationTolerance)) return false;
  X = trephine::make_pose<double>(trephine::Quatd(Eigen::Vector4d(xyzw / length)).toRotationMatrix(),
                                  trephine::Vec3d(p[0], p[1], p[2]));
  return true;
}
[[nodiscard]] inline trephine::Posed checked_pose(const trephine_pose& pose) {
  trephine::Posed X = trephine::Posed::Identity();
  require(to_pose(pose, X), "trephine_pose: the rotation must be a quaternion of length 1");
  return X;
}
[[nodiscard]] inline trephine_pose from_pose(const trephine::Posed& X) noexcept {
  const trephine::Quatd q = trephine::Quatd(trephine::Mat3d(X.linear())).normalized();
  const auto& p = X.translation();
  return {{p.x(), p.y(), p.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

}  // namespace trephine_c
