// SPDX-License-Identifier: MIT
#pragma once

/// Every header but the compiled library and the adapters.
#include <trephine/cutting.hpp>
#include <trephine/devices.hpp>
#include <trephine/sessions.hpp>
#include <trephine/structures.hpp>
#include <trephine/thesis.hpp>
#include <trephine/tools.hpp>
#include <trephine/trephine.hpp>
#include <trephine/voxel/brick_mesh.hpp>
#include <trephine/voxel/convert.hpp>
#include <trephine/voxel/isovalue_warning.hpp>
#include <trephine/voxel/largest_piece.hpp>
#include <trephine/voxel/mesh_file.hpp>
#include <trephine/voxel/resample.hpp>
