// SPDX-License-Identifier: MIT
#pragma once
#include <Eigen/Core>
#include <trephine/core/good.hpp>
#include <vector>
