#include "client/displays/window/panel/gui/legend_view.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "client/displays/window/panel/gui/widgets.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr float kMargin = 0.7f, kBarWidth = 1.2f, kCurveWidth = 3;  // in letters' heights
constexpr float kShareOfHeight = 0.4f, kGroundAlpha = 0.63f;
constexpr int kSteps = 96;
constexpr ImGuiWindowFlags kFlags = ImGuiWindowFlags_NoTitleBar | ImGuiWindowFlags_NoResize |
                                    ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_AlwaysAutoResize |
                                    ImGuiWindowFlags_NoScrollbar | ImGuiWindowFlags_NoFocusOnAppearing |
                                    ImGuiWindowFlags_NoBringToFrontOnFocus;

// Draws the values' colours from the bottom up; opacities are the widths, if there are any.
void draw_bar(const image::Legend& legend, const ImVec2& from, const ImVec2& size) {
  auto& list = *ImGui::GetWindowDrawList();
  list.AddRectFilled(from, {from.x + size.x, from.y + size.y}, ink(0x101418, 144));
  for (int i = 0; i < kSteps; ++i) {
    const double at = (i + 0.5) / kSteps;
    float width = size.x;
    if (!legend.opacity.empty())
      width *= legend.opacity[std::min(size_t(at * double(legend.opacity.size())), legend.opacity.size() - 1)];
    const float bottom = from.y + size.y * float(kSteps - i) / kSteps;
    list.AddRectFilled({from.x, bottom - size.y / kSteps - 0.5f}, {from.x + width, bottom}, ink(legend.map.at(at)));
  }
  list.AddRect(from, {from.x + size.x, from.y + size.y}, ink(0xf4f4f4));
}

// Draws numbers at the right of the bar; returns their width.
float draw_numbers(const image::Legend& legend, const image::Ticks& ticks, const ImVec2& from, const ImVec2& size) {
  auto& list = *ImGui::GetWindowDrawList();
  const float letter = ImGui::GetFontSize(), right = from.x + size.x;
  float width = 0;
  for (const auto& tick : ticks.all) {
    // Computes with halves, because the difference of large numbers may be infinite.
    const double share =
        legend.hi > legend.lo ? (tick.value / 2 - legend.lo / 2) / (legend.hi / 2 - legend.lo / 2) : 0.5;
    const float y = from.y + size.y * float(1 - within(share, 0.0, 1.0));
    list.AddLine({right, y}, {right + letter * 0.3f, y}, ink(0xf4f4f4));
    list.AddText({right + letter * 0.45f, y - letter / 2}, ink(0xf4f4f4), tick.label.c_str());
    width = std::max(width, ImGui::CalcTextSize(tick.label.c_str()).x);
  }
  return width + letter * 0.45f;
}

// Dragging in the bar's upper half moves the upper end, in its lower half the lower end.
void drag_range(const image::Legend& legend, float middle, float height,
                const std::function<void(double, double)>& change) {
  const ImGuiIO& io = ImGui::GetIO();
  const double by = double(io.MouseDelta.y / height) * (legend.hi - legend.lo);
  const bool upper = io.MouseClickedPos[0].y < middle;
  const double lo = legend.lo + (upper ? 0 : by), hi = legend.hi + (upper ? by : 0);
  if (by != 0 && std::isfinite(lo) && std::isfinite(hi) && lo < hi) change(lo, hi);
}

void type_range(const image::Legend& legend, LegendViewState& state, bool opens,
                const std::function<void(double, double)>& change) {
  if (opens) {
    state.lo = legend.lo, state.hi = legend.hi;
    ImGui::OpenPopup("range");
  }
  if (!ImGui::BeginPopup("range")) return;
  ImGui::SetNextItemWidth(ImGui::GetFontSize() * 8);
  seen("number", "to", ImGui::InputDouble("to", &state.hi, 0, 0, "%.6g"));
  ImGui::SetNextItemWidth(ImGui::GetFontSize() * 8);
  seen("number", "from", ImGui::InputDouble("from", &state.lo, 0, 0, "%.6g"));
  const bool fits = std::isfinite(state.lo) && std::isfinite(state.hi) && state.lo < state.hi;
  if (fits && button("set")) {
    change(state.lo, state.hi);
    ImGui::CloseCurrentPopup();
  }
  if (!fits) ImGui::TextDisabled("from is not below to");
  ImGui::EndPopup();
}

