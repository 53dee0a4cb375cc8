#include "client/displays/window/panel/gui/scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "client/displays/window/panel/gui/widgets.h"
#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr float kEditorHeight = 9, kGrab = 0.5f;  // in letters' heights

// Values beyond the axis are drawn at its ends.
ImVec2 at(const PlotArea& area, double share, double height) {
  return {area.from.x + area.size.x * float(within(share, 0.0, 1.0)), area.from.y + area.size.y * float(1 - height)};
}
ImVec2 at(const PlotArea& area, const TransferEditor& editor, const TransferEditor::Point& p) {
  return at(area, editor.share(p.value), double(p.opacity));
}

ImU32 ink(const TransferEditor::Point& p, int alpha) {
  return IM_COL32(int(p.r * 255), int(p.g * 255), int(p.b * 255), alpha);
}

// Fills the area below the opacity with each value's colour.
void draw_function(const PlotArea& area, const TransferEditor& editor) {
  auto& list = *ImGui::GetWindowDrawList();
  constexpr int kSteps = 96;
  for (int i = 0; i < kSteps; ++i) {
    const double from = double(i) / kSteps, to = double(i + 1) / kSteps;
    const auto p = editor.transfer().at(editor.value_at((from + to) / 2));
    list.AddRectFilled(at(area, from, double(p.opacity)), at(area, to, 0), ink(p, 150));
  }
  std::vector<ImVec2> line;
  for (const auto& spot : editor.curve()) line.push_back(at(area, spot.share, spot.opacity));
  list.AddPolyline(line.data(), int(line.size()), viewer::ink(0xf0f0f0), ImDrawFlags_None, 1.5f);
}

// Returns the point under the pointer; if several lie at an end of the axis, the nearest to it; -1: there is no point.
int point_at(const PlotArea& area, const TransferEditor& editor, const ImVec2& pointer) {
  int best = -1;
  std::pair<float, double> least{ImGui::GetFontSize() * kGrab, 0};
  const auto& points = editor.transfer().points;
  for (size_t i = 0; i < points.size(); ++i) {
    const ImVec2 p = at(area, editor, points[i]);
    const double beyond = std::max(editor.lo() - points[i].value, points[i].value - editor.hi());
    const std::pair distance(std::hypot(p.x - pointer.x, p.y - pointer.y), std::max(0.0, beyond));
    if (distance < least) least = distance, best = int(i);
  }
  return best;
}

void draw_points(const PlotArea& area, const TransferEditor& editor, int chosen) {
  auto& list = *ImGui::GetWindowDrawList();
  const float radius = ImGui::GetFontSize() * 0.3f;
  const auto& points = editor.transfer().points;
  for (size_t i = 0; i < points.size(); ++i) {
    const ImVec2 p = at(area, editor, points[i]);
    list.AddCircleFilled(p, radius, ink(points[i], 255));
    list.AddCircle(p, radius, viewer::ink(int(i) == chosen ? 0xf0e442 : 0xf0f0f0), 0, int(i) == chosen ? 2.5f : 1.5f);
  }
}

// A click alone chooses a point and does not move it.
void edit_points(SceneControls& controls, TransferViewState& state, const PlotArea& area, double now_s) {
  const ImVec2 pointer = ImGui::GetIO().MousePos;
  const auto& editor = controls.transfer();
  const double value = editor.value_at(within(double((pointer.x - area.from.x) / area.size.x), 0.0, 1.0));
  if (ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
    if (point_at(area, editor, pointer) < 0) controls.edit([&](TransferEditor& e) { return e.add(now_s, value); });
  } else if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    const int index = point_at(area, editor, pointer);
    state.drags = index >= 0;
    if (state.drags) state.point = index;
  } else if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Right)) {
    const int index = point_at(area, editor, pointer);
    if (index >= 0) controls.edit([&](TransferEditor& e) { return e.remove(now_s, size_t(index)); });
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) state.drags = false;
  if (state.drags && ImGui::IsMouseDragging(ImGuiMouseButton_Left))
    controls.edit([&](TransferEditor& e) {
      return e.move(now_s, size_t(state.point), value, 1 - double((pointer.y - area.from.y) / area.size.y));
    });
}

