// Small functions that the parts of the panel share, between Dear ImGui's frames. Every widget that a person can use
// goes through one of these, so that a WidgetLog lists it and tools/lab/monkey reaches it.
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>

#include <imgui.h>

#include "client/displays/window/panel/widget_log.h"

namespace telesplat::viewer {

inline ImU32 ink(uint32_t rgb, int alpha = 255) {
  return IM_COL32(int(rgb >> 16 & 255), int(rgb >> 8 & 255), int(rgb & 255), alpha);
}

inline void text(const std::string& line) { ImGui::TextUnformatted(line.data(), line.data() + line.size()); }

/// Shows a line while the pointer lies on the item before it.
inline void hint(const char* line) {
  if (!ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(ImGui::GetFontSize() * 20);
  ImGui::TextUnformatted(line);
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

/// Begins a row of a form: the name at the left; the next item fills the rest.
inline void row(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(name);
  ImGui::SameLine(ImGui::GetFontSize() * 7);
  ImGui::SetNextItemWidth(-1);
}

/// Returns the part of the window in which the next items can be seen.
inline WidgetLog::Rect visible_part() {
  const auto& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = list.GetClipRectMin(), to = list.GetClipRectMax();
  return {from.x, from.y, to.x, to.y};
}

/// Reports the item before it to the log, and returns `used`: Dear ImGui's result for it. kind: "slider", "number",
/// "text", "colour" and "plot" (dragged, clicked); buttons, boxes, lists and sections have functions below.
inline bool seen(const char* kind, const char* name, bool used) {
  if (auto* log = LoggedBuild::log()) {
    const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
    log->seen(kind, name, {from.x, from.y, to.x, to.y}, visible_part(), used);
  }
  return used;
}

struct PlotArea {
  ImVec2 from, size;
};
/// Makes an empty rectangle as wide as the panel that takes the pointer. height: in letters' heights.
inline PlotArea plot_area(const char* name, float height) {
  const PlotArea out{ImGui::GetCursorScreenPos(),
                     {std::max(40.0f, ImGui::GetContentRegionAvail().x), ImGui::GetFontSize() * height}};
  ImGui::InvisibleButton(name, out.size, ImGuiButtonFlags_MouseButtonLeft | ImGuiButtonFlags_MouseButtonRight);
  seen("plot", name, ImGui::IsItemActive());
  ImGui::GetWindowDrawList()->AddRectFilled(out.from, {out.from.x + out.size.x, out.from.y + out.size.y},
                                            ImGui::GetColorU32(ImGuiCol_FrameBg));
  return out;
}

inline bool button(const char* label) { return seen("button", label, ImGui::Button(label)); }
inline bool small_button(const char* label) { return seen("button", label, ImGui::SmallButton(label)); }
inline bool checkbox(const char* label, bool* on) { return seen("box", label, ImGui::Checkbox(label, on)); }

/// Begins a drop-down list; its name is hidden. True: it is open; add its choices, then call ImGui::EndCombo.
inline bool begin_list(const char* name, const char* shown) {
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const WidgetLog::Rect rect{from.x, from.y, from.x + ImGui::CalcItemWidth(), from.y + ImGui::GetFrameHeight()};
  const WidgetLog::Rect visible = visible_part();
  const bool open = ImGui::BeginCombo((std::string("##") + name).c_str(), shown);
  if (auto* log = LoggedBuild::log()) log->seen("list", name, rect, visible, open);
  return open;
}
/// Makes a line of the list with that name. The label may hold any text: Dear ImGui alone would cut it at "##", and
/// would end the program if it is empty.
inline bool choice(const char* list, const std::string& label, bool chosen = false) {
  ImGui::PushID(label.data(), label.data() + label.size());
  const bool used = ImGui::Selectable("##choice", chosen);
  ImGui::PopID();
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();
  ImGui::GetWindowDrawList()->AddText(
      {from.x + ImGui::GetStyle().ItemSpacing.x / 2, (from.y + to.y - ImGui::GetFontSize()) / 2},
      ImGui::GetColorU32(ImGuiCol_Text), label.data(), label.data() + label.size());
  return seen("choice", (std::string(list) + "=" + label).c_str(), used);
}

/// The next widgets lie in this section.
inline bool section(const char* name, bool open) {
  if (auto* log = LoggedBuild::log()) log->enter("panel");
  const bool shown = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
  seen("section", name, ImGui::IsItemToggledOpen());
  if (auto* log = LoggedBuild::log()) log->enter(name);
  return shown;
}

/// The next widgets lie in this dialog, whose ImGui::Begin came before. open: it has a button that closes it; false:
/// the button was pressed.
inline void dialog(const char* name, const bool* open) {
  if (!LoggedBuild::log()) return;
  LoggedBuild::log()->enter(name);
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();  // corners of the title
  if (open)
    LoggedBuild::log()->seen("button", "close", {to.x - (to.y - from.y), from.y, to.x, to.y}, {0, 0, 1e9f, 1e9f},
                             !*open);
}

}  // namespace telesplat::viewer
