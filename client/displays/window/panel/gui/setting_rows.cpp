#include "client/displays/window/panel/gui/setting_rows.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "client/displays/window/panel/gui/widgets.h"
#include "common/core/check.h"
#include "common/core/within.h"
#include "common/scene/settings.h"

namespace telesplat::viewer {
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

}  // namespace telesplat::viewer
