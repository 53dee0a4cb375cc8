#include "client/notes/book.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/utf8.h"

namespace telesplat::notes {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kMark = "telesplat_notes";
constexpr int kVersion = 1;
constexpr double kFarthest = 1e300;

// True if the text is one line that a terminal may show.
bool is_line(std::string_view text, size_t most) {
  return !text.empty() && text.size() <= most && valid_utf8(text) &&
         std::none_of(text.begin(), text.end(), [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; });
}
bool is_text(std::string_view text) {
  return !text.empty() && text.size() <= kMaxText && valid_utf8(text) && text.find('\0') == text.npos;
}

// An entry of a list. what: "bookmark 3", for errors.
struct Entry {
  const Json& json;
  std::string what;

  Error wrong(const char* key, const std::string& must) const {
    return Error{fmt::format("{}: \"{}\" is not {}", what, key, must)};
  }
  Result<std::string> line(const char* key, size_t most, bool needed) const {
    const auto found = json.find(key);
    if (found == json.end() && !needed) return std::string();
    if (found == json.end() || !found->is_string()) return wrong(key, "a text");
    const auto& text = found->get_ref<const std::string&>();
    if ((needed || !text.empty()) && !is_line(text, most))
      return wrong(key, fmt::format("one line of at most {} bytes of UTF-8", most));
    return text;
  }
  Result<std::vector<double>> numbers(const char* key, size_t count) const {
    const auto found = json.find(key);
    std::vector<double> out;
    if (found != json.end() && found->is_array() && found->size() == count)
      for (const Json& v : *found)
        if (v.is_number() && std::abs(v.get<double>()) <= kFarthest) out.push_back(v.get<double>());
    if (out.size() != count) return wrong(key, fmt::format("{} numbers", count));
    return out;
  }
};

// Returns the keys that this program does not know, as JSON; empty: it knows all of them.
std::string others_of(const Json& json, std::initializer_list<std::string_view> known) {
  Json out = Json::object();
  for (const auto& [key, value] : json.items())
    if (std::find(known.begin(), known.end(), key) == known.end()) out[key] = value;
  return out.empty() ? std::string() : out.dump();
}

void add_others(Json& to, const std::string& others) {
  if (others.empty()) return;
  const Json read = Json::parse(others, nullptr, false);
  for (const auto& [key, value] : read.items())
    if (!to.contains(key)) to[key] = value;
}

Result<Bookmark> read_bookmark(const Entry& entry) {
  const auto name = entry.line("name", kMaxName, true);
  const auto made_at = entry.line("made_at", kMaxName, false);
  const auto p = entry.numbers("position", 3), q = entry.numbers("orientation", 4);
  if (!name) return name.error();
  if (!made_at) return made_at.error();
  if (!p) return p.error();
  if (!q) return q.error();
  geometry::Camera camera;
  camera.pose = {{(*p)[0], (*p)[1], (*p)[2]}, {(*q)[0], (*q)[1], (*q)[2], (*q)[3]}};
  if (const Status s = geometry::validate(camera); !s) return Error{entry.what + ": " + s.error().text};
  return Bookmark{*name, camera.pose, *made_at, others_of(entry.json, {"name", "position", "orientation", "made_at"})};
}

Result<Note> read_note(const Entry& entry) {
  Note out;
  const auto number = entry.json.find("number");
  if (number == entry.json.end() || !number->is_number_unsigned() || number->get<uint64_t>() == 0)
    return entry.wrong("number", "a whole number from 1 on");
  out.number = number->get<uint64_t>();
  const auto text = entry.json.find("text");
  if (text == entry.json.end() || !text->is_string() || !is_text(text->get_ref<const std::string&>()))
    return entry.wrong("text", fmt::format("a text of at most {} bytes of UTF-8", kMaxText));
  out.text = text->get<std::string>();
  if (entry.json.contains("place")) {
    const auto place = entry.numbers("place", 3);
    if (!place) return place.error();
    out.place = {(*place)[0], (*place)[1], (*place)[2]};
  }
  for (const auto& [key, to] : {std::pair{"value", &out.value}, {"made_at", &out.made_at}}) {
    const auto line = entry.line(key, kMaxText, false);
    if (!line) return line.error();
    *to = *line;
  }
  out.others = others_of(entry.json, {"number", "text", "place", "value", "made_at"});
  return out;
}

// Refuses a text that would cost too much to read as JSON. It runs before the parser, which keeps deep lists in memory,
// and searches all keys of an object for each key that it adds.
Status complain_about_shape(std::string_view text) {
  int depth = 0;
  size_t keys[kMaxDepth + 1] = {};
  for (size_t at = 0; at < text.size(); ++at) {
    const char c = text[at];
    if (c == '"') {
      while (++at < text.size() && text[at] != '"') at += text[at] == '\\';
    } else if (c == '{' || c == '[') {
      if (depth == kMaxDepth) return Error{fmt::format("lists and objects lie more than {} deep in each other", depth)};
      keys[++depth] = 0;
    } else if (c == '}' || c == ']') {
      if (--depth < 0) return Error{"is no JSON object"};
    } else if (c == ':' && ++keys[depth] > kMostKeys) {
      return Error{fmt::format("an object has more than {} keys", kMostKeys)};
    }
  }
  return ok_status();
}

// Calls read(entry) for each object of a list that may be absent.
template <class Read>
Status for_entries(const Json& json, const char* list, const char* name, const Read& read) {
  const auto found = json.find(list);
  if (found == json.end()) return ok_status();
  if (!found->is_array() || found->size() > kMostEntries)
    return Error{fmt::format("\"{}\" is no list of at most {} entries", list, kMostEntries)};
  for (size_t i = 0; i < found->size(); ++i) {
    const Entry entry{(*found)[i], fmt::format("{} {}", name, i + 1)};
    if (!entry.json.is_object()) return Error{entry.what + " is no object"};
    if (const Status s = read(entry); !s) return s;
  }
  return ok_status();
}

}  // namespace

