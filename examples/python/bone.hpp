// SPDX-License-Identifier: MIT
#pragma once

#include "bind.hpp"

#include <trephine/compiled/scene.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

namespace trephine_python {

/// The array that an object is, without a copy; a list is made one.
[[nodiscard]] inline py::array to_array(const char* who, const char* name, const py::object& from) {
  auto array = py::array::ensure(from);
  if (array) return array;
  PyErr_Clear();
  refuse(who, std::string(name) + " must be an array", std::string(py::repr(from)));
}

/// Shape (z, y, x) of an array of voxels as sizes along x, y, z. Throws std::invalid_argument for other dimensions.
[[nodiscard]] inline std::array<int, 3> size_of(const char* who, const py::array& voxels) {
  if (voxels.ndim() != 3) refuse(who, "voxels must have the shape (z, y, x)", shape_text(voxels));
  std::array<int, 3> size{};
  for (int a = 0; a < 3; ++a) {
    const py::ssize_t n = voxels.shape(2 - a);
    if (n < 1 || n > 1 << 20) refuse(who, "each side of voxels must be 1 to 2^20", shape_text(voxels));
    size[static_cast<std::size_t>(a)] = static_cast<int>(n);
  }
  return size;
}

/// Bone of any density type, with a mark that a call without Python's lock is at work on it. The lock guards the mark.
struct PythonBone {
  compiled::Bone bone;
  bool keeps_original = true;
  bool at_work = false;

  /// Throws std::runtime_error while another thread's call is at work on the bone.
  void require_idle() const {
    if (at_work)
      throw std::runtime_error("trephine: another thread runs a scene of this bone; only readers may be used");
  }
};
using BonePointer = std::shared_ptr<PythonBone>;

/// Marks a bone, a log or scores while a call is at work on them. Made and freed under Python's lock.
template <class Owned>
class Work {
 public:
  explicit Work(std::shared_ptr<Owned> owned) : owned_(std::move(owned)) {
    owned_->require_idle();
    owned_->at_work = true;
  }
  ~Work() { owned_->at_work = false; }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

 private:
  std::shared_ptr<Owned> owned_;
};

/// Calls `body` with a number of the bone's density type, and returns what it returns.
template <class Body>
auto with_density(compiled::DensityType type, Body&& body) {
  return with_density_type(type, [&]<class Density>(std::type_identity<Density>) { return body(Density{}); });
}

/// All voxels as a new array (z, y, x).
[[nodiscard]] inline py::array voxels_of(const compiled::Bone& bone) {
  const auto& n = bone.size();
  return with_density(bone.density_type(), [&]<class Density>(Density) -> py::array {
    py::array_t<Density> voxels({n[2], n[1], n[0]});
    bone.copy_voxels(std::span<Density>(voxels.mutable_data(), static_cast<std::size_t>(voxels.size())));
    return voxels;
  });
}

}  // namespace trephine_python
