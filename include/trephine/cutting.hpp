// SPDX-License-Identifier: MIT
#pragma once

/// Forces of cutting, their vibration and sound, cuts chosen at run time and by tissue.
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/cutting_sound.hpp>
#include <trephine/stage/cutting_vibration.hpp>
#include <trephine/stage/driven_by.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/voxel/any_cut.hpp>
#include <trephine/voxel/pressure_cut.hpp>
#include <trephine/voxel/tissue_cut.hpp>
