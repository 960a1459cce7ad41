// SPDX-License-Identifier: MIT
#include "screen.hpp"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>

namespace live {
namespace {

Screen& screen_of(GLFWwindow* window) { return *static_cast<Screen*>(glfwGetWindowUserPointer(window)); }

/// Dear ImGui's own font is small and of pixels; the system's is used where it has one of these.
void choose_font(float scale) {
  ImGui::GetIO().Fonts->Clear();
  constexpr std::array kFonts{"dejavu/DejaVuSans.ttf", "noto/NotoSans-Regular.ttf", "ubuntu/Ubuntu-R.ttf",
                              "liberation/LiberationSans-Regular.ttf", "liberation2/LiberationSans-Regular.ttf"};
  ImGuiIO& io = ImGui::GetIO();
  for (const char* font : kFonts) {
    const std::string path = std::string("/usr/share/fonts/truetype/") + font;
    if (!std::filesystem::exists(path)) continue;
    io.Fonts->AddFontFromFileTTF(path.c_str(), 15 * scale);
    return;
  }
  ImFontConfig config;
  config.SizePixels = 13 * scale;
  io.Fonts->AddFontDefault(&config);
}

}  // namespace

Screen::Screen(Window& window, Workbench& bench, bool by_hand) : window_(window), bench_(bench) {
  GLFWwindow* const w = window_.handle();
  glfwSetWindowUserPointer(w, this);
  if (by_hand) {
    glfwSetKeyCallback(w, [](GLFWwindow* h, int key, int, int action, int) {
      if (action == GLFW_PRESS) screen_of(h).press(key);
    });
    glfwSetMouseButtonCallback(
        w, [](GLFWwindow* h, int button, int action, int) { screen_of(h).on_button(button, action == GLFW_PRESS); });
    glfwSetCursorPosCallback(w, [](GLFWwindow* h, double x, double y) { screen_of(h).on_move(x, y); });
    glfwSetScrollCallback(w, [](GLFWwindow* h, double, double y) { screen_of(h).on_wheel(y); });
    glfwSetWindowFocusCallback(w, [](GLFWwindow* h, int focused) { screen_of(h).on_focus(focused == GLFW_TRUE); });
  }
  ImGui::CreateContext();
  ImGui::GetIO().IniFilename = nullptr;
  // The callbacks above come first and are called by Dear ImGui's.
  ImGui_ImplGlfw_InitForOpenGL(w, by_hand);
  ImGui_ImplOpenGL3_Init("#version 330");
  float x = 1, y = 1;
  glfwGetWindowContentScale(w, &x, &y);
  set_content_scale(x);
  // A window that moves to another monitor, or whose monitor is set up anew.
  glfwSetWindowContentScaleCallback(w,
                                    [](GLFWwindow* h, float scale, float) { screen_of(h).set_content_scale(scale); });
  read_size();
}

Screen::~Screen() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
  glfwSetWindowUserPointer(window_.handle(), nullptr);
}

void Screen::set_content_scale(float scale) {
  if (!(scale > 0)) return;
  choose_font(scale);
  ImGui_ImplOpenGL3_DestroyFontsTexture();
  ImGui_ImplOpenGL3_CreateFontsTexture();
  ImGui::GetStyle() = ImGuiStyle();
  ImGui::StyleColorsDark();
  ImGui::GetStyle().WindowRounding = 5;
  ImGui::GetStyle().ScaleAllSizes(scale);
}

void Screen::read_size() {
  glfwGetFramebufferSize(window_.handle(), &width_, &height_);
  int w = 0, h = 0;
  glfwGetWindowSize(window_.handle(), &w, &h);
  pixels_ = w > 0 ? static_cast<double>(width_) / w : 1;
}

bool Screen::shift() const {
  return glfwGetKey(window_.handle(), GLFW_KEY_LEFT_SHIFT) == GLFW_PRESS ||
         glfwGetKey(window_.handle(), GLFW_KEY_RIGHT_SHIFT) == GLFW_PRESS;
}
bool Screen::control() const {
  return glfwGetKey(window_.handle(), GLFW_KEY_LEFT_CONTROL) == GLFW_PRESS ||
         glfwGetKey(window_.handle(), GLFW_KEY_RIGHT_CONTROL) == GLFW_PRESS;
}

