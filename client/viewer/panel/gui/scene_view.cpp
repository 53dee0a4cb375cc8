#include "client/viewer/panel/gui/scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "client/viewer/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

constexpr float kEditorHeight = 9, kTimelineHeight = 6, kGrab = 0.5f;  // in letters' heights

// Where values of a plot lie on the screen.
struct Plane {
  ImVec2 from, size;
  double left = 0, right = 1, low = 0, high = 1;
  ImVec2 at(double x, double y) const {
    return {from.x + size.x * float((x - left) / (right - left)), from.y + size.y * float((high - y) / (high - low))};
  }
  double x_of(float px) const { return left + double((px - from.x) / size.x) * (right - left); }
  double y_of(float py) const { return high - double((py - from.y) / size.y) * (high - low); }
};

// An empty rectangle as wide as the panel that takes the pointer.
Plane make_plane(const char* name, float height) {
  Plane out{ImGui::GetCursorScreenPos(),
            {std::max(40.0f, ImGui::GetContentRegionAvail().x), ImGui::GetFontSize() * height}};
  ImGui::InvisibleButton(name, out.size, ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  seen("plot", name, ImGui::IsItemActive());
  ImGui::GetWindowDrawList()->AddRectFilled(out.from, {out.from.x + out.size.x, out.from.y + out.size.y},
                                            ImGui::GetColorU32(ImGuiCol_FrameBg));
  return out;
}

// Bars whose height is the logarithm of their count: backgrounds have thousands of times as many voxels as the rest.
void draw_histogram(const Plane& plane, const volume::Histogram& h) {
  uint64_t most = 1;
  for (const uint64_t n : h.counts) most = std::max(most, n);
  const double width = (h.hi - h.lo) / double(h.counts.size());
  auto& list = *ImGui::GetWindowDrawList();
  for (size_t i = 0; i < h.counts.size(); ++i) {
    if (h.counts[i] == 0) continue;
    const double tall = std::log1p(double(h.counts[i])) / std::log1p(double(most));
    const ImVec2 a = plane.at(h.lo + width * double(i), tall), b = plane.at(h.lo + width * double(i + 1), 0);
    // A bar may lie beside the plot: the function may end within the data. A bar has at least one pixel.
    const float left = std::max(a.x, plane.from.x),
                right = std::min(std::max(b.x, left + 1), plane.from.x + plane.size.x);
    if (left < right) list.AddRectFilled({left, a.y}, {right, b.y}, ink(0x5a6470));
  }
}

// The colour of each value below its opacity.
void draw_function(const Plane& plane, const volume::TransferFunction& f) {
  auto& list = *ImGui::GetWindowDrawList();
  constexpr int kSteps = 96;
  for (int i = 0; i < kSteps; ++i) {
    const double x0 = plane.left + (plane.right - plane.left) * i / kSteps,
                 x1 = plane.left + (plane.right - plane.left) * (i + 1) / kSteps;
    const auto p = f.at((x0 + x1) / 2);
    const ImU32 colour = IM_COL32(int(p.r * 255), int(p.g * 255), int(p.b * 255), 150);
    list.AddRectFilled(plane.at(x0, double(p.opacity)), plane.at(x1, 0), colour);
  }
  const auto line = [&](const ImVec2& a, const ImVec2& b) { list.AddLine(a, b, ink(0xf0f0f0), 1.5f); };
  line(plane.at(plane.left, double(f.points.front().opacity)),
       plane.at(f.points.front().value, double(f.points.front().opacity)));
  for (size_t i = 0; i + 1 < f.points.size(); ++i)
    line(plane.at(f.points[i].value, double(f.points[i].opacity)),
         plane.at(f.points[i + 1].value, double(f.points[i + 1].opacity)));
  line(plane.at(f.points.back().value, double(f.points.back().opacity)),
       plane.at(plane.right, double(f.points.back().opacity)));
}

// The point under the pointer; -1: none.
int point_at(const Plane& plane, const volume::TransferFunction& f, const ImVec2& pointer) {
  int best = -1;
  float least = ImGui::GetFontSize() * kGrab;
  for (size_t i = 0; i < f.points.size(); ++i) {
    const ImVec2 p = plane.at(f.points[i].value, double(f.points[i].opacity));
    const float distance = std::hypot(p.x - pointer.x, p.y - pointer.y);
    if (distance < least) least = distance, best = int(i);
  }
  return best;
}

void draw_points(const Plane& plane, const volume::TransferFunction& f, int chosen) {
  auto& list = *ImGui::GetWindowDrawList();
  const float radius = ImGui::GetFontSize() * 0.3f;
  for (size_t i = 0; i < f.points.size(); ++i) {
    const auto& p = f.points[i];
    const ImVec2 at = plane.at(p.value, double(p.opacity));
    if (at.x < plane.from.x - radius || at.x > plane.from.x + plane.size.x + radius) continue;
    list.AddCircleFilled(at, radius, IM_COL32(int(p.r * 255), int(p.g * 255), int(p.b * 255), 255));
    list.AddCircle(at, radius, int(i) == chosen ? ink(0xf0e442) : ink(0xf0f0f0), 0, int(i) == chosen ? 2.5f : 1.5f);
  }
}

void edit_points(SceneControls& controls, SceneViewState& state, const Plane& plane, double now_s) {
  const ImVec2 pointer = ImGui::GetIO().MousePos;
  const auto& f = controls.transfer().transfer();
  if (ImGui::IsItemHovered() && ImGui::IsMouseDoubleClicked(ImGuiMouseButton_Left)) {
    if (point_at(plane, f, pointer) < 0)
      controls.edit([&](TransferEditor& e) { return e.add(now_s, plane.x_of(pointer.x)); });
  } else if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Left)) {
    state.point = point_at(plane, f, pointer);
    state.drags = state.point >= 0;
  } else if (ImGui::IsItemHovered() && ImGui::IsMouseClicked(ImGuiMouseButton_Right)) {
    const int index = point_at(plane, f, pointer);
    if (index >= 0) controls.edit([&](TransferEditor& e) { return e.remove(now_s, size_t(index)); });
    state.point = -1;
  }
  if (!ImGui::IsMouseDown(ImGuiMouseButton_Left)) state.drags = false;
  if (state.drags)
    controls.edit([&](TransferEditor& e) {
      return e.move(now_s, size_t(state.point), plane.x_of(pointer.x), plane.y_of(pointer.y));
    });
}

