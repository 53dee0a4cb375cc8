#include "client/displays/window/panel/gui/panel_view.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "client/displays/window/panel/gui/widgets.h"
#include "client/stereo/mode.h"
#include "client/viewer/input/look.h"
#include "common/core/check.h"
#include "common/core/within.h"
#include "common/image/shading.h"
#include "common/scene/settings.h"
#include "common/splat/kernel_traits.h"
#include "common/wire/limits.h"

namespace telesplat::viewer {
namespace {

constexpr int kMostSamplers = 64;
const std::array<std::string, 7> kSizes{"auto",      "640x400",   "960x600",  "1280x800",
                                        "1600x1000", "1920x1200", "2560x1600"};
const std::array<std::string, 6> kUps{"x", "y", "z", "-x", "-y", "-z"};
// Backgrounds on which data of any colour can be seen.
constexpr std::array<std::pair<const char*, const char*>, 4> kBackgrounds{
    {{"night", "#141820"}, {"black", "#000000"}, {"grey", "#777777"}, {"white", "#ffffff"}}};

// Gives an order to the launcher.
void ask(Panel& panel, const char* order, const std::string& value) { panel.order({order, {{"value", value}}, order}); }

// Shows a field for a number; Enter gives the order.
void typed_number(Panel& panel, const char* name, const char* now, std::string& text) {
  setting_row(name);
  const std::string id = fmt::format("##{}", name);
  const bool entered = ImGui::InputTextWithHint(
      id.c_str(), now, &text, ImGuiInputTextFlags_EnterReturnsTrue | ImGuiInputTextFlags_CharsScientific);
  seen("text", name, ImGui::IsItemEdited() || entered);
  if (entered && !text.empty()) ask(panel, name, std::exchange(text, {}));
}

void show_coupling(Panel& panel) {
  CouplingState state = panel.coupling();
  setting_row("coupling");
  if (begin_list("coupling", coupling_name(state.mode))) {
    for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose})
      if (choice("coupling", coupling_name(mode), mode == state.mode))
        panel.choose_coupling(coupling_state(mode, std::max(3, state.buffers)));
    ImGui::EndCombo();
  }
  if (state.mode == CouplingMode::kLoose) {
    setting_row("buffers");
    if (seen("slider", "buffers",
             ImGui::SliderInt("##buffers", &state.buffers, 1, int(wire::kMaxBuffers), "%d",
                              ImGuiSliderFlags_AlwaysClamp)))
      panel.choose_coupling(state);
  }
  if (panel.coupling_pending()) ImGui::TextDisabled("  not in force yet");
}

void show_background(Panel& panel) {
  const auto now = uint32_t(std::strtoul(panel.value("background").substr(0, 7).erase(0, 1).c_str(), nullptr, 16));
  float colour[3] = {float(now >> 16 & 255) / 255, float(now >> 8 & 255) / 255, float(now & 255) / 255};
  setting_row("background");
  if (seen("colour", "background", ImGui::ColorEdit3("##background", colour, ImGuiColorEditFlags_NoInputs))) {
    const auto byte = [](float v) { return int(within(v, 0.0f, 1.0f) * 255 + 0.5f); };
    panel.choose("background", fmt::format("#{:02x}{:02x}{:02x}", byte(colour[0]), byte(colour[1]), byte(colour[2])));
  }
  for (const auto& [name, value] : kBackgrounds) {
    ImGui::SameLine();
    if (small_button(name)) panel.choose("background", value);
  }
}

// Shows one order that has three stages.
void show_finish(Panel& panel) {
  auto finish = splat::finish_named(panel.value("finish")).value_or(splat::Finish{});
  bool changed = false;
  row("finish");
  for (const auto& [name, on] :
       {std::pair{"fill", &finish.fill}, {"smooth", &finish.smooth}, {"antialias", &finish.antialias}}) {
    if (on != &finish.fill) ImGui::SameLine();
    changed |= checkbox(name, on);
    setting_hint(name);
  }
  if (changed) panel.choose("finish", splat::finish_name(finish));
}

}  // namespace

void setting_hint(const char* name) {
  const auto* setting = scene::find_setting(name);
  CHECK(setting);
  hint(setting->what.data());
}

void setting_row(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(name);
  setting_hint(name);
  ImGui::SameLine(ImGui::GetFontSize() * 7.5f);
  ImGui::SetNextItemWidth(-1);
}

