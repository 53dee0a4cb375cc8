// Bookmarks and notes of a window's data set, and their part of the panel.
#pragma once

#include "client/displays/window/hands/bookmarks.h"
#include "client/displays/window/panel/gui/notes_view.h"
#include "client/viewer/hands/meaning.h"
#include "client/viewer/hands/measurements.h"

namespace telesplat::viewer {

/// Used by one thread, the display's.
class WindowNotes {
 public:
  /// tell: gets lines for the person, from any thread.
  explicit WindowNotes(std::function<void(const std::string&)> tell) : bookmarks_(std::move(tell)) {}

  /// Builds their part of the panel. picked: there is a picked place.
  void build(bool picked, double now_s) {
    const auto book = bookmarks_.book();
    wish_ = show_notes(book.get(), view_, picked, now_s);
  }
  /// Carries out the wishes that build() found. head: the view to keep.
  void follow(const SceneTerms& terms, const geometry::Pose& head, const Measurements& places);
  void keep(const SceneTerms& terms, const geometry::Pose& head) { bookmarks_.keep(shelf(terms), head); }
  void next(const SceneTerms& terms) { bookmarks_.next(shelf(terms)); }
  /// Returns the bookmark to go to, once.
  std::optional<notes::Bookmark> take_found() { return bookmarks_.take_found(); }
  /// Another data set is shown.
  void clear() { view_ = {}; }

 private:
  static notes::Shelf shelf(const SceneTerms& terms) {
    return notes::shelf_of(terms.data_file, terms.scene, notes::user_cache_folder());
  }

  Bookmarks bookmarks_;
  NotesViewState view_;
  NotesWish wish_;
};

}  // namespace telesplat::viewer