void show_chosen(SceneControls& controls, SceneViewState& state, double now_s) {
  const auto& points = controls.transfer().transfer().points;
  if (state.point < 0 || size_t(state.point) >= points.size()) {
    ImGui::PushTextWrapPos(0);
    ImGui::TextDisabled("drag points; double click adds, right click takes away");
    ImGui::PopTextWrapPos();
    return;
  }
  const auto p = points[size_t(state.point)];
  float colour[3] = {p.r, p.g, p.b};
  if (seen("colour", "point", ImGui::ColorEdit3("##point", colour, ImGuiColorEditFlags_NoInputs)))
    controls.edit(
        [&](TransferEditor& e) { return e.colour(now_s, size_t(state.point), colour[0], colour[1], colour[2]); });
  ImGui::SameLine();
  text(fmt::format("value {:.5g}, opacity {:.3f}", p.value, p.opacity));
}

void show_transfer(SceneControls& controls, SceneViewState& state, double now_s, const std::function<void()>& save) {
  const auto& editor = controls.transfer();
  Plane plane = make_plane("curve", kEditorHeight);
  plane.left = editor.lo(), plane.right = editor.hi();
  edit_points(controls, state, plane, now_s);
  ImGui::PushClipRect(plane.from, {plane.from.x + plane.size.x, plane.from.y + plane.size.y}, true);
  if (editor.histogram()) draw_histogram(plane, *editor.histogram());
  draw_function(plane, editor.transfer());
  ImGui::PopClipRect();
  draw_points(plane, editor.transfer(), state.point);
  text(fmt::format("{:.5g}", plane.left));
  const std::string most = fmt::format("{:.5g}", plane.right);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(most.c_str()).x);
  text(most);
  show_chosen(controls, state, now_s);
  row("preset");
  if (begin_list("preset", "choose ...")) {
    for (const auto& preset : volume::transfer_presets()) {
      if (choice("preset", std::string(preset.name))) controls.choose_preset(preset.name), state.point = -1;
      hint(std::string(preset.text).c_str());
    }
    ImGui::EndCombo();
  }
  if (button("save for ParaView")) save();
  hint("as a JSON file of ParaView's, which --tf and telesplat ctl tf read too");
}

