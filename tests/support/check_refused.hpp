// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

namespace trephine::test {

/// Checks that `body` throws std::invalid_argument, whose message names `word`.
template <class Body>
void check_refused(const std::string& word, Body&& body) {
  CAPTURE(word);
  try {
    body();
    FAIL("nothing was thrown");
  } catch (const std::invalid_argument& e) {
    CHECK(std::string(e.what()).find(word) != std::string::npos);
  }
}

}  // namespace trephine::test
