#include "client/displays/window/panel/gui/open_view.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <algorithm>
#include <filesystem>

#include "client/displays/window/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

std::string size_text(uint64_t bytes) {
  return bytes < 10'000'000 ? fmt::format("{} kB", (bytes + 999) / 1000) : fmt::format("{} MB", bytes / 1'000'000);
}

// Returns the person's choice in a folder's list; empty: there is no choice.
std::string show_entries(const FileList::Listing& listing) {
  std::string chosen;
  if (!listing.problem.empty()) ImGui::TextWrapped("%s", listing.problem.c_str());
  if (choice("file", "..")) chosen = std::filesystem::path(listing.folder).parent_path().string();
  for (const auto& entry : listing.entries) {
    const std::string name = entry.folder ? entry.name + "/" : entry.name;
    if (choice("file", name)) chosen = listing.folder + "/" + entry.name;
    if (entry.folder) continue;
    const std::string size = size_text(entry.bytes);
    ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize(size.c_str()).x);
    ImGui::TextDisabled("%s", size.c_str());
  }
  if (!listing.whole) ImGui::TextDisabled("... and more: type the path");
  return chosen;
}

bool is_folder(const FileList::Listing& listing, const std::string& path) {
  const std::string name = std::filesystem::path(path).filename();
  const auto found =
      std::find_if(listing.entries.begin(), listing.entries.end(), [&](const auto& e) { return e.name == name; });
  return found == listing.entries.end() || found->folder;
}

}  // namespace

void show_open(OpenViewState& state, bool can_close, const std::function<void(const std::string&)>& open) {
  if (!state.shown) return;
  if (!state.begun) {
    state.begun = true;
    state.files.go("");
  }
  const ImVec2 window = ImGui::GetIO().DisplaySize;
  const float letter = ImGui::GetFontSize();
  const ImVec2 size(std::min(letter * 44, window.x), std::min(letter * 34, window.y));
  ImGui::SetNextWindowPos({(window.x - size.x) / 2, (window.y - size.y) / 2});
  ImGui::SetNextWindowSize(size);
  std::string chosen;
  bool opens = false;
  if (ImGui::Begin("Open a data set", can_close ? &state.shown : nullptr,
                   ImGuiWindowFlags_NoMove | ImGuiWindowFlags_NoResize | ImGuiWindowFlags_NoCollapse |
                       ImGuiWindowFlags_NoSavedSettings)) {
    dialog("Open", can_close ? &state.shown : nullptr);
    ImGui::TextDisabled("a mesh, a volume, a folder of slices, or julia; files can be dropped on the window too");
    ImGui::SetNextItemWidth(-letter * 9);
    // Takes the focus unless the panel has it.
    const bool has_focus = ImGui::IsWindowFocused(ImGuiFocusedFlags_RootAndChildWindows) ||
                           !ImGui::IsWindowFocused(ImGuiFocusedFlags_AnyWindow);
    if (ImGui::IsWindowAppearing() || (has_focus && !ImGui::IsAnyItemActive() && !ImGui::IsMouseDown(0)))
      ImGui::SetKeyboardFocusHere();
    const bool entered = ImGui::InputTextWithHint("##path", "path", &state.path, ImGuiInputTextFlags_EnterReturnsTrue);
    seen("text", "path", ImGui::IsItemEdited() || entered);
    ImGui::SameLine();
    if ((button("open") || entered) && !state.path.empty()) chosen = state.path, opens = true;
    ImGui::SameLine();
    if (button("julia")) chosen = "julia", opens = true;
    const auto listing = state.files.listing();
    if (listing && !listing->recent.empty()) {
      text("opened of late");
      ImGui::BeginChild("recent", {0, letter * 8}, true);
      for (const auto& path : listing->recent)
        if (choice("recent", path)) chosen = path, opens = true;
      ImGui::EndChild();
    }
    text(state.files.busy() ? "reading ..." : listing ? listing->folder : "");
    ImGui::BeginChild("files", {0, 0}, true);
    if (listing)
      if (const std::string path = show_entries(*listing); !path.empty()) {
        if (path == std::filesystem::path(listing->folder).parent_path().string() || is_folder(*listing, path)) {
          state.files.go(path);
          state.path = path;
        } else {
          chosen = path, opens = true;
        }
      }
    ImGui::EndChild();
  }
  ImGui::End();
  if (!opens) return;
  state.shown = false;
  open(chosen);
}

}  // namespace telesplat::viewer