void Screen::press(int key) {
  if (ImGui::GetIO().WantTextInput) return;
  // The keypad and the unshifted key of a German or English keyboard mean the same.
  if (key == GLFW_KEY_KP_ADD) key = GLFW_KEY_EQUAL;
  if (key == GLFW_KEY_KP_SUBTRACT) key = GLFW_KEY_MINUS;
  Action action = action_of(key);
  if (action == Action::kNone) return;
  if (action == Action::kQuit) {
    if (instruments_.close_list()) return;
    if (bench_.help()) action = Action::kHelp;
  }
  bench_.act(action);
  pressed_.push_back(action);
}

void Screen::on_button(int button, bool down) {
  if (down && ImGui::GetIO().WantCaptureMouse) return;
  if (button == GLFW_MOUSE_BUTTON_LEFT) {
    if (down != left_ && follows_mouse_) bench_.hold_spindle(down);
    left_ = down;
  }
  if (button == GLFW_MOUSE_BUTTON_MIDDLE) middle_ = down;
  if (button == GLFW_MOUSE_BUTTON_RIGHT) right_ = down;
}

void Screen::on_move(double x, double y) {
  const Vec2d now = pixels_ * Vec2d(x, y), d = now - mouse_;
  mouse_ = now;
  // A window that opens under a resting mouse, or without it, is told of its place; the drill waits for a motion in it.
  if (!std::exchange(entered_, glfwGetWindowAttrib(window_.handle(), GLFW_HOVERED) == GLFW_TRUE)) return;
  if (follows_mouse_) bench_.mouse_at(now.x(), now.y());
  if (middle_) {
    if (shift())
      bench_.pan(d.x(), d.y());
    else
      bench_.orbit(d.x(), d.y());
    return;
  }
  if (!follows_mouse_ || (ImGui::GetIO().WantCaptureMouse && !left_ && !right_)) return;
  if (right_)
    bench_.push_drill(-kDragStep * d.y());
  else if (control())
    bench_.turn_drill(d.x(), d.y());
  else
    bench_.move_drill(now.x(), now.y());
}

void Screen::on_wheel(double notches) {
  if (ImGui::GetIO().WantCaptureMouse) return;
  if (shift())
    bench_.zoom(notches);
  else if (follows_mouse_)
    bench_.push_drill(kWheelStep * notches);
}

void Screen::on_focus(bool has) {
  // Without the focus no release of a button or key is heard: the spindle must not go on turning.
  if (has) return;
  left_ = middle_ = right_ = false;
  if (follows_mouse_) bench_.hold_spindle(false);
}

void Screen::frame(double dt, double time) {
  read_size();
  // A minimised window has no size; the drill goes on.
  if (width_ <= 0 || height_ <= 0) return bench_.update(dt, std::max(width_, 16), std::max(height_, 16));
  bench_.update(dt, width_, height_);
  (void)bench_.draw();
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  bench_.picture().present(width_, height_);
  draw_instruments(time);
  glfwSwapBuffers(window_.handle());
}

void Screen::lay_out_instruments(double time) {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  instruments_.draw(bench_, time);
  ImGui::Render();
}

void Screen::draw_instruments(double time) {
  lay_out_instruments(time);
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

std::vector<std::uint8_t> Screen::shot(double time) {
  read_size();
  if (width_ <= 0 || height_ <= 0) return {};
  bench_.update(0, width_, height_);
  bench_.draw_full();
  // Panels take their sizes from the frames before.
  for (int frame = 0; frame < 3; ++frame) lay_out_instruments(time);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
  bench_.picture().present(width_, height_);
  draw_instruments(time);
  glFinish();
  glReadBuffer(GL_BACK);
  return gl::read_pixels<std::uint8_t>(width_, height_, 3, GL_RGB, GL_UNSIGNED_BYTE);
}

}  // namespace live
