// SPDX-License-Identifier: MIT
#pragma once

#include <stdexcept>
#include <string>

struct GLFWwindow;

namespace live {

/// There is no display, or it has no OpenGL 3.3.
class NoDisplay : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// A window with an OpenGL 3.3 context, current on this thread. Main thread alone.
class Window {
 public:
  /// Throws NoDisplay. `debug`: errors of OpenGL are kept for `gl_errors`.
  Window(int width, int height, bool visible, bool debug);
  ~Window();
  Window(const Window&) = delete;
  Window& operator=(const Window&) = delete;

  [[nodiscard]] GLFWwindow* handle() const { return window_; }
  /// Returns errors and warnings that a debug context reported, a line each.
  [[nodiscard]] const std::string& gl_errors() const { return errors_; }
  /// Returns the driver's name.
  [[nodiscard]] std::string renderer() const;

 private:
  GLFWwindow* window_ = nullptr;
  std::string errors_;
};

}  // namespace live
