// SPDX-License-Identifier: MIT
#pragma once

/// Structures of a segmentation, which a guard and cuts spare, or which are felt as membranes; tissues, guides and
/// planned cavities.
#include <trephine/guide/guides.hpp>
#include <trephine/guide/keep_in.hpp>
#include <trephine/structure/motion_barrier.hpp>
#include <trephine/structure/protection.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/structure/tissues.hpp>
