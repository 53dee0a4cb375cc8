#include "client/displays/window/panel/gui/notes_view.h"

#include <fmt/format.h>
#include <imgui.h>
#include <imgui_stdlib.h>

#include <utility>

#include "client/displays/window/panel/gui/panel_view.h"
#include "client/displays/window/panel/gui/widgets.h"

namespace telesplat::viewer {
namespace {

constexpr double kLookAgain_s = 2;  // other people may change the book, too

bool line_with_button(const std::string& line, const char* label) {
  text(line);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::GetFontSize() * 4);
  return small_button(label);
}

void typed(const char* name, const char* what, std::string& into) {
  ImGui::InputTextWithHint(fmt::format("##{}", name).c_str(), what, &into);
  seen("text", name, ImGui::IsItemEdited());
}

void wrapped(const std::string& line) {
  ImGui::PushTextWrapPos(0);
  text(line);
  ImGui::PopTextWrapPos();
}

// Returns true if the place is to be removed.
bool show_place(const Measurements& measurements, const Measurements::Row& row, size_t index) {
  const Measurements::Place& place = row[index];
  const bool gone = small_button(fmt::format("remove {}", place.number).c_str());
  ImGui::SameLine();
  wrapped(scene::place_text(measurements.placement(), place.told.data));
  if (place.told.error)
    text(fmt::format("within {:.2g} {}", *place.told.error, measurements.placement().unit));
  else
    wrapped(place.asked.empty() ? "an estimate: " + place.told.estimate : "asking the data server");
  if (const std::string value = scene::value_text(place.told); !value.empty()) wrapped(value);
  if (const std::string between = measurements.between(row, index); !between.empty()) wrapped(between);
  return gone;
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

void show_measurements(Measurements& measurements, const std::function<void()>& save) {
  if (!section("Measurements", false)) return;
  if (measurements.empty()) return text("key X measures the place under the cursor");
  uint64_t gone = 0;
  for (const auto& row : measurements.rows()) {
    for (size_t i = 0; i < row.size(); ++i)
      if (show_place(measurements, row, i)) gone = row[i].number;
    ImGui::Separator();
  }
  if (button("new row")) measurements.begin_row();
  hint("the next place is not joined to the last one");
  ImGui::SameLine();
  if (button("save as CSV")) save();
  ImGui::SameLine();
  if (button("remove all")) measurements.clear();
  if (gone > 0)
    if (const Status s = measurements.remove(gone); !s) return;
}

}  // namespace telesplat::viewer
