// SPDX-License-Identifier: MIT
#pragma once

/// The thesis' Line and Surface approximations.
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/tool/discretization.hpp>
