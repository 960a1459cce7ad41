// SPDX-License-Identifier: MIT
#pragma once

/// The thesis' Line and Surface approximations: as the thesis writes them, and with our answers to what it leaves open.
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>
