// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/named_tools.hpp>
#include <trephine/tool/shape.hpp>

#include <string>
#include <variant>

namespace trephine_python {

/// A tool with the name that makes it again.
struct PythonTool : trephine::NamedTool {
  std::string name;
};

/// A tool as Python hands it over.
using SceneTool = std::variant<trephine::Burr, PythonTool>;

}  // namespace trephine_python
