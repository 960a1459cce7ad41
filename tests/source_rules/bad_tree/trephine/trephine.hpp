// SPDX-License-Identifier: MIT
#pragma once
#include <trephine/adapter/itk.hpp>
