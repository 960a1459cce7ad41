// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/status.hpp>

#include <pybind11/pybind11.h>

namespace pybind11::detail {

/// A status is a member of the package's IntEnum.
template <>
struct type_caster<trephine::Status> {
  PYBIND11_TYPE_CASTER(trephine::Status, const_name("Status"));
  bool load(handle, bool) { return false; }
  static handle cast(trephine::Status from, return_value_policy, handle) {
    return module_::import("trephine._trephine").attr("Status")(static_cast<int>(from)).release();
  }
};

}  // namespace pybind11::detail
