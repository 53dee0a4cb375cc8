// Parses NRRD headers: "field: value" lines up to an empty one. https://teem.sourceforge.net/nrrd/format.html
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

using enum StoredType;
constexpr TypeName kNrrdTypes[] = {
    {"char", kI8},      {"int8", kI8},    {"uchar", kU8},      {"uint8", kU8},   {"short", kI16}, {"int16", kI16},
    {"ushort", kU16},   {"uint16", kU16}, {"int", kI32},       {"int32", kI32},  {"uint", kU32},  {"uint32", kU32},
    {"longlong", kI64}, {"int64", kI64},  {"ulonglong", kU64}, {"uint64", kU64}, {"float", kF32}, {"double", kF64}};

// Normalises names of types: "unsigned short int" is ushort, "signed char" char, "int8_t" int8.
std::optional<StoredType> type_of(std::string name) {
  if (name.ends_with(" int")) name.resize(name.size() - 4);
  if (name.ends_with("_t")) name.resize(name.size() - 2);
  if (name.starts_with("unsigned ")) name = "u" + name.substr(9);
  if (name.starts_with("signed ")) name.erase(0, 7);
  std::erase(name, ' ');
  return type_named(name, kNrrdTypes);
}

// The fields, by lower-case names without blanks, and the offset of the data: after the first empty line.
struct NrrdLines {
  Fields fields;
  std::vector<std::string> files;  // after "data file: LIST"
  bool ct = false;
  bool ended = false;  // by an empty line
  size_t data_at = 0;
};

NrrdLines split(std::string_view content) {
  NrrdLines out;
  bool listed = false;
  size_t at = content.find('\n');
  while (at != content.npos && at + 1 < content.size()) {
    const size_t begin = at + 1;
    at = content.find('\n', begin);
    const std::string_view line = trim(content.substr(begin, (at == content.npos ? content.size() : at) - begin));
    if (line.empty()) {
      out.ended = at != content.npos;
      out.data_at = at == content.npos ? content.size() : at + 1;
      return out;
    }
    if (line.front() == '#') continue;
    const size_t colon = line.find(':');
    if (listed) {
      if (out.files.size() < kMostFiles) out.files.emplace_back(line);
      continue;
    }
    if (colon == line.npos) continue;
    if (line.substr(colon).starts_with(":=")) {  // key/value pairs
      out.ct |=
          lower(line.substr(0, colon)).find("modality") != std::string::npos && trim(line.substr(colon + 2)) == "CT";
      continue;
    }
    std::string name = lower(line.substr(0, colon));
    std::erase(name, ' ');
    listed = name == "datafile" && trim(line.substr(colon + 1)).starts_with("LIST");
    out.fields.emplace(std::move(name), trim(line.substr(colon + 1)));
  }
  return out;
}

// Parses one vector per axis, "(a,b,c)" or "none"; a "none" becomes an empty vector.
std::optional<std::vector<std::vector<double>>> vectors(std::string_view text) {
  std::vector<std::vector<double>> out;
  for (text = trim(text); !text.empty() && out.size() < 16; text = trim(text)) {
    if (text.starts_with("none")) {
      out.emplace_back();
      text.remove_prefix(4);
      continue;
    }
    const size_t end = text.find(')');
    if (text.front() != '(' || end == text.npos) return std::nullopt;
    const auto inside = numbers(text.substr(1, end - 1), true);
    if (!inside || inside->size() != 3) return std::nullopt;
    out.push_back(*inside);
    text.remove_prefix(end + 1);
  }
  return out;
}

glm::dvec3 to_vec(const std::vector<double>& v) { return {v[0], v[1], v[2]}; }

// True for spaces with left-handed axes, which would show a body's mirror image.
bool left_handed(std::string_view space) {
  const std::string name = lower(space);
  return name == "left-anterior-superior" || name == "las" || name == "left-anterior-superior-time" || name == "last" ||
         name == "3d-left-handed" || name == "3d-left-handed-time";
}

// Returns the space of a name; a left-handed space mirrored at x is the right-handed one.
scene::Space space_named(std::string_view space) {
  const std::string name = lower(space);
  for (const char* lps : {"left-posterior-superior", "lps", "left-posterior-superior-time", "lpst"})
    if (name == lps) return scene::Space::kLps;
  for (const char* ras : {"right-anterior-superior", "ras", "right-anterior-superior-time", "rast",
                          "left-anterior-superior", "las", "left-anterior-superior-time", "last"})
    if (name == ras) return scene::Space::kRas;
  return scene::Space::kPlain;
}

