// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/named_tools.hpp>
#include <trephine/tool/shape.hpp>

#include <variant>

namespace trephine_python {

/// A tool as Python hands it over.
using SceneTool = std::variant<trephine::Burr, trephine::NamedTool>;

}  // namespace trephine_python
