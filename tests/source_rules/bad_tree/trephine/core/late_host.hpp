// SPDX-License-Identifier: MIT
#pragma once
#include <vector>

#include <trephine/core/good.hpp>
