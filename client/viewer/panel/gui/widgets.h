// Small things that the parts of the panel share, between Dear ImGui's frames.
#pragma once

#include <cstdint>
#include <string>

#include <imgui.h>

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

inline bool section(const char* name, bool open) {
  return ImGui::CollapsingHeader(name, open ? ImGuiTreeNodeFlags_DefaultOpen : ImGuiTreeNodeFlags_None);
}

}  // namespace telesplat::viewer
