// SPDX-License-Identifier: MIT
// All headers here, one in the other units: what is not inline in that one is then defined twice.
#include <trephine/everything.hpp>
