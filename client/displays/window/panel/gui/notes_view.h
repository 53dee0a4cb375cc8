// The parts of the panel that show what is kept beside the data set, bookmarks and notes, and measurements.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "client/notes/book.h"
#include "client/viewer/hands/measurements.h"

namespace telesplat::viewer {

/// What the person wants of it, once: at most one of these.
struct NotesWish {
  bool keep = false, look = false;
  std::string name;        ///< of keep; empty: a new one
  std::string go, remove;  ///< a bookmark's name
  std::string text;        ///< of a new note
  bool here = false;       ///< the note is about what was picked last
  uint64_t remove_note = 0;
};

struct NotesViewState {
  std::string name, text;  ///< as they are typed
  double looked_s = -1e9;
};

/// book: null: not read, or it cannot be. picked: something was picked, so a note can be about it.
NotesWish show_notes(const notes::Book* book, NotesViewState& state, bool picked, double now_s);

/// Builds the list of measurements, between Dear ImGui's frames. save: writes the table to a file.
void show_measurements(Measurements& measurements, const std::function<void()>& save);

}  // namespace telesplat::viewer
