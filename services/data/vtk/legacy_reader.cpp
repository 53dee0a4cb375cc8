#include "services/data/vtk/files.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "services/data/vtk/cells.h"

namespace telesplat::data::vtk {
namespace {

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return out;
}

// Decodes "%20" in names of arrays.
std::string decoded(std::string_view name) {
  std::string out;
  for (size_t i = 0; i < name.size(); ++i) {
    unsigned value = 0;
    const bool coded = name[i] == '%' && i + 2 < name.size() &&
                       std::from_chars(name.data() + i + 1, name.data() + i + 3, value, 16).ptr == name.data() + i + 3;
    out += coded ? char(value) : name[i];
    if (coded) i += 2;
  }
  return out;
}

class Parser {
 public:
  Parser(std::string_view content, const std::string& name, bool values)
      : content_(content), in_(content), read_values_(values) {
    set_.name = name;
  }

  DataSet read() {
    in_.next_line();
    in_.next_line();  // the title
    const std::string encoding = word();
    if (encoding != "ASCII" && encoding != "BINARY") fail("is neither ASCII nor BINARY");
    binary_ = encoding == "BINARY";
    if (word() != "DATASET") fail("has no DATASET");
    kind_ = word();
    for (const char* known : {"STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID"})
      set_.structured = set_.structured || kind_ == known;
    if (!set_.structured && kind_ != "POLYDATA" && kind_ != "UNSTRUCTURED_GRID")
      fail("is a data set of kind {}, which is not read", kind_);
    set_.image = kind_ == "STRUCTURED_POINTS";
    while (in_.skip_space()) section(word());
    return finish();
  }

 private:
  template <class... Given>
  [[noreturn]] void fail(fmt::format_string<Given...> what, Given&&... given) const {
    refuse("{}: {} (line {})", set_.name, fmt::format(what, std::forward<Given>(given)...),
           binary_ ? 0 : in_.line_number());
  }

  std::string_view raw_word() {
    in_.skip_space();
    return in_.word();
  }
  std::string word() { return upper(raw_word()); }
  // Reads a number >= 0. what: the counted things, for errors.
  uint64_t count(const char* what) {
    int64_t out = -1;
    if (!in_.skip_space() || !in_.integer(out) || out < 0) fail("its number of {} is no number", what);
    return uint64_t(out);
  }
  // Reads a number that the file's size allows.
  uint64_t claim(const char* what) {
    const uint64_t out = count(what);
    if (out > content_.size()) fail("claims {} {} in a file of {} bytes", out, what, content_.size());
    return out;
  }

  void section(const std::string& key) {
    if (key == "DIMENSIONS") return dimensions();
    if (key == "ORIGIN") return three(3);
    if (key == "SPACING" || key == "ASPECT_RATIO") return three(0);
    if (key == "POINTS") return points();
    if (key.size() == 13 && key.ends_with("_COORDINATES") && key[0] >= 'X' && key[0] <= 'Z')
      return axis(size_t(key[0] - 'X'));
    if (key == "VERTICES") return cells(of_poly_[0]);
    if (key == "LINES") return cells(of_poly_[1]);
    if (key == "POLYGONS") return cells(of_poly_[2]);
    if (key == "TRIANGLE_STRIPS") return cells(of_poly_[3]);
    if (key == "CELLS") return cells(cells_);
    if (key == "CELL_TYPES") return cell_types();
    if (key == "POINT_DATA" || key == "CELL_DATA") return begin_data(key == "CELL_DATA");
    if (key == "METADATA") return metadata();
    if (key == "FIELD") return field();
    return attribute(key);
  }

  void dimensions() {
    for (size_t a = 0; a < 3; ++a) set_.extent[2 * a] = 0, set_.extent[2 * a + 1] = int64_t(count("DIMENSIONS")) - 1;
    check_extent(set_.extent, content_.size(), set_.name);
  }

  // Reads ORIGIN into column 3 of the placement, SPACING onto its diagonal.
  void three(int column) {
    for (int a = 0; a < 3; ++a) {
      double value = 0;
      if (!in_.skip_space() || !in_.number(value)) fail("its ORIGIN or SPACING is no numbers");
      set_.index_to_data[column == 3 ? 3 : a][a] = value;
    }
  }

