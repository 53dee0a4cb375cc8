#include "client/displays/window/panel/gui/notes_view.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <utility>

#include "client/displays/window/panel/gui/setting_rows.h"
#include "client/displays/window/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

constexpr double kLookAgain_s = 2;  // others may keep something, too

bool line_with_button(const std::string& line, const char* label) {
  text(line);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::GetFontSize() * 4);
  return small_button(label);
}

void typed(const char* name, const char* what, std::string& into) {
  ImGui::InputTextWithHint(fmt::format("##{}", name).c_str(), what, &into);
  seen("text", name, ImGui::IsItemEdited());
}

}  // namespace

NotesWish show_notes(const notes::Book* book, NotesViewState& state, bool picked, double now_s) {
  NotesWish out;
  if (!section("Bookmarks and notes", false)) return out;
  if (now_s - state.looked_s > kLookAgain_s) {
    state.looked_s = now_s;
    out.look = true;
  }
  setting_row("bookmarks");
  typed("bookmark", "name", state.name);
  if (button("keep this view")) out.keep = true, out.name = std::exchange(state.name, {});
  for (size_t i = 0; book && i < book->bookmarks.size(); ++i) {
    ImGui::PushID(int(i));
    if (small_button("go")) out.go = book->bookmarks[i].name;
    ImGui::SameLine();
    if (line_with_button(book->bookmarks[i].name, "remove")) out.remove = book->bookmarks[i].name;
    ImGui::PopID();
  }
  setting_row("notes");
  typed("note", "text", state.text);
  const bool adds = button("add");
  ImGui::SameLine();
  const bool adds_here = picked && button("add at the last pick");
  if (!picked) ImGui::TextDisabled("X picks a place for it");
  if ((adds || adds_here) && !state.text.empty()) out.text = std::exchange(state.text, {}), out.here = adds_here;
  for (size_t i = 0; book && i < book->notes.size(); ++i) {
    const auto& note = book->notes[i];
    ImGui::PushID(int(i) + 100'000);
    if (line_with_button(fmt::format("{}  {}", note.number, note.text), "take out")) out.remove_note = note.number;
    if (note.place)
      ImGui::TextDisabled("   at %.5g, %.5g, %.5g  %s", note.place->x, note.place->y, note.place->z,
                          note.value.c_str());
    ImGui::PopID();
  }
  return out;
}

}  // namespace telesplat::viewer
