// SPDX-License-Identifier: MIT
#pragma once

#ifdef __EMSCRIPTEN__
#include <GLES3/gl3.h>
#else
// On Linux libGL exports the functions of OpenGL 3.3 themselves, so no loader is needed.
#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#endif

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

/// OpenGL objects that delete themselves. All of it belongs to the thread of the context.
namespace live::gl {

// What differs between OpenGL 3.3 of a window and OpenGL ES 3.0 of a page, whose textures filter no 16-bit integers.
#ifdef __EMSCRIPTEN__
/// What every shader's text begins with.
inline constexpr const char* kShaderHeader =
    "#version 300 es\nprecision highp float;\nprecision highp int;\nprecision highp sampler2D;\n"
    "precision highp sampler3D;\nprecision highp usampler3D;\n";
/// Textures of std::int16_t: formats of one and two channels, the type of their values, and which one a shader sees
/// as 1.
inline constexpr GLint kShort = GL_R16F, kTwoShorts = GL_RG16F;
inline constexpr GLenum kShortType = GL_HALF_FLOAT;
inline constexpr double kShortUnit = 1;
/// Makes values what the texture takes, in place: halves, which have 11 bits.
inline void to_texture(std::span<std::int16_t> values) {
  for (std::int16_t& v : values) {
    const auto bits = __builtin_bit_cast(std::uint32_t, static_cast<float>(v));
    const std::uint32_t rounded = bits + 0xfff + (bits >> 13 & 1), exponent = rounded >> 23 & 0xff;
    const std::uint32_t half = exponent < 113 ? 0 : (exponent - 112) << 10 | (rounded >> 13 & 0x3ff);
    v = static_cast<std::int16_t>(half | (bits >> 16 & 0x8000));
  }
}
inline void let_shaders_size_points(bool) {}  // they always do
/// Waits until all is drawn. A browser's own glFinish does not.
inline void finish() {
  std::array<std::uint8_t, 4> pixel{};
  glReadPixels(0, 0, 1, 1, GL_RGBA, GL_UNSIGNED_BYTE, pixel.data());
}
#else
inline constexpr const char* kShaderHeader = "#version 330 core\n";
inline constexpr GLint kShort = GL_R16_SNORM, kTwoShorts = GL_RG16_SNORM;
inline constexpr GLenum kShortType = GL_SHORT;
inline constexpr double kShortUnit = 32767;
inline void to_texture(std::span<std::int16_t>) {}
inline void finish() { glFinish(); }
inline void let_shaders_size_points(bool on) {
  on ? glEnable(GL_PROGRAM_POINT_SIZE) : glDisable(GL_PROGRAM_POINT_SIZE);
}
#endif

/// An object's name; `Delete` is called with it at the end.
template <void (*Delete)(GLuint)>
class Object {
 public:
  Object() = default;
  explicit Object(GLuint name) : name_(name) {}
  Object(Object&& other) noexcept : name_(std::exchange(other.name_, 0)) {}
  Object& operator=(Object&& other) noexcept {
    std::swap(name_, other.name_);
    return *this;
  }
  ~Object() {
    if (name_ != 0) Delete(name_);
  }
  [[nodiscard]] GLuint name() const noexcept { return name_; }