  bool type_of(const std::string& name, StoredType& out) const {
    using enum StoredType;
    constexpr TypeName kTypes[] = {{"CHAR", kI8},
                                   {"SIGNED_CHAR", kI8},
                                   {"UNSIGNED_CHAR", kU8},
                                   {"SHORT", kI16},
                                   {"UNSIGNED_SHORT", kU16},
                                   {"INT", kI32},
                                   {"UNSIGNED_INT", kU32},
                                   {"LONG", kI64},
                                   {"UNSIGNED_LONG", kU64},
                                   {"LONG_LONG", kI64},
                                   {"UNSIGNED_LONG_LONG", kU64},
                                   {"VTKTYPEINT64", kI64},
                                   {"VTKTYPEUINT64", kU64},
                                   {"VTKIDTYPE", kI32},
                                   {"FLOAT", kF32},
                                   {"DOUBLE", kF64}};
    const auto found = type_named(name, kTypes);
    out = found.value_or(out);
    return found.has_value();
  }

  // Reads an array's values. `what` names it in errors.
  Array values(StoredType type, uint64_t count, const std::string& what) {
    Array out;
    out.type = type;
    const uint64_t there = content_.size() - in_.offset(), size = stored_bytes(type);
    if (count > there || (binary_ && count * size > there))
      fail("claims {} {} in a file of {} bytes", count, what, content_.size());
    if (binary_) {
      in_.next_line();
      const size_t at = in_.offset();
      if (count * size > content_.size() - at) fail("is cut off in its {} {}", count, what);
      out.data = reinterpret_cast<const std::byte*>(content_.data()) + at;
      out.values = count;
      in_.skip(count * size);
      if (std::endian::native == std::endian::little && count > 0 && read_values_) out.swap_bytes();
      return out;
    }
    if (!read_values_) {
      for (uint64_t i = 0; i < count && in_.skip_space(); ++i) in_.word();
      out.values = count;
      return out;
    }
    out.owned.reserve(count * size);
    parse_numbers(in_, count, out);
    if (out.values < count) fail("its {} {} end too early or are no numbers", count, what);
    return out;
  }

  Array typed(uint64_t count, const std::string& what) {
    StoredType type{};
    const std::string name = word();
    if (!type_of(name, type)) fail("its {} are of type {}", what, name);
    return values(type, count, what);
  }

  void points() {
    set_.points = typed(3 * claim("POINTS"), "POINTS");
    set_.points.components = 3;
  }

  void axis(size_t a) {
    const uint64_t n = count("coordinates");
    if (n != uint64_t(set_.side(a))) fail("has {} coordinates on an axis of {}", n, set_.side(a));
    set_.axes[a] = typed(n, "coordinates");
  }

  // Reads "N SIZE" and a list of counts and points; since version 5 "OFFSETS" and "CONNECTIVITY" follow N + 1 and SIZE.
  void cells(Cells& out) {
    if (set_.structured) fail("has cells of its own, which a structured data set has not");
    const uint64_t n = claim("POLYGONS or CELLS"), size = claim("numbers of POLYGONS or CELLS");
    const TextScanner before = in_;
    if (word() == "OFFSETS") {
      const Array ends = typed(n, "OFFSETS");
      if (word() != "CONNECTIVITY") fail("has OFFSETS without CONNECTIVITY");
      out = make_cells(typed(size, "CONNECTIVITY"), ends, true, ~uint32_t{0}, set_.name);
    } else {
      in_ = before;
      out = make_listed_cells(values(StoredType::kI32, size, "numbers of cells"), n, set_.name);
    }
  }

  void cell_types() {
    if (set_.structured) fail("has CELL_TYPES, which a structured data set has not");
    set_.types = types_of(values(StoredType::kI32, count("CELL_TYPES"), "CELL_TYPES"));
  }

  void begin_data(bool of_cells) {
    tuples_ = claim(of_cells ? "CELL_DATA" : "POINT_DATA");
    data_ = of_cells ? &set_.cell_data : &set_.point_data;
  }

  // Reads METADATA up to an empty line.
  void metadata() {
    in_.next_line();
    std::string_view name, line;
    do {
      const size_t begin = in_.offset();
      in_.next_line();
      line = content_.substr(begin, in_.offset() - begin);
      while (!line.empty() && static_cast<unsigned char>(line.back()) <= ' ') line.remove_suffix(1);
      if (line.starts_with("NAME ")) name = line;
      if (line.starts_with("DATA ") && name.starts_with("NAME UNITS_LABEL ") && last_)
        last_->unit = decoded(line.substr(5));
    } while (!line.empty() && !in_.at_end());
  }