void setting_list(Panel& panel, const char* name, std::span<const std::string> choices) {
  setting_row(name);
  const std::string now = panel.value(name);
  if (!begin_list(name, now.c_str())) return;
  for (const auto& text : choices)
    if (choice(name, text, text == now)) panel.choose(name, text);
  ImGui::EndCombo();
}

void setting_slider(Panel& panel, const char* name, double least, double most, const char* format) {
  setting_row(name);
  float value = std::strtof(panel.value(name).c_str(), nullptr);
  const std::string id = std::string("##") + name;
  if (seen("slider", name,
           ImGui::SliderFloat(id.c_str(), &value, float(least), float(most), format, ImGuiSliderFlags_AlwaysClamp)))
    panel.choose(name, fmt::format("{:.6g}", within(double(value), least, most)));
}

void setting_box(Panel& panel, const char* name) {
  bool on = panel.value(name) == "on";
  if (checkbox(name, &on)) panel.choose(name, on ? "on" : "off");
  setting_hint(name);
}

void show_data(Panel& panel, SettingsViewState& state, std::optional<scene::Kind> kind) {
  if (kind == scene::Kind::kJulia || !kind) return ImGui::TextDisabled("nothing of it can be changed");
  setting_row("up");
  if (begin_list("up", "choose ...")) {
    for (const auto& axis : kUps)
      if (choice("up", axis)) ask(panel, "up", axis);
    ImGui::EndCombo();
  }
  typed_number(panel, "room-size", panel.value("room-size").c_str(), state.room_size);
  if (kind == scene::Kind::kMesh) typed_number(panel, "z-scale", panel.value("z-scale").c_str(), state.z_scale);
  if (kind == scene::Kind::kVolume) {
    setting_row("lighting");
    if (begin_list("lighting", panel.value("lighting").c_str())) {
      for (const char* value : {"on", "off"})
        if (choice("lighting", value)) ask(panel, "lighting", value);
      ImGui::EndCombo();
    }
  }
  ImGui::TextDisabled("the data set is opened anew");
}

void show_display(Panel& panel) {
  show_coupling(panel);
  if (panel.pipeline() == scene::Pipeline::kPoints) {
    setting_list(panel, "splat", splat::kernel_names());
    show_finish(panel);
    const std::string shown = fmt::format("at most %.2f, now {:.2f}", panel.figures().frame.drawn.detail);
    setting_slider(panel, "detail", Look::kLeastDetail, 1, shown.c_str());
  }
  if (!panel.setup().transparent && panel.pipeline() != scene::Pipeline::kPictures) show_background(panel);
}

void show_sampling(Panel& panel) {
  const auto& f = panel.figures().session;
  setting_list(panel, "sampling-size", kSizes);
  if (panel.value("sampling-size") == "auto") setting_slider(panel, "least-sampling", 0.1, 1, "%.2f of a pixel");
  row("now");
  text(f.sampled_width > 0 ? fmt::format("{} x {}", f.sampled_width, f.sampled_height) : "-");
}

void show_over_the_picture(Panel& panel) {
  for (const char* name : {"axes", "scale", "cursor", "fps", "legend"}) {
    if (name[0] != 'a') ImGui::SameLine();
    setting_box(panel, name);
  }
}

void show_stereo(Panel& panel) {
  setting_list(panel, "stereo", stereo::mode_names());
  setting_slider(panel, "eye-separation", 0, 0.2, "%.3f m");
  setting_slider(panel, "screen-distance", 0, 5, "%.2f m");
  setting_box(panel, "swap-eyes");
}

void show_samplers(Panel& panel, SettingsViewState& state) {
  int here = 0;
  if (panel.status())
    for (const auto& p : panel.status()->processes) here += p.role == "sampler" && p.alive;
  int wanted = state.samplers.value_or(here);
  setting_row("samplers");
  if (seen("slider", "samplers",
           ImGui::SliderInt("##samplers", &wanted, 1, std::max(8, here), "%d", ImGuiSliderFlags_None)))
    state.samplers = wanted;
  if (!ImGui::IsItemDeactivatedAfterEdit()) return;
  ask(panel, "samplers", fmt::format("{}", within(wanted, 1, kMostSamplers)));
  state.samplers.reset();
}

}  // namespace telesplat::viewer
