#include "services/data/vtk/legacy_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <map>

#include "services/data/base/text_scanner.h"
#include "services/data/vtk/cell_faces.h"

namespace telesplat::data::vtk {
namespace {

std::string upper(std::string_view text) {
  std::string out(text);
  std::transform(out.begin(), out.end(), out.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return out;
}

// "%20" in names of arrays.
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

  Result<DataSet> read() {
    in_.next_line();
    in_.next_line();  // the title
    const std::string encoding = word();
    if (encoding != "ASCII" && encoding != "BINARY") return fail("is neither ASCII nor BINARY");
    binary_ = encoding == "BINARY";
    if (word() != "DATASET") return fail("has no DATASET");
    kind_ = word();
    for (const char* known : {"STRUCTURED_POINTS", "STRUCTURED_GRID", "RECTILINEAR_GRID"})
      set_.structured = set_.structured || kind_ == known;
    if (!set_.structured && kind_ != "POLYDATA" && kind_ != "UNSTRUCTURED_GRID")
      return fail(fmt::format("is a data set of kind {}, which is not read", kind_));
    set_.image = kind_ == "STRUCTURED_POINTS";
    while (in_.skip_space())
      if (const Status s = section(word()); !s) return s.error();
    return finish();
  }

 private:
  Error fail(const std::string& what) const {
    return Error{fmt::format("{}: {} (line {})", set_.name, what, binary_ ? 0 : in_.line_number())};
  }

  std::string_view raw_word() {
    in_.skip_space();
    return in_.word();
  }
  std::string word() { return upper(raw_word()); }
  bool count(int64_t& out) { return in_.skip_space() && in_.integer(out) && out >= 0; }

  Status section(const std::string& key) {
    if (key == "DIMENSIONS") return dimensions();
    if (key == "ORIGIN") return three(3);
    if (key == "SPACING" || key == "ASPECT_RATIO") return three(0);
    if (key == "POINTS") return points();
    if (key.size() == 13 && key.ends_with("_COORDINATES") && key[0] >= 'X' && key[0] <= 'Z')
      return axis(size_t(key[0] - 'X'));
    if (key == "VERTICES") return poly_cells(0);
    if (key == "LINES") return poly_cells(1);
    if (key == "POLYGONS") return poly_cells(2);
    if (key == "TRIANGLE_STRIPS") return poly_cells(3);
    if (key == "CELLS") return cells(cells_);
    if (key == "CELL_TYPES") return cell_types();
    if (key == "POINT_DATA" || key == "CELL_DATA") return begin_data(key == "CELL_DATA");
    if (key == "METADATA") return metadata();
    if (key == "FIELD") return field();
    return attribute(key);
  }

  Status dimensions() {
    for (size_t a = 0; a < 3; ++a) {
      int64_t side = 0;
      if (!count(side)) return fail("its DIMENSIONS are no numbers");
      set_.extent[2 * a] = 0, set_.extent[2 * a + 1] = side - 1;
    }
    return check_extent(set_.extent, content_.size(), set_.name);
  }

  // ORIGIN into column 3 of the placement, SPACING onto its diagonal.
  Status three(int column) {
    for (int a = 0; a < 3; ++a) {
      double value = 0;
      if (!in_.skip_space() || !in_.number(value)) return fail("its ORIGIN or SPACING is no numbers");
      set_.index_to_data[column == 3 ? 3 : a][a] = value;
    }
    return ok_status();
  }

  bool type_of(const std::string& name, StoredType& out) const {
    static const std::map<std::string, StoredType> kTypes = {{"CHAR", StoredType::kI8},
                                                             {"SIGNED_CHAR", StoredType::kI8},
                                                             {"UNSIGNED_CHAR", StoredType::kU8},
                                                             {"SHORT", StoredType::kI16},
                                                             {"UNSIGNED_SHORT", StoredType::kU16},
                                                             {"INT", StoredType::kI32},
                                                             {"UNSIGNED_INT", StoredType::kU32},
                                                             {"LONG", StoredType::kI64},
                                                             {"UNSIGNED_LONG", StoredType::kU64},
                                                             {"LONG_LONG", StoredType::kI64},
                                                             {"UNSIGNED_LONG_LONG", StoredType::kU64},
                                                             {"VTKTYPEINT64", StoredType::kI64},
                                                             {"VTKTYPEUINT64", StoredType::kU64},
                                                             {"VTKIDTYPE", StoredType::kI32},
                                                             {"FLOAT", StoredType::kF32},
                                                             {"DOUBLE", StoredType::kF64}};
    const auto found = kTypes.find(name);
    if (found != kTypes.end()) out = found->second;
    return found != kTypes.end();
  }

  // `what` names it in errors.
  Result<Array> values(StoredType type, uint64_t count, const std::string& what) {
    Array out;
    out.type = type;
    const uint64_t there = content_.size() - in_.offset(), size = stored_bytes(type);
    if (count > there || (binary_ && count * size > there))
      return fail(fmt::format("claims {} {} in a file of {} bytes", count, what, content_.size()));
    if (binary_) {
      in_.next_line();
      const size_t at = in_.offset();
      if (count * size > content_.size() - at) return fail(fmt::format("is cut off in its {} {}", count, what));
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
    out.own(count);
    const bool read = with_type(type, [&](auto v) {
      for (uint64_t i = 0; i < count; ++i) {
        std::conditional_t<std::is_floating_point_v<decltype(v)>, double, int64_t> value{};
        if (!in_.skip_space() || !in_.value(value)) return false;
        v = static_cast<decltype(v)>(value);
        std::memcpy(out.owned.data() + i * sizeof v, &v, sizeof v);
      }
      return true;
    });
    if (!read) return fail(fmt::format("its {} {} end too early or are no numbers", count, what));
    return out;
  }

  Result<Array> typed(uint64_t count, const std::string& what) {
    StoredType type{};
    const std::string name = word();
    if (!type_of(name, type)) return fail(fmt::format("its {} are of type {}", what, name));
    return values(type, count, what);
  }

  Status points() {
    int64_t n = 0;
    if (!count(n)) return fail("its number of POINTS is no number");
    if (uint64_t(n) > content_.size())
      return fail(fmt::format("claims {} POINTS in a file of {} bytes", n, content_.size()));
    auto read = typed(3 * uint64_t(n), "POINTS");
    if (!read) return read.error();
    set_.points = std::move(*read);
    set_.points.components = 3;
    return ok_status();
  }

  Status axis(size_t a) {
    int64_t n = 0;
    if (!count(n) || n != set_.side(a))
      return fail(fmt::format("has {} coordinates on an axis of {}", n, set_.side(a)));
    auto read = typed(uint64_t(n), "coordinates");
    if (!read) return read.error();
    set_.axes[a] = std::move(*read);
    return ok_status();
  }

  // "N SIZE" and a list of counts and points; since version 5 "OFFSETS" and "CONNECTIVITY" behind N + 1 and SIZE.
  Status cells(Cells& out) {
    if (set_.structured) return fail("has cells of its own, which a structured data set has not");
    int64_t n = 0, size = 0;
    if (!count(n) || !count(size)) return fail("its number of cells is no number");
    if (uint64_t(n) > content_.size() || uint64_t(size) > content_.size())
      return fail(
          fmt::format("claims {} POLYGONS or CELLS of {} numbers in a file of {} bytes", n, size, content_.size()));
    const TextScanner before = in_;
    Result<Cells> made = Cells{};
    if (word() == "OFFSETS") {
      const auto ends = typed(uint64_t(n), "OFFSETS");
      if (!ends) return ends.error();
      if (word() != "CONNECTIVITY") return fail("has OFFSETS without CONNECTIVITY");
      const auto ids = typed(uint64_t(size), "CONNECTIVITY");
      if (!ids) return ids.error();
      made = make_cells(*ids, *ends, true, ~uint32_t{0}, set_.name);
    } else {
      in_ = before;
      const auto list = values(StoredType::kI32, uint64_t(size), "numbers of cells");
      if (!list) return list.error();
      made = make_listed_cells(*list, size_t(n), set_.name);
    }
    if (!made) return made.error();
    out = std::move(*made);
    return ok_status();
  }

  Status poly_cells(size_t kind) { return cells(of_poly_[kind]); }

  Status cell_types() {
    if (set_.structured) return fail("has CELL_TYPES, which a structured data set has not");
    int64_t n = 0;
    if (!count(n)) return fail("its number of CELL_TYPES is no number");
    const auto types = values(StoredType::kI32, uint64_t(n), "CELL_TYPES");
    if (!types) return types.error();
    set_.types = types_of(*types);
    return ok_status();
  }

  Status begin_data(bool of_cells) {
    int64_t n = 0;
    if (!count(n)) return fail("its amount of data is no number");
    if (uint64_t(n) > content_.size())
      return fail(
          fmt::format("claims {} {} in a file of {} bytes", n, of_cells ? "CELL_DATA" : "POINT_DATA", content_.size()));
    tuples_ = uint64_t(n);
    data_ = of_cells ? &set_.cell_data : &set_.point_data;
    return ok_status();
  }

  // Ends at an empty line.
  Status metadata() {
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
    return ok_status();
  }

  Array* take(Array array, std::string_view name, size_t components) {
    array.name = decoded(name);
    array.components = components;
    if (!data_) return nullptr;
    data_->arrays.push_back(std::move(array));
    return last_ = &data_->arrays.back();
  }

  Status skip_strings(uint64_t strings) {
    in_.next_line();
    for (uint64_t i = 0; i < strings && !in_.at_end(); ++i) {
      if (!binary_) {
        in_.next_line();
        continue;
      }
      // Two bits tell in how many bytes the length is written.
      const auto first = static_cast<unsigned char>(content_[in_.offset()]);
      const size_t more = first >> 6 == 3 ? 0 : first >> 6 == 2 ? 1 : first >> 6 == 1 ? 3 : 7;
      uint64_t length = first & 63;
      for (size_t b = 1; b <= more && in_.offset() + b < content_.size(); ++b)
        length = length << 8 | static_cast<unsigned char>(content_[in_.offset() + b]);
      in_.skip(1 + more);
      in_.skip(length);
    }
    return ok_status();
  }

  Status field() {
    raw_word();
    int64_t arrays = 0;
    if (!count(arrays)) return fail("the number of a FIELD's arrays is no number");
    for (int64_t i = 0; i < arrays && in_.skip_space(); ++i) {
      const std::string_view name = raw_word();
      if (name == "METADATA") {
        if (const Status s = metadata(); !s) return s;
        --i;
        continue;
      }
      if (name == "NULL_ARRAY") continue;
      int64_t components = 0, tuples = 0;
      if (!count(components) || !count(tuples))
        return fail(fmt::format("array {} of a FIELD has no size", decoded(name)));
      if (components > 1 << 16 || uint64_t(tuples) > content_.size())
        return fail(fmt::format("claims {} x {} values of {}", components, tuples, decoded(name)));
      const uint64_t all = uint64_t(components) * uint64_t(tuples);
      const TextScanner before = in_;
      const std::string type = word();
      if (type == "STRING" || type == "UTF8_STRING" || type == "BIT") {
        if (const Status s = type == "BIT" ? skip_bits(all) : skip_strings(all); !s) return s;
        continue;
      }
      in_ = before;
      auto read = typed(all, "values of " + decoded(name));
      if (!read) return read.error();
      if (components > 0 && data_ && uint64_t(tuples) == tuples_) take(std::move(*read), name, size_t(components));
    }
    return ok_status();
  }

  Status skip_bits(uint64_t bits) {
    if (!binary_) return values(StoredType::kI32, bits, "bits") ? ok_status() : fail("its bits end too early");
    return values(StoredType::kU8, (bits + 7) / 8, "bits") ? ok_status() : fail("its bits end too early");
  }

  Status attribute(const std::string& key) {
    if (key == "SCALARS") return scalars();
    if (key == "COLOR_SCALARS") return colour_scalars();
    if (key == "LOOKUP_TABLE") {
      raw_word();
      int64_t n = 0;
      if (!count(n)) return fail("a LOOKUP_TABLE has no size");
      const auto table = values(binary_ ? StoredType::kU8 : StoredType::kF32, 4 * uint64_t(n), "colours of a table");
      return table ? ok_status() : Status(table.error());
    }
    const bool texture = key == "TEXTURE_COORDINATES";
    const size_t components = key == "VECTORS" || key == "NORMALS"                                  ? 3
                              : key == "TENSORS"                                                    ? 9
                              : key == "TENSORS6"                                                   ? 6
                              : key == "GLOBAL_IDS" || key == "PEDIGREE_IDS" || key == "EDGE_FLAGS" ? 1
                                                                                                    : 0;
    if (components == 0 && !texture) return fail(fmt::format("{} is no keyword that is known", key.substr(0, 40)));
    const std::string_view name = raw_word();
    int64_t dimension = int64_t(components);
    if (texture && (!count(dimension) || dimension < 1 || dimension > 3))
      return fail("TEXTURE_COORDINATES have no dimension");
    auto read = typed(uint64_t(dimension) * tuples_, "values of " + decoded(name));
    if (!read) return read.error();
    const Array* array = take(std::move(*read), name, size_t(dimension));
    if (array && key == "NORMALS" && data_->normals.empty()) data_->normals = array->name;
    return ok_status();
  }

  // "SCALARS name type [components]", and mostly "LOOKUP_TABLE name" behind it.
  Status scalars() {
    const std::string_view name = raw_word();
    const std::string_view type_text = raw_word();
    StoredType type{};
    const bool bits = upper(type_text) == "BIT";
    if (!bits && !type_of(upper(type_text), type))
      return fail(fmt::format("its SCALARS {} are of type {}", decoded(name), type_text));
    int64_t components = 1;
    if (in_.skip_blanks() && !in_.integer(components)) return fail("the number of SCALARS' components is no number");
    if (components < 1 || components > 1 << 16) return fail(fmt::format("its SCALARS have {} components", components));
    TextScanner before = in_;
    in_.next_line();
    if (word() == "LOOKUP_TABLE")
      raw_word();
    else
      in_ = before;
    if (bits) return skip_bits(uint64_t(components) * tuples_);
    auto read = values(type, uint64_t(components) * tuples_, "values of " + decoded(name));
    if (!read) return read.error();
    const Array* array = take(std::move(*read), name, size_t(components));
    if (array && data_->scalars.empty()) data_->scalars = array->name;
    return ok_status();
  }

  // Bytes in binary files, fractions in text.
  Status colour_scalars() {
    const std::string_view name = raw_word();
    int64_t components = 0;
    if (!count(components) || components < 1 || components > 4) return fail("COLOR_SCALARS have 1 to 4 components");
    auto read = values(binary_ ? StoredType::kU8 : StoredType::kF32, uint64_t(components) * tuples_,
                       "values of " + decoded(name));
    if (!read) return read.error();
    if (!binary_) {
      Array bytes;
      bytes.type = StoredType::kU8;
      bytes.own(read->values);
      for (size_t i = 0; i < bytes.values; ++i)
        bytes.owned[i] = std::byte(std::clamp(read->at(i), 0.0, 1.0) * 255 + 0.5);
      *read = std::move(bytes);
    }
    const Array* array = take(std::move(*read), name, size_t(components));
    if (array && data_->scalars.empty()) data_->scalars = array->name;
    return ok_status();
  }

  Result<DataSet> finish() {
    if (set_.structured && kind_ != "STRUCTURED_GRID") set_.points = {};
    if (set_.structured && set_.side(0) < 1) return fail("has no DIMENSIONS");
    if (kind_ == "STRUCTURED_GRID" && set_.points.tuples() != set_.point_count())
      return fail(fmt::format("has {} POINTS for its DIMENSIONS of {}", set_.points.tuples(), set_.point_count()));
    for (size_t a = 0; a < 3 && kind_ == "RECTILINEAR_GRID"; ++a)
      if (int64_t(set_.axes[a].values) != set_.side(a)) return fail("coordinates of an axis are missing");
    constexpr uint8_t kTypes[] = {kPolyVertex, kPolyLine, kPolygon, kStrip};
    for (size_t i = 0; i < 4; ++i) append_cells(std::move(of_poly_[i]), kTypes[i], set_);
    if (kind_ == "UNSTRUCTURED_GRID") {
      if (set_.types.size() != cells_.size())
        return fail(fmt::format("has {} CELL_TYPES for {} CELLS", set_.types.size(), cells_.size()));
      set_.cells = std::move(cells_);
      if (const Status s = take_polyhedra(); !s) return s.error();
    }
    const size_t points = set_.point_count();
    if (const Status s = check_ids(set_.cells.points, points, set_.name); !s) return s.error();
    if (const Status s = check_ids(set_.faces.points, points, set_.name); !s) return s.error();
    drop_misfits(set_.point_data, points);
    drop_misfits(set_.cell_data, set_.cell_count());
    return std::move(set_);
  }

  static void drop_misfits(Attributes& data, size_t tuples) {
    std::erase_if(data.arrays, [&](const Array& a) { return a.tuples() != tuples; });
  }

  // Their "points" are a stream of faces, which become their points as well.
  Status take_polyhedra() {
    if (std::find(set_.types.begin(), set_.types.end(), kPolyhedron) == set_.types.end()) return ok_status();
    Cells kept;
    set_.face_begins.assign(1, 0);
    for (size_t cell = 0; cell < set_.types.size(); ++cell) {
      const auto points = set_.cells[cell];
      if (set_.types[cell] != kPolyhedron)
        kept.points.insert(kept.points.end(), points.begin(), points.end());
      else if (const Status s = add_face_stream(points, set_); !s)
        return s;
      kept.begins.push_back(kept.points.size());
      set_.face_begins.push_back(set_.faces.size());
    }
    set_.cells = std::move(kept);
    return ok_status();
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
  Array* last_ = nullptr;  // what METADATA belong to
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

Result<DataSet> read_legacy(std::string_view content, const std::string& name, bool values) {
  return Parser(content, name, values).read();
}

}  // namespace telesplat::data::vtk
