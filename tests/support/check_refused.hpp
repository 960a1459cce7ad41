// SPDX-License-Identifier: MIT
#pragma once

#include <doctest/doctest.h>

#include <stdexcept>
#include <string>

namespace trephine::test {

/// The message of the std::invalid_argument that `body` throws, or "" if there is none.
template <class Body>
[[nodiscard]] std::string refusal(Body&& body) {
  try {
    body();
  } catch (const std::invalid_argument& e) {
    return e.what();
  }
  return "";
}

/// Checks that `body` throws std::invalid_argument, whose message names `word`.
template <class Body>
void check_refused(const std::string& word, Body&& body) {
  const std::string said = refusal(body);
  CAPTURE(word);
  CAPTURE(said);
  CHECK(said.find(word) != std::string::npos);
}

}  // namespace trephine::test