  // active: the attribute that this array's name is set to if it is the first of its kind.
  void take(Array array, std::string_view name, size_t components, std::string Attributes::*active = nullptr) {
    array.name = decoded(name);
    array.components = components;
    if (!data_) return;
    data_->arrays.push_back(std::move(array));
    last_ = &data_->arrays.back();
    if (active && (data_->*active).empty()) data_->*active = last_->name;
  }

  void skip_strings(uint64_t strings) {
    in_.next_line();
    for (uint64_t i = 0; i < strings && !in_.at_end(); ++i) {
      if (!binary_) {
        in_.next_line();
        continue;
      }
      // Two bits give the number of bytes in which the length is written.
      const auto first = static_cast<unsigned char>(content_[in_.offset()]);
      const size_t more = first >> 6 == 3 ? 0 : first >> 6 == 2 ? 1 : first >> 6 == 1 ? 3 : 7;
      uint64_t length = first & 63;
      for (size_t b = 1; b <= more && in_.offset() + b < content_.size(); ++b)
        length = length << 8 | static_cast<unsigned char>(content_[in_.offset() + b]);
      in_.skip(1 + more);
      in_.skip(length);
    }
  }

  void field() {
    raw_word();
    for (uint64_t left = count("a FIELD's arrays"); left > 0 && in_.skip_space(); --left) {
      const std::string_view name = raw_word();
      if (name == "METADATA") {
        metadata();
        ++left;
        continue;
      }
      if (name == "NULL_ARRAY") continue;
      const uint64_t components = count("components"), tuples = count("tuples");
      if (components > 1 << 16 || tuples > content_.size())
        fail("claims {} x {} values of {}", components, tuples, decoded(name));
      const uint64_t all = components * tuples;
      const TextScanner before = in_;
      const std::string type = word();
      if (type == "BIT") {
        skip_bits(all);
      } else if (type == "STRING" || type == "UTF8_STRING") {
        skip_strings(all);
      } else {
        in_ = before;
        Array read = typed(all, "values of " + decoded(name));
        if (components > 0 && tuples == tuples_) take(std::move(read), name, components);
      }
    }
  }

  void skip_bits(uint64_t bits) {
    values(binary_ ? StoredType::kU8 : StoredType::kI32, binary_ ? (bits + 7) / 8 : bits, "bits");
  }

  void attribute(const std::string& key) {
    if (key == "SCALARS") return scalars();
    if (key == "COLOR_SCALARS") return colour_scalars();
    if (key == "LOOKUP_TABLE") {
      raw_word();
      values(binary_ ? StoredType::kU8 : StoredType::kF32, 4 * claim("colours"), "colours of a table");
      return;
    }
    const bool texture = key == "TEXTURE_COORDINATES";
    uint64_t components = key == "VECTORS" || key == "NORMALS"                                  ? 3
                          : key == "TENSORS"                                                    ? 9
                          : key == "TENSORS6"                                                   ? 6
                          : key == "GLOBAL_IDS" || key == "PEDIGREE_IDS" || key == "EDGE_FLAGS" ? 1
                                                                                                : 0;
    if (components == 0 && !texture) fail("{} is no keyword that is known", key.substr(0, 40));
    const std::string_view name = raw_word();
    if (texture) components = count("TEXTURE_COORDINATES' dimensions");
    if (components < 1 || components > 9) fail("{} have {} components", key, components);
    take(typed(components * tuples_, "values of " + decoded(name)), name, components,
         key == "NORMALS" ? &Attributes::normals : nullptr);
  }

  // Reads "SCALARS name type [components]", and mostly "LOOKUP_TABLE name" after it.
  void scalars() {
    const std::string_view name = raw_word();
    const std::string_view type_text = raw_word();
    StoredType type{};
    const bool bits = upper(type_text) == "BIT";
    if (!bits && !type_of(upper(type_text), type)) fail("its SCALARS {} are of type {}", decoded(name), type_text);
    int64_t components = 1;
    if (in_.skip_blanks() && !in_.integer(components)) fail("the number of SCALARS' components is no number");
    if (components < 1 || components > 1 << 16) fail("its SCALARS have {} components", components);
    TextScanner before = in_;
    in_.next_line();
    if (word() == "LOOKUP_TABLE")
      raw_word();
    else
      in_ = before;
    if (bits) return skip_bits(uint64_t(components) * tuples_);
    take(values(type, uint64_t(components) * tuples_, "values of " + decoded(name)), name, size_t(components),
         &Attributes::scalars);
  }

