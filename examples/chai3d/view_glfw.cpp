// SPDX-License-Identifier: MIT
#include "view.hpp"

#include <display/CFrameBuffer.h>
#include <graphics/CMultiImage.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <stdexcept>
#include <vector>

namespace chai3d_host {
namespace {

class GlfwView : public View {
  static constexpr double kHiddenShare = 0.25;  // nobody looks, and Mesa's software renderer is slow

 public:
  GlfwView(int width, int height, bool visible) : width_(width), height_(height), visible_(visible) {
    if (glfwInit() == GLFW_FALSE) throw std::runtime_error("no display: " + last_error());
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 2);  // CHAI3D's shaders are of OpenGL 2.1
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 1);
    glfwWindowHint(GLFW_VISIBLE, visible ? GLFW_TRUE : GLFW_FALSE);
    window_ = glfwCreateWindow(width, height, "trephine in CHAI3D", nullptr, nullptr);
    if (window_ != nullptr) glfwMakeContextCurrent(window_);
    const std::string reason = window_ == nullptr ? last_error() : glewInit() != GLEW_OK ? "GLEW does not start" : "";
    if (reason.empty()) return;
    glfwTerminate();
    throw std::runtime_error("no OpenGL: " + reason);
  }
  ~GlfwView() override {
    frame_.reset();
    glfwTerminate();
  }
  GlfwView(const GlfwView&) = delete;
  GlfwView& operator=(const GlfwView&) = delete;

  bool draw(chai3d::cCamera& camera) override {
    if (!visible_) {
      draw_frame(camera, kHiddenShare);
      glFinish();  // no swap of buffers waits for the pictures, which else would queue up for seconds
      return true;
    }
    int width = 0, height = 0;
    glfwGetFramebufferSize(window_, &width, &height);
    camera.renderView(width, height);
    glfwSwapBuffers(window_);
    glfwPollEvents();
    return glfwWindowShouldClose(window_) == GLFW_FALSE;
  }

  bool save(chai3d::cCamera& camera, const std::string& file) override {
    draw_frame(camera, 1);
    const chai3d::cImagePtr picture = chai3d::cImage::create();
    frame_->copyImageBuffer(picture);
    return picture->convert(GL_RGB) && picture->saveToFile(file);
  }

  std::size_t differences(chai3d::cTexture3d& texture) override {
    const auto image = std::dynamic_pointer_cast<chai3d::cMultiImage>(texture.m_image);
    const std::size_t voxels = std::size_t{image->getWidth()} * image->getHeight() * image->getImageCount();
    std::vector<unsigned char> red(voxels);
    glBindTexture(GL_TEXTURE_3D, texture.getTextureId());
    glPixelStorei(GL_PACK_ALIGNMENT, 1);
    glGetTexImage(GL_TEXTURE_3D, 0, GL_RED, GL_UNSIGNED_BYTE, red.data());
    std::size_t count = 0;
    for (std::size_t i = 0; i < voxels; ++i) count += red[i] != image->getArray()[i];
    return count;
  }

 private:
  static std::string last_error() {
    const char* text = nullptr;
    glfwGetError(&text);
    return text != nullptr ? text : "no reason given";
  }

  /// Draws in `share` of the width and height.
  void draw_frame(chai3d::cCamera& camera, double share) {
    const auto width = static_cast<unsigned int>(share * width_), height = static_cast<unsigned int>(share * height_);
    if (!frame_) {
      frame_ = chai3d::cFrameBuffer::create();
      frame_->setup(&camera, width, height);
    }
    frame_->setSize(width, height);
    frame_->renderView();
  }

  int width_, height_;
  bool visible_;
  GLFWwindow* window_ = nullptr;
  chai3d::cFrameBufferPtr frame_;
};

}  // namespace

std::unique_ptr<View> make_view(int width, int height, bool visible) {
  return std::make_unique<GlfwView>(width, height, visible);
}

}  // namespace chai3d_host
