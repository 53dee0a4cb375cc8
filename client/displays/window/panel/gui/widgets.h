// Small things that the parts of the panel share, between Dear ImGui's frames. Every widget that a person can use goes
// through one of these functions, so that a WidgetLog lists it and tools/lab/monkey reaches it.
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

/// Tells of the item before it while the pointer lies on that.
inline void hint(const char* line) {
  if (!ImGui::IsItemHovered()) return;
  ImGui::BeginTooltip();
  ImGui::PushTextWrapPos(ImGui::GetFontSize() * 20);
  ImGui::TextUnformatted(line);
  ImGui::PopTextWrapPos();
  ImGui::EndTooltip();
}

/// A row of a form: the name at the left, then what the next item fills.
inline void row(const char* name) {
  ImGui::AlignTextToFramePadding();
  ImGui::TextUnformatted(name);
  ImGui::SameLine(ImGui::GetFontSize() * 7);
  ImGui::SetNextItemWidth(-1);
}

/// What of the window shows the items that come next.
inline WidgetLog::Rect visible_part() {
  const auto& list = *ImGui::GetWindowDrawList();
  const ImVec2 from = list.GetClipRectMin(), to = list.GetClipRectMax();
  return {from.x, from.y, to.x, to.y};
}

/// Tells the log of the item before it, and returns `used`: what Dear ImGui's function returned for it. kind: "slider",
/// "number", "text", "colour" and "plot" (dragged, clicked); buttons, boxes, lists and sections have functions below.
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
/// An empty rectangle as wide as the panel that takes the pointer. height: in letters' heights.
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

/// A list that drops down, its name hidden. True: it is open, its choices come next, and ImGui::EndCombo after them.
inline bool begin_list(const char* name, const char* shown) {
  const ImVec2 from = ImGui::GetCursorScreenPos();
  const WidgetLog::Rect rect{from.x, from.y, from.x + ImGui::CalcItemWidth(), from.y + ImGui::GetFrameHeight()};
  const WidgetLog::Rect visible = visible_part();
  const bool open = ImGui::BeginCombo((std::string("##") + name).c_str(), shown);
  if (auto* log = LoggedBuild::log()) log->seen("list", name, rect, visible, open);
  return open;
}
/// A line that can be chosen, of the list with that name. The label is shown as it is, whatever it holds: Dear ImGui
/// takes "##" for the end of one, and ends the program at an empty one.
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

/// The widgets that come next lie in this section.
inline bool section(const char* name, bool open) {
  if (auto* log = LoggedBuild::log()) log->enter("panel");
  const bool shown = ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
  seen("section", name, ImGui::IsItemToggledOpen());
  if (auto* log = LoggedBuild::log()) log->enter(name);
  return shown;
}

/// The widgets that come next lie in this dialog, whose ImGui::Begin came before. open: it has a button that closes it,
/// which was pressed if it is false.
inline void dialog(const char* name, const bool* open) {
  if (!LoggedBuild::log()) return;
  LoggedBuild::log()->enter(name);
  const ImVec2 from = ImGui::GetItemRectMin(), to = ImGui::GetItemRectMax();  // of the title
  if (open)
    LoggedBuild::log()->seen("button", "close", {to.x - (to.y - from.y), from.y, to.x, to.y}, {0, 0, 1e9f, 1e9f},
                             !*open);
}

}  // namespace telesplat::viewer
