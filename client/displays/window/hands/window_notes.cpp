#include "client/displays/window/hands/window_notes.h"

#include <utility>

namespace telesplat::viewer {

void WindowNotes::follow(const SceneTerms& terms, const geometry::Pose& head, const Measurements& places) {
  const NotesWish wish = std::exchange(wish_, {});
  if (wish.keep) bookmarks_.keep(shelf(terms), head, wish.name);
  if (!wish.go.empty()) bookmarks_.find(shelf(terms), wish.go);
  if (!wish.remove.empty()) bookmarks_.remove(shelf(terms), wish.remove);
  if (wish.remove_note > 0) bookmarks_.remove_note(shelf(terms), wish.remove_note);
  if (wish.look) bookmarks_.look(shelf(terms));
  if (wish.text.empty()) return;
  notes::Note note{.text = wish.text};
  if (wish.here && !places.empty()) {
    const scene::ToldPlace& newest = places.rows().back().back().told;
    note.place = newest.data;
    note.value = scene::value_text(newest);
  }
  bookmarks_.add(shelf(terms), note);
}

}  // namespace telesplat::viewer
