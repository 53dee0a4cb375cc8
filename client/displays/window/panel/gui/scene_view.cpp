#include "client/displays/window/panel/gui/scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

constexpr float kTimelineHeight = 6;  // in letters' heights

// Maps values of a plot to the screen.
struct Plane {
  ImVec2 from, size;
  double left = 0, right = 1, low = 0, high = 1;
  ImVec2 at(double x, double y) const {
    return {from.x + size.x * float((x - left) / (right - left)), from.y + size.y * float((high - y) / (high - low))};
  }
};

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
    const auto at = size_t(within(value, 0.0, double(names.size() - 1)));
    if (begin_list(name.c_str(), std::string(names[at]).c_str())) {
      for (size_t i = 0; i < names.size(); ++i)
        if (choice(name.c_str(), std::string(names[i]), i == at)) controls.set(now_s, info, double(i));
      ImGui::EndCombo();
    }
  } else {
    // Sets lie within 2 of 0: the whole range would make a slider too coarse. Ctrl and click takes any number.
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

// Draws each track in a colour of its own, between its parameter's limits.
void draw_timeline(const SceneControls& controls) {
  constexpr std::array<uint32_t, 6> kColours{0x56b4e9, 0xe69f00, 0x009e73, 0xcc79a7, 0xf0e442, 0xd55e00};
  const PlotArea area = plot_area("curves", kTimelineHeight);
  Plane plane{area.from, area.size};
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
  state.key_s = within(std::isfinite(state.key_s) ? state.key_s : 0.0, 0.0, SceneControls::kLongest_s);
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
  if (controls.colours().iso() && section("Isosurface", true)) show_isosurface(controls.colours(), state.colours);
  if (controls.kind() == scene::Kind::kMesh && !controls.colours().iso() && section("Colours", true))
    show_colours(controls.colours(), now_s);
  if (controls.kind() == scene::Kind::kVolume && controls.volume()) {
    if (section("Transfer function", true)) show_transfer(controls, state.transfer, now_s, save);
    if (controls.volume()->steps > 1 && section("Series", true)) show_series(controls, now_s);
  }
  if (controls.kind() && section("Cut", false)) show_cut(controls.cut(), state.colours, now_s);
  if (controls.kind() != scene::Kind::kJulia) return;
  if (section("Parameters", true))
    for (const auto& info : julia::parameter_infos())
      if (info.animates) show_parameter(controls, info, now_s);
  if (section("Timeline", true)) show_timeline(controls, state);
}

}  // namespace telesplat::viewer
