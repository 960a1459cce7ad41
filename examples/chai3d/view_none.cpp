// SPDX-License-Identifier: MIT
#include "view.hpp"

#include <stdexcept>

namespace chai3d_host {

std::unique_ptr<View> make_view(int, int, bool) {
  throw std::runtime_error("this build has no GLFW (Debian: libglfw3-dev), so it cannot draw: run it with --headless");
}

}  // namespace chai3d_host