const Bookmark* Book::find(std::string_view name) const {
  const auto found =
      std::find_if(bookmarks.begin(), bookmarks.end(), [&](const Bookmark& b) { return b.name == name; });
  return found == bookmarks.end() ? nullptr : &*found;
}

Status Book::keep(Bookmark bookmark) {
  if (!is_line(bookmark.name, kMaxName))
    return Error{fmt::format("a bookmark's name is one line of 1 to {} bytes of UTF-8", kMaxName)};
  if (const Bookmark* before = find(bookmark.name); before && bookmark.others.empty()) bookmark.others = before->others;
  std::erase_if(bookmarks, [&](const Bookmark& b) { return b.name == bookmark.name; });
  if (bookmarks.size() >= kMostEntries) return Error{fmt::format("{} bookmarks are kept at most", kMostEntries)};
  bookmarks.push_back(std::move(bookmark));
  return ok_status();
}

Result<uint64_t> Book::add(Note note) {
  if (!is_text(note.text)) return Error{fmt::format("a note is a text of 1 to {} bytes of UTF-8", kMaxText)};
  if (notes.size() >= kMostEntries) return Error{fmt::format("{} notes are kept at most", kMostEntries)};
  note.number = 1;
  for (const Note& n : notes) note.number = std::max(note.number, n.number + 1);
  notes.push_back(std::move(note));
  return notes.back().number;
}

Status Book::remove_bookmark(std::string_view name) {
  if (std::erase_if(bookmarks, [&](const Bookmark& b) { return b.name == name; }) > 0) return ok_status();
  return Error{fmt::format("there is no bookmark \"{}\"", name.substr(0, kMaxName))};
}

Status Book::remove_note(uint64_t number) {
  if (std::erase_if(notes, [&](const Note& n) { return n.number == number; }) > 0) return ok_status();
  return Error{fmt::format("there is no note {}", number)};
}

std::string to_json(const Book& book) {
  Json out{{kMark, kVersion}, {"bookmarks", Json::array()}, {"notes", Json::array()}};
  for (const Bookmark& b : book.bookmarks) {
    const auto& [p, q] = b.pose;
    Json entry{{"name", b.name}, {"position", {p.x, p.y, p.z}}, {"orientation", {q.w, q.x, q.y, q.z}}};
    if (!b.made_at.empty()) entry["made_at"] = b.made_at;
    add_others(entry, b.others);
    out["bookmarks"].push_back(std::move(entry));
  }
  for (const Note& n : book.notes) {
    Json entry{{"number", n.number}, {"text", n.text}};
    if (n.place) entry["place"] = {n.place->x, n.place->y, n.place->z};
    if (!n.value.empty()) entry["value"] = n.value;
    if (!n.made_at.empty()) entry["made_at"] = n.made_at;
    add_others(entry, n.others);
    out["notes"].push_back(std::move(entry));
  }
  add_others(out, book.others);
  return out.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

Result<Book> book_from_json(std::string_view text) {
  if (text.size() > kMaxBytes) return Error{fmt::format("{} bytes, limit {}", text.size(), kMaxBytes)};
  if (const Status s = complain_about_shape(text); !s) return s.error();
  const Json json = Json::parse(text, nullptr, false);
  if (!json.is_object()) return Error{"is no JSON object, or is cut off"};
  const auto version = json.find(kMark);
  if (version == json.end() || !version->is_number_integer())
    return Error{fmt::format("has no \"{}\": it is no file of notes", kMark)};
  if (*version != kVersion)
    return Error{fmt::format("\"{}\" is {}, this program knows {}", kMark, version->dump(), kVersion)};
  Book out;
  std::set<std::string> names;
  std::set<uint64_t> numbers;
  Status s = for_entries(json, "bookmarks", "bookmark", [&](const Entry& entry) -> Status {
    auto read = read_bookmark(entry);
    if (!read) return read.error();
    if (!names.insert(read->name).second) return Error{entry.what + " has the name of another one"};
    out.bookmarks.push_back(*std::move(read));
    return ok_status();
  });
  if (!s) return s.error();
  s = for_entries(json, "notes", "note", [&](const Entry& entry) -> Status {
    auto read = read_note(entry);
    if (!read) return read.error();
    if (!numbers.insert(read->number).second) return Error{entry.what + " has the number of another one"};
    out.notes.push_back(*std::move(read));
    return ok_status();
  });
  if (!s) return s.error();
  out.others = others_of(json, {kMark, "bookmarks", "notes"});
  return out;
}

}  // namespace telesplat::notes