// Keeps its distance from the nearest corner when the window's size changes.
void place(const LegendViewState& state, double hidden) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float margin = ImGui::GetFontSize() * kMargin;
  const bool moved = state.from_side >= 0;
  const float side = moved ? state.from_side : margin, end = moved ? state.from_end : margin;
  const float x = state.right ? window.x - side : std::max(side, float(hidden));
  ImGui::SetNextWindowPos({x, state.low ? window.y - end : end}, ImGuiCond_Always,
                          {state.right ? 1.0f : 0.0f, state.low ? 1.0f : 0.0f});
}

void remember(LegendViewState& state) {
  const ImVec2 window = ImGui::GetIO().DisplaySize, at = ImGui::GetWindowPos(), size = ImGui::GetWindowSize();
  state.right = at.x + size.x / 2 > window.x / 2, state.low = at.y + size.y / 2 > window.y / 2;
  state.from_side = std::max(0.0f, state.right ? window.x - at.x - size.x : at.x);
  state.from_end = std::max(0.0f, state.low ? window.y - at.y - size.y : at.y);
}

}  // namespace

WindowPart show_legend(const image::Legend& legend, LegendViewState& state, double hidden,
                       const std::function<void(double lo, double hi)>& change) {
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float letter = ImGui::GetFontSize();
  const bool held = ImGui::IsMouseDown(ImGuiMouseButton_Left);
  if (!held) place(state, hidden);
  ImGui::SetNextWindowBgAlpha(kGroundAlpha);
  WindowPart out;
  if (ImGui::Begin("legend", nullptr, kFlags)) {
    dialog("legend", nullptr);
    const float height = std::max(4 * letter, window.y * kShareOfHeight);
    const int most = within(int(height / (2 * letter)), 2, 7);
    const auto ticks = image::nice_ticks(legend.lo, legend.hi, most);
    ImGui::PushTextWrapPos(std::max(letter * 6, window.x / 4));
    if (!legend.title.empty()) text(legend.title);
    if (ticks.exponent != 0) text(fmt::format("\u00d7 10^{}", ticks.exponent));
    ImGui::PopTextWrapPos();
    ImGui::Dummy({1, letter / 2});
    const ImVec2 from = ImGui::GetCursorScreenPos();
    const ImVec2 size(letter * (legend.opacity.empty() ? kBarWidth : kCurveWidth), height);
    draw_bar(legend, from, size);
    const float numbers = draw_numbers(legend, ticks, from, size);
    bool on_bar = false;
    if (change) {
      ImGui::InvisibleButton("bar", size);
      on_bar = seen("plot", "range", ImGui::IsItemActive());
      const bool types = ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left);
      if (on_bar) drag_range(legend, from.y + height / 2, height, change);
      hint("drag the upper or lower half to move that end; double click to type both");
      type_range(legend, state, types, change);
    } else {
      ImGui::Dummy(size);
    }
    ImGui::SameLine(0, 0);
    ImGui::Dummy({numbers, height + letter / 2});
    if (held && !on_bar && ImGui::IsWindowFocused() && ImGui::IsMouseDragging(ImGuiMouseButton_Left)) remember(state);
    const ImVec2 at = ImGui::GetWindowPos(), extent = ImGui::GetWindowSize();
    out = {double(at.x / window.x), double(at.y / window.y), double((at.x + extent.x) / window.x),
           double((at.y + extent.y) / window.y)};
  }
  ImGui::End();
  return out;
}

}  // namespace telesplat::viewer
