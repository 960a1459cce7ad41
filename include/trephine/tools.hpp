// SPDX-License-Identifier: MIT
#pragma once

/// Tools and motors by name, tools by their shapes, and by any outline.
#include <trephine/tool/any_tool.hpp>
#include <trephine/tool/motors.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/revolved_vertices.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>