void show_chosen(SceneControls& controls, TransferViewState& state, double now_s) {
  const auto& points = controls.transfer().transfer().points;
  row("point");
  int number = state.point + 1;
  if (seen("number", "point", ImGui::InputInt("##number", &number))) state.point = std::max(number, 1) - 1;
  state.point = within(state.point, 0, int(points.size()) - 1);
  hint("drag points; double click adds one, right click takes one away");
  const auto index = size_t(state.point);
  const auto p = points[index];
  row("value, opacity");
  float colour[3] = {p.r, p.g, p.b};
  if (seen("colour", "colour", ImGui::ColorEdit3("##colour", colour, ImGuiColorEditFlags_NoInputs)))
    controls.edit([&](TransferEditor& e) { return e.colour(now_s, index, colour[0], colour[1], colour[2]); });
  ImGui::SameLine();
  double value = p.value, opacity = double(p.opacity);
  ImGui::SetNextItemWidth(ImGui::GetContentRegionAvail().x * 0.6f);
  bool moves = seen("number", "value", ImGui::InputDouble("##value", &value, 0, 0, "%.7g"));
  ImGui::SameLine();
  ImGui::SetNextItemWidth(-1);
  moves |= seen("number", "opacity", ImGui::InputDouble("##opacity", &opacity, 0, 0, "%.3f"));
  if (moves) controls.edit([&](TransferEditor& e) { return e.move(now_s, index, value, opacity); });
}

void show_window(SceneControls& controls, double now_s) {
  const auto& editor = controls.transfer();
  double values[2] = {editor.window(), editor.level()};
  row("window, level");
  const double least = (editor.hi() - editor.lo()) / 1000;  // a function of width 0 would have lost its form
  const float speed = float(2 * least);
  if (seen("drag", "window, level",
           ImGui::DragScalarN("##window", ImGuiDataType_Double, values, 2, speed, nullptr, nullptr, "%.5g")))
    controls.edit([&](TransferEditor& e) { return e.set_window(now_s, std::max(least, values[0]), values[1]); });
  hint("from the first to the last point: how wide, and the middle; drag, or double click and type");
}

}  // namespace

void draw_bars(const PlotArea& area, const std::vector<HistogramBar>& bars) {
  auto& list = *ImGui::GetWindowDrawList();
  for (const auto& bar : bars) {
    const ImVec2 a = at(area, bar.from, bar.height), b = at(area, bar.to, 0);
    list.AddRectFilled(a, {std::max(b.x, a.x + 1), b.y}, ink(0x5a6470));
  }
}

void show_transfer(SceneControls& controls, TransferViewState& state, double now_s, const std::function<void()>& save) {
  const auto& editor = controls.transfer();
  const PlotArea area = plot_area("curve", kEditorHeight);
  edit_points(controls, state, area, now_s);
  ImGui::PushClipRect(area.from, {area.from.x + area.size.x, area.from.y + area.size.y}, true);
  draw_bars(area, editor.bars(!state.linear));
  draw_function(area, editor);
  ImGui::PopClipRect();
  draw_points(area, editor, state.point);
  text(fmt::format("{:.5g}", editor.lo()));
  const std::string most = fmt::format("{:.5g}", editor.hi());
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(most.c_str()).x);
  text(most);
  show_chosen(controls, state, now_s);
  show_window(controls, now_s);
  if (button("fit to data")) controls.edit([&](TransferEditor& e) { return e.fit(now_s); });
  hint("stretches the function over all values of the data");
  ImGui::SameLine();
  checkbox("linear histogram", &state.linear);
  row("preset");
  if (begin_list("preset", "choose ...")) {
    for (const auto& preset : volume::transfer_presets()) {
      if (choice("preset", std::string(preset.name))) controls.choose_preset(preset.name);
      hint(std::string(preset.text).c_str());
    }
    ImGui::EndCombo();
  }
  if (button("save for ParaView")) save();
  hint("as a JSON file of ParaView's, which --tf and telesplat ctl tf read too");
}

}  // namespace telesplat::viewer
