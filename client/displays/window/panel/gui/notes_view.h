// Parts of the panel: bookmarks and notes, which are kept beside the data set, and measurements.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/notes/book.h"
#include "client/viewer/hands/measurements.h"

namespace telesplat::viewer {

/// The person's wish, returned once: at most one of these.
struct NotesWish {
  bool keep = false, look = false;
  std::string name;        ///< for keep; empty: a new name
  std::string go, remove;  ///< a bookmark's name
  std::string text;        ///< a new note's text
  bool here = false;       ///< the note is about the place picked last
  uint64_t remove_note = 0;
};

struct NotesViewState {
  std::string name, text;  ///< as typed
  double looked_s = -1e9;
};

/// book: null: not read yet, or it cannot be read. picked: there is a picked place, so a note can be about it.
NotesWish show_notes(const notes::Book* book, NotesViewState& state, bool picked, double now_s);

/// Builds the list of measurements, between Dear ImGui's frames. save: writes the table to a file.
void show_measurements(Measurements& measurements, const std::function<void()>& save);

}  // namespace telesplat::viewer
