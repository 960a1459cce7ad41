// SPDX-License-Identifier: MIT
#pragma once
#include <trephine/voxel/good.hpp>