void show_series(SceneControls& controls, double now_s) {
  const auto& v = *controls.volume();
  int step = int(controls.value("volume.step"));
  row("step");
  const std::string shown = fmt::format("%d of {}", v.steps - 1);
  if (seen("slider", "step",
           ImGui::SliderInt("##step", &step, 0, v.steps - 1, shown.c_str(), ImGuiSliderFlags_AlwaysClamp)))
    controls.choose_step(now_s, step);
  row("steps/s");
  float speed = float(controls.value("volume.steps-per-s"));
  if (seen("slider", "steps/s",
           ImGui::SliderFloat("##speed", &speed, 0, 60, "%.1f",
                              ImGuiSliderFlags_AlwaysClamp | ImGuiSliderFlags_Logarithmic)))
    controls.choose_speed(now_s, double(speed));
  if (button("play")) controls.play_series(true);
  ImGui::SameLine();
  if (button("stop")) controls.play_series(false);
}

void show_parameter(SceneControls& controls, const julia::ParameterInfo& info, double now_s) {
  const std::string name(info.name);
  double value = controls.value(name);
  row(name.c_str());
  const auto names = name == "palette"  ? julia::palette_names()
                     : name == "colour" ? julia::colour_names()
                                        : std::span<const std::string_view>();
  if (!names.empty()) {
    const auto at = size_t(std::clamp(value, 0.0, double(names.size() - 1)));
    if (begin_list(name.c_str(), std::string(names[at]).c_str())) {
      for (size_t i = 0; i < names.size(); ++i)
        if (choice(name.c_str(), std::string(names[i]), i == at)) controls.set(now_s, info, double(i));
      ImGui::EndCombo();
    }
  } else {
    // Sets lie within 2 of 0: the whole range would leave a slider too coarse. Ctrl and click takes any number.
    const bool wide = info.most - info.least > 4 && info.least < 0 && !info.whole && info.most < 100;
    const double least = wide ? std::max(info.least, -2.0) : info.least,
                 most = wide ? std::min(info.most, 2.0) : info.most;
    const auto flags =
        most / std::max(1e-9, least) > 100 && least > 0 ? ImGuiSliderFlags_Logarithmic : ImGuiSliderFlags_None;
    if (seen("slider", name.c_str(),
             ImGui::SliderScalar(("##" + name).c_str(), ImGuiDataType_Double, &value, &least, &most,
                                 info.whole ? "%.0f" : "%.4f", flags)))
      controls.set(now_s, info, value);
  }
  hint(std::string(info.text).c_str());
}