  // Reads COLOR_SCALARS: bytes in binary files, fractions in text.
  void colour_scalars() {
    const std::string_view name = raw_word();
    const uint64_t components = count("COLOR_SCALARS' components");
    if (components < 1 || components > 4) fail("COLOR_SCALARS have 1 to 4 components");
    Array read =
        values(binary_ ? StoredType::kU8 : StoredType::kF32, components * tuples_, "values of " + decoded(name));
    if (!binary_) {
      Array bytes;
      bytes.type = StoredType::kU8;
      bytes.own(read.values);
      for (size_t i = 0; i < bytes.values; ++i)
        bytes.owned[i] = std::byte(std::clamp(read.at(i), 0.0, 1.0) * 255 + 0.5);
      read = std::move(bytes);
    }
    take(std::move(read), name, components, &Attributes::scalars);
  }

  DataSet finish() {
    if (set_.structured && kind_ != "STRUCTURED_GRID") set_.points = {};
    if (set_.structured && set_.side(0) < 1) fail("has no DIMENSIONS");
    if (kind_ == "STRUCTURED_GRID" && set_.points.tuples() != set_.point_count())
      fail("has {} POINTS for its DIMENSIONS of {}", set_.points.tuples(), set_.point_count());
    for (size_t a = 0; a < 3 && kind_ == "RECTILINEAR_GRID"; ++a)
      if (int64_t(set_.axes[a].values) != set_.side(a)) fail("coordinates of an axis are missing");
    constexpr uint8_t kTypes[] = {kPolyVertex, kPolyLine, kPolygon, kStrip};
    for (size_t i = 0; i < 4; ++i) append_cells(std::move(of_poly_[i]), kTypes[i], set_);
    if (kind_ == "UNSTRUCTURED_GRID") {
      if (set_.types.size() != cells_.size()) fail("has {} CELL_TYPES for {} CELLS", set_.types.size(), cells_.size());
      set_.cells = std::move(cells_);
      take_polyhedra();
    }
    const size_t points = set_.point_count();
    check_ids(set_.cells.points, points, set_.name);
    check_ids(set_.faces.points, points, set_.name);
    drop_misfits(set_.point_data, points);
    drop_misfits(set_.cell_data, set_.cell_count());
    return std::move(set_);
  }

  static void drop_misfits(Attributes& data, size_t tuples) {
    std::erase_if(data.arrays, [&](const Array& a) { return a.tuples() != tuples; });
  }

  // The "points" of polyhedra are a stream of faces; the points of these become the polyhedra's points as well.
  void take_polyhedra() {
    if (std::find(set_.types.begin(), set_.types.end(), kPolyhedron) == set_.types.end()) return;
    Cells kept;
    set_.face_begins.assign(1, 0);
    for (size_t cell = 0; cell < set_.types.size(); ++cell) {
      const bool polyhedron = set_.types[cell] == kPolyhedron;
      if (polyhedron) add_face_stream(set_.cells[cell], set_);
      kept.add(polyhedron ? std::span<const uint32_t>() : set_.cells[cell]);
      set_.face_begins.push_back(set_.faces.size());
    }
    set_.cells = std::move(kept);
  }

  std::string_view content_;
  TextScanner in_;
  DataSet set_;
  bool binary_ = false;
  const bool read_values_;
  std::string kind_;
  Cells cells_, of_poly_[4];  // vertices, lines, polygons, strips: the order of their data
  uint64_t tuples_ = 0;
  Attributes* data_ = nullptr;
  Array* last_ = nullptr;  // the array that METADATA belong to
};

}  // namespace

std::string legacy_kind(std::string_view content) {
  if (!content.starts_with("# vtk DataFile")) return {};
  TextScanner in(content.substr(0, 4096));
  in.next_line();
  in.next_line();
  for (std::string word; in.skip_space();) {
    word = upper(in.word());
    if (word == "DATASET") return in.skip_space() ? upper(in.word()) : "";
  }
  return {};
}

DataSet read_legacy(std::string_view content, const std::string& name, bool values) {
  return Parser(content, name, values).read();
}

}  // namespace telesplat::data::vtk