// True if the samples of an axis stand at nodes: "cell node ???", one word per axis.
bool at_nodes(std::string_view centers, size_t axis) {
  for (; axis > 0; --axis) centers = trim(centers.substr(std::min(centers.find(' '), centers.size())));
  return centers.starts_with("node");
}

// Returns directions and origin of the three kept axes.
glm::dmat4 placement_of(const Fields& fields, const std::vector<size_t>& axes, const std::vector<int64_t>& sizes,
                        const std::string& path) {
  const size_t dimension = sizes.size();
  std::array<glm::dvec3, 3> step{glm::dvec3(1, 0, 0), glm::dvec3(0, 1, 0), glm::dvec3(0, 0, 1)};
  glm::dvec3 origin(0);
  bool placed = false;
  if (const auto text = field(fields, {"spacedirections"}); !text.empty()) {
    const auto all = vectors(text);
    if (!all || all->size() != dimension)
      refuse("{}: its space directions are {}, not {} vectors of 3 numbers", path, in_quotes(text), dimension);
    for (size_t a = 0; a < 3; ++a)
      if (!(*all)[axes[a]].empty()) step[a] = to_vec((*all)[axes[a]]);
    placed = true;
  } else if (const auto spacings = field(fields, {"spacings"}); !spacings.empty()) {
    const auto all = numbers(spacings);
    if (!all || all->size() != dimension)
      refuse("{}: its spacings are {}, not {} numbers", path, in_quotes(spacings), dimension);
    for (size_t a = 0; a < 3; ++a)
      if (const double s = (*all)[axes[a]]; !std::isnan(s)) step[a] *= s;
    placed = true;
  }
  const auto mins = numbers(field(fields, {"axismins"})), maxs = numbers(field(fields, {"axismaxs"}));
  if (!placed && mins && maxs && mins->size() == dimension && maxs->size() == dimension)
    for (size_t a = 0; a < 3; ++a) {
      // From the first sample's edge to the last one's; for samples at nodes, from the first sample to the last.
      const double lo = (*mins)[axes[a]], span = (*maxs)[axes[a]] - lo, n = double(sizes[axes[a]]);
      if (!std::isfinite(lo) || !(std::abs(span) > 0)) continue;
      const bool nodes = at_nodes(field(fields, {"centers", "centerings"}), axes[a]) && n > 1;
      step[a] *= span / (nodes ? n - 1 : n);
      origin[int(a)] = lo + (nodes ? 0 : span / n / 2);
    }
  if (const auto text = field(fields, {"spaceorigin"}); !text.empty()) {
    const auto all = vectors(text);
    if (!all || all->size() != 1 || all->front().empty())
      refuse("{}: its space origin is {}, not a vector of 3 numbers", path, in_quotes(text));
    origin = to_vec(all->front());
  }
  glm::dmat4 m = placement(step[0], step[1], step[2], origin);
  if (left_handed(field(fields, {"space"})))
    for (int c = 0; c < 4; ++c) m[c][0] = -m[c][0];
  return m;
}

// Returns the three axes of the volume; further axes may have length one.
std::vector<size_t> choose_axes(const std::vector<int64_t>& sizes, const std::string& path) {
  std::vector<size_t> axes;
  for (size_t a = 0; a < sizes.size(); ++a) axes.push_back(a);
  for (size_t a = sizes.size(); a-- > 0 && axes.size() > 3;)
    if (sizes[a] == 1) axes.erase(axes.begin() + ptrdiff_t(a));
  if (axes.size() == 3) return axes;
  std::string text;
  for (const int64_t n : sizes) text += fmt::format("{}{}", text.empty() ? "" : " x ", n);
  if (axes.size() < 3) refuse("{}: has {} axes ({}); a volume has 3", path, sizes.size(), text);
  refuse(
      "{}: has {} axes ({}): several components a voxel, or time steps; a volume has 3 axes and one "
      "component (a series is a folder of numbered files)",
      path, sizes.size(), text);
}

