// SPDX-License-Identifier: MIT
#include "window.hpp"

#include "gl.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <algorithm>
#include <cstdlib>
#include <thread>

namespace live {
namespace {

void APIENTRY on_gl_message(GLenum, GLenum type, GLuint, GLenum severity, GLsizei length, const GLchar* text,
                            const void* user) {
  if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR && severity != GL_DEBUG_SEVERITY_HIGH)
    return;
  auto& errors = *static_cast<std::string*>(const_cast<void*>(user));
  if (errors.size() < 4096) errors.append(text, static_cast<std::size_t>(length)).append("\n");
}

std::string last_glfw_error() {
  const char* text = nullptr;
  glfwGetError(&text);
  return text != nullptr ? text : "no reason given";
}

}  // namespace

Window::Window(int width, int height, bool visible, bool debug) {
  // Mesa's software renderer takes all processors; one belongs to the haptic thread.
  const unsigned processors = std::thread::hardware_concurrency();
  if (processors > 1) setenv("LP_NUM_THREADS", std::to_string(std::min(processors - 1, 8U)).c_str(), 0);
  if (glfwInit() == GLFW_FALSE) throw NoDisplay("no display: " + last_glfw_error());
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_VISIBLE, visible ? GLFW_TRUE : GLFW_FALSE);
  glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, debug ? GLFW_TRUE : GLFW_FALSE);
  window_ = glfwCreateWindow(width, height, "trephine: drill with your own hand", nullptr, nullptr);
  if (window_ == nullptr) {
    const std::string reason = last_glfw_error();
    glfwTerminate();
    throw NoDisplay("no window with OpenGL 3.3: " + reason);
  }
  glfwMakeContextCurrent(window_);
  glfwSwapInterval(1);
  GLint flags = 0;
  glGetIntegerv(GL_CONTEXT_FLAGS, &flags);
  // The extension came with OpenGL 4.3; a 3.3 context of Mesa has it all the same.
  if (debug && (flags & GL_CONTEXT_FLAG_DEBUG_BIT) != 0 && glfwExtensionSupported("GL_KHR_debug") == GLFW_TRUE) {
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(on_gl_message, &errors_);
  }
}

Window::~Window() {
  glfwDestroyWindow(window_);
  glfwTerminate();
}

std::string Window::renderer() const { return reinterpret_cast<const char*>(glGetString(GL_RENDERER)); }

}  // namespace live
