// SPDX-License-Identifier: MIT
#pragma once

#include <fstream>
#include <sstream>
#include <string>

namespace pick::test {

/// A file of this folder: code as the program prints it.
inline std::string printed(const std::string& name) {
  std::ifstream file(std::string(TREPHINE_PICK_TESTS "/") + name);
  std::ostringstream all;
  all << file.rdbuf();
  return all.str();
}

}  // namespace pick::test