// Each track in a colour of its own and between its limits' values.
void draw_timeline(const SceneControls& controls) {
  constexpr std::array<uint32_t, 6> kColours{0x56b4e9, 0xe69f00, 0x009e73, 0xcc79a7, 0xf0e442, 0xd55e00};
  Plane plane = make_plane("curves", kTimelineHeight);
  plane.right = std::max(controls.timeline_s(), 1.0);
  auto& list = *ImGui::GetWindowDrawList();
  const auto& tracks = controls.timeline().tracks;
  for (size_t t = 0; t < tracks.size(); ++t) {
    const auto& keys = tracks[t].keys;
    plane.low = plane.high = keys.front().value;
    for (const auto& k : keys) plane.low = std::min(plane.low, k.value), plane.high = std::max(plane.high, k.value);
    const double rim = std::max(1e-6, (plane.high - plane.low) * 0.15);
    plane.low -= rim, plane.high += rim;
    const ImU32 colour = ink(kColours[t % kColours.size()]);
    std::array<ImVec2, 100> line;
    for (size_t i = 0; i < line.size(); ++i) {
      const double at = std::min(plane.right * double(i) / double(line.size() - 1), plane.right * (1 - 1e-9));
      line[i] = plane.at(at, tracks[t].value(at));
    }
    list.AddPolyline(line.data(), int(line.size()), colour, ImDrawFlags_None, ImGui::GetFontSize() / 9);
    for (const auto& k : keys)
      if (k.t_s <= plane.right) list.AddCircleFilled(plane.at(k.t_s, k.value), ImGui::GetFontSize() * 0.25f, colour);
    list.AddText({plane.from.x + 4, plane.from.y + ImGui::GetFontSize() * float(t)}, colour, tracks[t].name.c_str());
  }
}

void show_key_frames(SceneControls& controls) {
  std::optional<std::pair<size_t, size_t>> gone;
  const auto& tracks = controls.timeline().tracks;
  for (size_t t = 0; t < tracks.size(); ++t)
    for (size_t k = 0; k < tracks[t].keys.size(); ++k) {
      ImGui::PushID(int(t * 1000 + k));
      text(fmt::format("{}  {:.2f} s: {:.4f}", tracks[t].name, tracks[t].keys[k].t_s, tracks[t].keys[k].value));
      ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::GetFontSize() * 4.5f);
      if (small_button("take out")) gone = {t, k};
      ImGui::PopID();
    }
  if (gone) controls.remove_key(gone->first, gone->second);
}

void show_timeline(SceneControls& controls, SceneViewState& state) {
  text(controls.playing().empty() ? "nothing plays" : "plays " + controls.playing());
  const auto infos = julia::parameter_infos();
  const auto fits = [](const julia::ParameterInfo& i) { return i.animates && !i.whole; };
  if (size_t(state.parameter) >= infos.size() || !fits(infos[size_t(state.parameter)])) {
    const auto first = std::find_if(infos.begin(), infos.end(), fits);
    state.parameter = int(first - infos.begin());
  }
  const auto& info = infos[size_t(state.parameter)];
  row("parameter");
  if (begin_list("parameter", std::string(info.name).c_str())) {
    for (size_t i = 0; i < infos.size(); ++i)
      if (fits(infos[i]) && choice("parameter", std::string(infos[i].name), int(i) == state.parameter))
        state.parameter = int(i);
    ImGui::EndCombo();
  }
  row("at, s");
  seen("number", "at, s", ImGui::InputDouble("##at", &state.key_s, 0.5, 5, "%.2f"));
  state.key_s = std::clamp(std::isfinite(state.key_s) ? state.key_s : 0.0, 0.0, SceneControls::kLongest_s);
  if (button("key frame of its value now")) controls.add_key(info, state.key_s, controls.value(info.name));
  hint("move the parameter's slider, choose the time, press; values between key frames run smoothly, for ever");
  if (!controls.timeline().empty()) {
    draw_timeline(controls);
    show_key_frames(controls);
    if (button("play")) controls.play();
    ImGui::SameLine();
    if (button("clear")) controls.clear_timeline();
    ImGui::SameLine();
  }
  if (button("stop")) controls.stop();
}

}  // namespace

void show_scene(SceneControls& controls, SceneViewState& state, double now_s, const std::function<void()>& save) {
  if (controls.kind() == scene::Kind::kVolume && controls.volume()) {
    if (section("Transfer function", true)) show_transfer(controls, state, now_s, save);
    if (controls.volume()->steps > 1 && section("Series", true)) show_series(controls, now_s);
  }
  if (controls.kind() != scene::Kind::kJulia) return;
  if (section("Parameters", true))
    for (const auto& info : julia::parameter_infos())
      if (info.animates) show_parameter(controls, info, now_s);
  if (section("Timeline", true)) show_timeline(controls, state);
}

}  // namespace telesplat::viewer
