#include "client/displays/window/panel/gui/style.h"

#include <imgui.h>

#include <cmath>
#include <filesystem>

namespace telesplat::viewer {
namespace {

constexpr const char* kFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";  // Debian's fonts-dejavu-core
constexpr double kLetters = 15, kOwnLetters = 13;  // height in pixels at scale 1; kOwnLetters: for ImGui's own font

ImVec4 grey(float value, float alpha = 1) { return {value, value * 1.04f, value * 1.1f, alpha}; }

// Text has a contrast of 12:1 to the ground; selections are of a blue that all people can tell from grey.
void set_colours(ImGuiStyle& style) {
  ImGui::StyleColorsDark(&style);
  const ImVec4 accent(0.0f, 0.447f, 0.698f, 1), bright(0.337f, 0.706f, 0.914f, 1);  // Okabe and Ito's blues
  auto* c = style.Colors;
  c[ImGuiCol_WindowBg] = grey(0.09f);
  c[ImGuiCol_PopupBg] = grey(0.11f);
  c[ImGuiCol_Border] = grey(0.32f);
  c[ImGuiCol_FrameBg] = grey(0.2f);
  c[ImGuiCol_FrameBgHovered] = grey(0.27f);
  c[ImGuiCol_FrameBgActive] = grey(0.33f);
  c[ImGuiCol_TitleBg] = c[ImGuiCol_TitleBgActive] = c[ImGuiCol_TitleBgCollapsed] = grey(0.14f);
  c[ImGuiCol_Text] = grey(0.9f);
  c[ImGuiCol_TextDisabled] = grey(0.62f);
  c[ImGuiCol_Header] = grey(0.17f);
  c[ImGuiCol_HeaderHovered] = c[ImGuiCol_ButtonHovered] = accent;
  c[ImGuiCol_HeaderActive] = c[ImGuiCol_ButtonActive] = accent;
  c[ImGuiCol_Button] = grey(0.26f);
  c[ImGuiCol_CheckMark] = c[ImGuiCol_SliderGrab] = bright;
  c[ImGuiCol_SliderGrabActive] = grey(0.95f);
}

}  // namespace

bool GuiStyle::fit(double scale, double pixels_a_unit) {
  if (std::abs(scale - scale_) < 0.01 && std::abs(pixels_a_unit - pixels_a_unit_) < 0.01) return false;
  scale_ = scale;
  pixels_a_unit_ = pixels_a_unit;
  ImGuiIO& io = ImGui::GetIO();
  ImGuiStyle& style = ImGui::GetStyle();
  style = ImGuiStyle();
  set_colours(style);
  style.WindowRounding = 0;
  style.FrameRounding = 3;
  style.ItemSpacing = {6, 5};
  style.ScaleAllSizes(float(scale));
  io.Fonts->Clear();
  std::error_code error;
  const bool ours = std::filesystem::exists(kFont, error);
  const float pixels = std::round(float((ours ? kLetters : kOwnLetters) * scale * pixels_a_unit));
  if (!ours || !io.Fonts->AddFontFromFileTTF(kFont, pixels)) {
    ImFontConfig config;
    config.SizePixels = pixels;
    io.Fonts->AddFontDefault(&config);
  }
  io.FontGlobalScale = float(1 / pixels_a_unit);
  return true;
}

}  // namespace telesplat::viewer