 private:
  GLuint name_ = 0;
};

inline void delete_texture(GLuint n) { glDeleteTextures(1, &n); }
inline void delete_framebuffer(GLuint n) { glDeleteFramebuffers(1, &n); }
inline void delete_vertex_array(GLuint n) { glDeleteVertexArrays(1, &n); }
inline void delete_buffer(GLuint n) { glDeleteBuffers(1, &n); }
inline void delete_program(GLuint n) { glDeleteProgram(n); }
using Texture = Object<delete_texture>;
using Framebuffer = Object<delete_framebuffer>;
using VertexArray = Object<delete_vertex_array>;
using Buffer = Object<delete_buffer>;
using Program = Object<delete_program>;

template <class Made>
[[nodiscard]] Made make(void (*generate)(GLsizei, GLuint*)) {
  GLuint name = 0;
  generate(1, &name);
  return Made(name);
}
[[nodiscard]] inline Texture make_texture() { return make<Texture>(glGenTextures); }
[[nodiscard]] inline Framebuffer make_framebuffer() { return make<Framebuffer>(glGenFramebuffers); }
[[nodiscard]] inline VertexArray make_vertex_array() { return make<VertexArray>(glGenVertexArrays); }
[[nodiscard]] inline Buffer make_buffer() { return make<Buffer>(glGenBuffers); }

/// Compiles and links; `defines` precede the fragment shader's text. Throws std::runtime_error with the driver's log.
[[nodiscard]] inline Program make_program(const char* vertex, const char* fragment, const char* defines = "") {
  Program program(glCreateProgram());
  const auto attach = [&](GLenum kind, const char* text) {
    const GLuint shader = glCreateShader(kind);
    const std::array<const char*, 3> parts{kShaderHeader, kind == GL_FRAGMENT_SHADER ? defines : "", text};
    glShaderSource(shader, static_cast<GLsizei>(parts.size()), parts.data(), nullptr);
    glCompileShader(shader);
    GLint ok = 0;
    glGetShaderiv(shader, GL_COMPILE_STATUS, &ok);
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetShaderInfoLog(shader, static_cast<GLsizei>(log.size()), &length, log.data());
    glAttachShader(program.name(), shader);
    glDeleteShader(shader);
    if (ok == 0)
      throw std::runtime_error("a shader does not compile: " + log.substr(0, static_cast<std::size_t>(length)));
  };
  attach(GL_VERTEX_SHADER, vertex);
  attach(GL_FRAGMENT_SHADER, fragment);
  glLinkProgram(program.name());
  GLint ok = 0;
  glGetProgramiv(program.name(), GL_LINK_STATUS, &ok);
  if (ok == 0) {
    std::string log(4096, '\0');
    GLsizei length = 0;
    glGetProgramInfoLog(program.name(), static_cast<GLsizei>(log.size()), &length, log.data());
    throw std::runtime_error("the shaders do not link: " + log.substr(0, static_cast<std::size_t>(length)));
  }
  return program;
}

/// Reads the framebuffer in use, `channels` values a pixel, top row first.
template <class Value>
[[nodiscard]] std::vector<Value> read_pixels(int width, int height, std::size_t channels, GLenum format, GLenum type) {
  const std::size_t row = channels * static_cast<std::size_t>(width), rows = static_cast<std::size_t>(height);
  std::vector<Value> bottom_up(row * rows), out(row * rows);
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, format, type, bottom_up.data());
  for (std::size_t y = 0; y < rows; ++y)
    std::copy_n(bottom_up.data() + (rows - 1 - y) * row, row, out.data() + y * row);
  return out;
}

/// A texture to draw into, with a depth texture if asked.
struct Target {
  int width = 0, height = 0;
  Texture colour, depth;
  Framebuffer framebuffer;

  /// Does nothing where it has that size already. Throws std::runtime_error where the driver refuses.
  void resize(int w, int h, GLint format, GLenum type, bool with_depth) {
    if (w == width && h == height) return;
    width = w;
    height = h;
    colour = make_texture();
    glBindTexture(GL_TEXTURE_2D, colour.name());
    glTexImage2D(GL_TEXTURE_2D, 0, format, w, h, 0, GL_RGBA, type, nullptr);
    for (const auto p : std::initializer_list<GLenum>{GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      glTexParameteri(GL_TEXTURE_2D, p, GL_LINEAR);
    for (const auto p : std::initializer_list<GLenum>{GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
      glTexParameteri(GL_TEXTURE_2D, p, GL_CLAMP_TO_EDGE);
    framebuffer = make_framebuffer();
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer.name());
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, colour.name(), 0);
    if (with_depth) {
      depth = make_texture();
      glBindTexture(GL_TEXTURE_2D, depth.name());
      glTexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, w, h, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
      for (const auto p : std::initializer_list<GLenum>{GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
        glTexParameteri(GL_TEXTURE_2D, p, GL_NEAREST);
      glFramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
    }
    if (glCheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("OpenGL cannot draw into a texture of " + std::to_string(w) + " x " + std::to_string(h));
  }
};

}  // namespace live::gl