// Reads encoding and byte order of the voxels.
void read_encoding(const Fields& fields, const std::string& path, VolumeFileHeader& h) {
  const std::string encoding = lower(field(fields, {"encoding"}));
  if (encoding == "raw")
    h.encoding = Encoding::kRaw;
  else if (encoding == "gzip" || encoding == "gz")
    h.encoding = Encoding::kGzip;
  else if (encoding == "text" || encoding == "txt" || encoding == "ascii")
    h.encoding = Encoding::kText;
  else
    refuse("{}: its encoding is {}; supported are raw, gzip and text", path, in_quotes(encoding));
  const std::string endian = lower(field(fields, {"endian"}));
  if (stored_bytes(h.stored) > 1 && h.encoding != Encoding::kText && endian != "little" && endian != "big")
    refuse("{}: its endian is {}, neither little nor big", path, in_quotes(endian));
  h.big_endian = endian == "big";
}

// Finds the file and offset of the voxels.
void find_data(const NrrdLines& lines, const std::string& path, VolumeFileHeader& h) {
  const Fields& fields = lines.fields;
  const std::string_view data = field(fields, {"datafile"});
  if (data.empty() && !lines.ended) refuse("{}: its header does not end (no empty line) and names no data file", path);
  // "LIST [DIM]" and names, or "PATTERN FIRST LAST STEP [DIM]"; DIM is redundant: all files have equally many voxels.
  if (take_files(data, lines.files, path, h)) return;
  h.data_path = data.empty() ? path : beside(path, data);
  h.data_at = data.empty() ? lines.data_at : 0;
}

// Reads the numbers of lines and bytes to skip at a file's beginning.
void read_skips(const Fields& fields, const std::string& path, VolumeFileHeader& h) {
  const auto skipped = [&](std::initializer_list<const char*> names) {
    const auto text = field(fields, names);
    return text.empty() ? std::optional(0.0) : number(text);
  };
  const auto line_skip = skipped({"lineskip"}), byte_skip = skipped({"byteskip"});
  if (!line_skip || !(*line_skip >= 0 && *line_skip <= 1e6) || *line_skip != std::floor(*line_skip))
    refuse("{}: skips {} lines of its data, limit 1e6", path, in_quotes(field(fields, {"lineskip"})));
  h.line_skip = uint32_t(*line_skip);
  if (!byte_skip || *byte_skip < -1 || *byte_skip > 1e15 || *byte_skip != std::floor(*byte_skip) ||
      (*byte_skip < 0 && h.encoding != Encoding::kRaw))
    refuse("{}: skips {} bytes of its data", path, in_quotes(field(fields, {"byteskip"})));
  if (*byte_skip < 0)
    h.data_at_end = true;
  else
    (h.encoding == Encoding::kGzip ? h.skip_unpacked : h.data_at) += uint64_t(*byte_skip);
}

VolumeFileHeader parse_lines(std::string_view content, const std::string& path) {
  if (content.size() < 9 || !content.starts_with("NRRD000"))
    refuse("{}: is no NRRD file: it does not begin with NRRD000", path);
  if (content[7] < '1' || content[7] > '5')
    refuse("{}: is NRRD version {}, known are 1 to 5", path, in_quotes(content.substr(4, 4)));
  const NrrdLines lines = split(content);
  const Fields& fields = lines.fields;
  VolumeFileHeader h;
  h.format = "nrrd";
  h.ct = lines.ct;

  const std::string type = lower(field(fields, {"type"}));
  const auto stored = type_of(type);
  if (!stored) refuse("{}: its voxels' type is {}; {}", path, in_quotes(type), kSupportedTypes);
  h.stored = *stored;

  const auto dimension = number(field(fields, {"dimension"}));
  const auto sizes = whole_numbers(field(fields, {"sizes"}));
  if (!dimension || !sizes || double(sizes->size()) != *dimension || sizes->size() > 16)
    refuse("{}: its sizes are {} with dimension {}", path, in_quotes(field(fields, {"sizes"})),
           in_quotes(field(fields, {"dimension"})));
  const auto axes = choose_axes(*sizes, path);
  for (size_t a = 0; a < 3; ++a) h.size[a] = (*sizes)[axes[a]];
  h.index_to_data = placement_of(fields, axes, *sizes, path);
  h.space = space_named(field(fields, {"space"}));
  // "mm" "mm" "mm": the first one counts, as scanners' axes have one unit.
  if (const auto units = field(fields, {"spaceunits"}); units.starts_with('"'))
    h.unit = units.substr(1, std::min(units.find('"', 1) - 1, size_t{16}));

  read_encoding(fields, path, h);
  find_data(lines, path, h);
  read_skips(fields, path, h);
  return h;
}

}  // namespace

Result<VolumeFileHeader> parse_nrrd(std::string_view content, const std::string& path) {
  return or_error([&] { return parse_lines(content, path); });
}

}  // namespace telesplat::data
