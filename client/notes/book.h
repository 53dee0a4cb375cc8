// What people keep about a data set: views they want to come back to, and notes, some of them at a place. Kept as JSON
// beside the data set, for programs and people to read (docs/hands.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::notes {

inline constexpr size_t kMaxBytes = 4 << 20;   ///< of a book's file
inline constexpr size_t kMostEntries = 10000;  ///< bookmarks, and notes
inline constexpr size_t kMaxName = 80, kMaxText = 4000;
inline constexpr int kMaxDepth = 32;       ///< of lists and objects in each other
inline constexpr size_t kMostKeys = 1000;  ///< of an object

struct Bookmark {
  std::string name;  ///< one line of UTF-8, not empty; one a book
  geometry::Pose pose;
  std::string made_at;      ///< "2026-03-01T12:00:00Z"; empty: not known
  std::string others = {};  ///< what other programs keep with it: a JSON object; empty: nothing
  bool operator==(const Bookmark&) const = default;
};

struct Note {
  uint64_t number = 0;              ///< from 1 on; one a book
  std::string text;                 ///< UTF-8
  std::optional<glm::dvec3> place;  ///< in the data's own coordinates
  std::string value;                ///< what was there, as it was told: "temperature 21.5 K"; empty: nothing was
  std::string made_at;
  std::string others = {};  ///< as a bookmark's
  bool operator==(const Note&) const = default;
};

struct Book {
  std::vector<Bookmark> bookmarks;
  std::vector<Note> notes;
  std::string others = {};  ///< as a bookmark's
  bool operator==(const Book&) const = default;

  const Bookmark* find(std::string_view name) const;
  /// In place of one that has this name, whose `others` it gets unless it has some. Error: a name that is none, too
  /// many.
  Status keep(Bookmark bookmark);
  /// Returns the number that the note got. Error: no text, too long, too many.
  Result<uint64_t> add(Note note);
  /// Error: there is none.
  Status remove_bookmark(std::string_view name);
  Status remove_note(uint64_t number);
};

std::string to_json(const Book& book);
/// Error: what is wrong with it; it comes from outside.
Result<Book> book_from_json(std::string_view text);

}  // namespace telesplat::notes
