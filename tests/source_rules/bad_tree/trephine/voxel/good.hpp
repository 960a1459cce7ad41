// SPDX-License-Identifier: MIT
#pragma once
#include <trephine/core/good.hpp>

#include <Eigen/Core>
#include <vector>
