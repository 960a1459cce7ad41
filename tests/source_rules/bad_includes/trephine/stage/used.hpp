// SPDX-License-Identifier: MIT
#pragma once
#include <trephine/core/length.hpp>
struct Used : Length {};
