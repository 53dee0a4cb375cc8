// A book holds notes that people keep about a data set: bookmarks (views to come back to), and notes, some of them at a
// place. It is JSON beside the data set, for programs and people to read (docs/hands.md).
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/geometry/camera.h"

namespace telesplat::notes {

inline constexpr size_t kMaxBytes = 4 << 20;   ///< bytes a book's file may have
inline constexpr size_t kMostEntries = 10000;  ///< bookmarks and notes together
inline constexpr size_t kMaxName = 80, kMaxText = 4000;
inline constexpr int kMaxDepth = 32;       ///< lists and objects inside each other
inline constexpr size_t kMostKeys = 1000;  ///< keys an object may have

struct Bookmark {
  std::string name;  ///< one line of UTF-8, not empty; differs from that of every other bookmark
  geometry::Pose pose;
  std::string made_at;      ///< "2026-03-01T12:00:00Z"; empty: not known
  std::string others = {};  ///< keys of other programs: a JSON object; empty: there are no such keys
  bool operator==(const Bookmark&) const = default;
};

struct Note {
  uint64_t number = 0;              ///< from 1 on; no two notes share one
  std::string text;                 ///< UTF-8
  std::optional<glm::dvec3> place;  ///< in the data's own coordinates
  std::string value;  ///< the data's value there when it was written: "temperature 21.5 K"; empty: there was no value
  std::string made_at;
  std::string others = {};  ///< as Bookmark::others
  bool operator==(const Note&) const = default;
};

struct Book {
  std::vector<Bookmark> bookmarks;
  std::vector<Note> notes;
  std::string others = {};  ///< as Bookmark::others
  bool operator==(const Book&) const = default;

  const Bookmark* find(std::string_view name) const;
  /// Replaces the bookmark of the same name, and takes over its `others` if the new one has no such keys. Error: the
  /// name is not valid, or there are kMostEntries already.
  Status keep(Bookmark bookmark);
  /// Returns the number that the note got. Error: the text is empty or too long, or there are kMostEntries already.
  Result<uint64_t> add(Note note);
  /// Error: there is no such bookmark or note.
  Status remove_bookmark(std::string_view name);
  Status remove_note(uint64_t number);
};

std::string to_json(const Book& book);
/// The text comes from outside. Error: names what is wrong with it.
Result<Book> book_from_json(std::string_view text);

}  // namespace telesplat::notes
