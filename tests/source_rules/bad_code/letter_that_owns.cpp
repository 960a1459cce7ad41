// SPDX-License-Identifier: MIT
// says: T must own nothing
#include <trephine/stage/mailbox.hpp>

#include <vector>

using namespace trephine;

Mailbox<std::vector<int>> box;
