#include "client/displays/window/panel/gui/scene_view.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <cmath>

#include "client/displays/window/panel/gui/panel_view.h"
#include "client/displays/window/panel/gui/widgets.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr const char* kOwnColours = "none (the file's own colours)";

// Draws a bar of a colour map as wide as the next item.
void draw_map(const colour::ColourMap& map) {
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const ImVec2 size(ImGui::GetContentRegionAvail().x, ImGui::GetFontSize() * 0.7f);
  constexpr int kSteps = 64;
  for (int i = 0; i < kSteps; ++i)
    ImGui::GetWindowDrawList()->AddRectFilled({from.x + size.x * float(i) / kSteps, from.y},
                                              {from.x + size.x * float(i + 1) / kSteps, from.y + size.y},
                                              ink(map.at((i + 0.5) / kSteps)));
  ImGui::Dummy(size);
}

// Shows both ends, which can be dragged, or typed after a double click.
void show_range(ColourControls& colours, double now_s) {
  const auto whole = colours.whole_range();
  const auto [lo, hi] = colours.range();
  double ends[2] = {lo, hi};
  const float speed = float(std::max((whole.empty() ? hi - lo : whole.hi - whole.lo) / 300, 1e-30));
  setting_row("range");
  if (seen("drag", "range",
           ImGui::DragScalarN("##range", ImGuiDataType_Double, ends, 2, speed, nullptr, nullptr, "%.6g")))
    colours.choose_range(now_s, ends[0], ends[1]);
  hint("drag an end, or double click and type");
  if (whole.empty()) return;
  ImGui::TextDisabled("values %.5g to %.5g", whole.lo, whole.hi);
  ImGui::SameLine();
  if (small_button("whole range")) colours.reset_range();
}

void show_map(ColourControls& colours) {
  const auto& now = colours.colouring()->map;
  setting_row("map");
  if (begin_list("map", now.name.empty() ? "a file's" : now.name.c_str())) {
    for (const auto name : colour::colour_map_names()) {
      if (choice("map", std::string(name), name == now.name))
        if (const auto map = colour::find_colour_map(name)) colours.choose_map(*map);
      if (const auto map = colour::find_colour_map(name)) draw_map(*map);
    }
    ImGui::EndCombo();
  }
  draw_map(now);
  if (small_button("turn round")) {
    const bool turned = now.name.ends_with("_r");
    const auto map = colour::find_colour_map(turned ? now.name.substr(0, now.name.size() - 2) : now.name + "_r");
    if (map) colours.choose_map(*map);
  }
}

}  // namespace

void show_colours(ColourControls& colours, double now_s) {
  if (colours.arrays().empty()) return ImGui::TextDisabled("the file has no arrays of numbers");
  const auto& colouring = colours.colouring();
  setting_row("array");
  if (begin_list("array", colouring ? colouring->array.c_str() : kOwnColours)) {
    if (choice("array", kOwnColours, !colouring)) colours.choose_array(std::string(scene::kNoArray));
    for (const auto& name : colours.arrays())
      if (choice("array", name, colouring && colouring->array == name)) colours.choose_array(name);
    ImGui::EndCombo();
  }
  if (!colouring) return;
  show_range(colours, now_s);
  show_map(colours);
}

void show_cut(CutControls& cut, ColourViewState& state, double now_s) {
  const auto kept = cut.kept();
  for (int axis = 0; axis < 3 && cut.knows_box(); ++axis) {
    const auto before = kept[size_t(axis)];
    auto k = before;
    for (const bool upper : {false, true}) {
      double& end = upper ? k.to : k.from;
      float percent = float(end);
      const std::string name = fmt::format("{} {}", "xyz"[axis], upper ? "to" : "from");
      const std::string shown = fmt::format("{:.5g} {}", cut.value(axis, end), cut.unit());
      row(name.c_str());
      std::string escaped;
      for (const char c : shown) escaped += c == '%' ? "%%" : std::string(1, c);
      if (seen("slider", name.c_str(),
               ImGui::SliderFloat(("##" + name).c_str(), &percent, 0, 100, escaped.c_str(),
                                  ImGuiSliderFlags_AlwaysClamp)))
        end = double(percent);
    }
    if (!(k == before)) cut.keep(now_s, axis, k);
  }
  if (state.typed_for != cut.order()) state.order = state.typed_for = cut.order(), state.complaint.clear();
  setting_row("clip");
  const bool entered = ImGui::InputTextWithHint("##clip", "plane x>=50%; box 0,0,0,1,1,1", &state.order,
                                                ImGuiInputTextFlags_EnterReturnsTrue);
  seen("text", "clip", ImGui::IsItemEdited() || entered);
  if (entered) {
    const Status given = cut.give(now_s, state.order.empty() ? "off" : state.order);
    state.complaint = given ? "" : given.error().text;
  }
  if (!state.complaint.empty()) ImGui::TextWrapped("%s", state.complaint.c_str());
  if (button("off") && !cut.order().empty())
    if (const Status s = cut.give(now_s, "off"); !s) state.complaint = s.error().text;
}

// Draws the histogram below the slider, on its axis.
void draw_values(const ColourControls& colours) {
  const auto bars = colours.iso_bars();
  if (bars.empty()) return;
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  const float rim = ImGui::GetStyle().GrabMinSize / 2 + 2, height = ImGui::GetFontSize() * 4;  // half the grab
  ImGui::Dummy({0, height});
  draw_bars({{from.x + rim, to.y}, {to.x - from.x - 2 * rim, height}}, bars);
}

// The surface is made anew only when the person lets go, because that takes a moment.
void show_isosurface(ColourControls& colours, ColourViewState& state) {
  const double now = *colours.iso();
  double value = state.iso.value_or(now);
  const auto range = colours.iso_range();
  setting_row("iso");
  const bool changed = range.empty()
                           ? ImGui::InputDouble("##iso", &value, 0, 0, "%.6g")
                           : ImGui::SliderScalar("##iso", ImGuiDataType_Double, &value, &range.lo, &range.hi, "%.6g");
  seen("slider", "iso", changed);
  if (changed) state.iso = value;
  if (ImGui::IsItemDeactivatedAfterEdit()) {
    colours.choose_iso(range.empty() ? value : within(value, range.lo, range.hi));
    state.iso.reset();
  }
  draw_values(colours);
  if (!range.empty()) ImGui::TextDisabled("values of the volume %.5g to %.5g", range.lo, range.hi);
}

}  // namespace telesplat::viewer
