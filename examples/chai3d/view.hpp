// SPDX-License-Identifier: MIT
#pragma once

#include <display/CCamera.h>
#include <materials/CTexture3d.h>

#include <cstddef>
#include <memory>
#include <string>

namespace chai3d_host {

/// A window, or a hidden one, with OpenGL 2.1, in which CHAI3D draws; view_glfw.cpp has it by GLFW, and view_none.cpp
/// is for builds without. One thread makes, uses and deletes it, and deletes CHAI3D's world before.
class View {
 public:
  virtual ~View() = default;
  /// Draws what the camera sees. False after the user has closed the window.
  virtual bool draw(chai3d::cCamera& camera) = 0;
  /// Draws into a frame buffer of CHAI3D and saves it, as PNG or by another ending. False if it cannot.
  virtual bool save(chai3d::cCamera& camera, const std::string& file) = 0;
  /// Voxels of the drawn texture, as the graphics card has them, that are not the image's.
  virtual std::size_t differences(chai3d::cTexture3d& texture) = 0;
};

/// Throws std::runtime_error if there is no display, or no GLFW in this build.
std::unique_ptr<View> make_view(int width, int height, bool visible);

}  // namespace chai3d_host
