// Parses MetaImage headers: "Key = value" lines up to ElementDataFile, the last key.
// https://itk.org/Wiki/ITK/MetaIO/Documentation
#include <fmt/format.h>

#include <algorithm>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

using enum StoredType;
constexpr TypeName kTypes[] = {{"MET_CHAR", kI8},    {"MET_UCHAR", kU8},   {"MET_SHORT", kI16},
                               {"MET_USHORT", kU16}, {"MET_INT", kI32},    {"MET_UINT", kU32},
                               {"MET_LONG", kI32},   {"MET_ULONG", kU32},  {"MET_LONG_LONG", kI64},
                               {"MET_FLOAT", kF32},  {"MET_DOUBLE", kF64}, {"MET_ULONG_LONG", kU64}};

bool is_true(std::string_view text) { return !text.empty() && (text[0] == 'T' || text[0] == 't' || text[0] == '1'); }

// Returns one number per axis; `otherwise` if the key is missing.
std::vector<double> per_axis(const Fields& keys, std::initializer_list<const char*> names, size_t count,
                             std::vector<double> otherwise, const std::string& path) {
  const std::string_view text = field(keys, names);
  if (text.empty()) return otherwise;
  const auto all = numbers(text);
  if (!all || all->size() < count)
    refuse("{}: its {} is {}, not {} numbers", path, *names.begin(), in_quotes(text), count);
  return *all;
}

// The lines up to ElementDataFile; local data begin after it.
struct Lines {
  Fields keys;
  std::vector<std::string> files;  // after "ElementDataFile = LIST"
  size_t data_at = 0;
};
Lines read_lines(std::string_view content, const std::string& path) {
  Lines lines;
  for (size_t begin = 0; begin < content.size();) {
    const size_t end = std::min(content.find('\n', begin), content.size());
    const std::string_view line = content.substr(begin, end - begin);
    begin = end + 1;
    const size_t equals = line.find('=');
    if (equals == line.npos) {
      if (trim(line).empty()) continue;
      refuse("{}: its header has a line without \"=\": {}", path, in_quotes(line));
    }
    const std::string_view key = trim(line.substr(0, equals));
    lines.keys.emplace(std::string(key), trim(line.substr(equals + 1)));
    lines.data_at = begin;
    if (key != "ElementDataFile") continue;
    for (std::string_view rest = content.substr(std::min(begin, content.size()));
         field(lines.keys, {"ElementDataFile"}).starts_with("LIST") && !rest.empty() &&
         lines.files.size() < kMostFiles;) {
      const std::string_view name = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(name.size() + 1, rest.size()));
      if (!trim(name).empty()) lines.files.emplace_back(trim(name));
    }
    return lines;
  }
  refuse("{}: its header has no ElementDataFile, so that it has no end", path);
}

void read_voxel_type(const Fields& keys, const std::string& path, VolumeFileHeader& h) {
  const std::string_view type = field(keys, {"ElementType"});
  const auto stored = type_named(type, kTypes);
  if (!stored) refuse("{}: its ElementType is {}; {}", path, in_quotes(type), kSupportedTypes);
  h.stored = *stored;
  if (const auto channels = field(keys, {"ElementNumberOfChannels"}); !channels.empty() && number(channels) != 1.0)
    refuse("{}: has {} components a voxel, supported is 1", path, in_quotes(channels));
}

void read_size(const Fields& keys, const std::string& path, VolumeFileHeader& h) {
  const auto sizes = whole_numbers(field(keys, {"DimSize"}));
  const auto axes = number(field(keys, {"NDims"}));
  if (!sizes || !axes || double(sizes->size()) != *axes || sizes->size() > 10)
    refuse("{}: its DimSize is {} with NDims {}", path, in_quotes(field(keys, {"DimSize"})),
           in_quotes(field(keys, {"NDims"})));
  if (sizes->size() != 3)
    refuse("{}: has {} axes ({}); a volume has 3 (a series is a folder of numbered files)", path, sizes->size(),
           field(keys, {"DimSize"}).substr(0, 60));
  std::copy_n(sizes->begin(), 3, h.size.begin());
}

void read_placement(const Fields& keys, const std::string& path, VolumeFileHeader& h) {
  // The matrix holds the direction of each axis, one after the other.
  const auto turn =
      per_axis(keys, {"TransformMatrix", "Orientation", "Rotation"}, 9, {1, 0, 0, 0, 1, 0, 0, 0, 1}, path);
  const auto size = per_axis(keys, {"ElementSize"}, 3, {1, 1, 1}, path);
  const auto spacing = per_axis(keys, {"ElementSpacing"}, 3, size, path);
  const auto origin = per_axis(keys, {"Offset", "Origin", "Position"}, 3, {0, 0, 0}, path);
  const auto axis = [&](size_t a) { return glm::dvec3(turn[3 * a], turn[3 * a + 1], turn[3 * a + 2]) * spacing[a]; };
  // AnatomicalOrientation gives the directions of the voxels' axes; the placement's axes are ITK's.
  if (const auto said = field(keys, {"AnatomicalOrientation"});
      said.size() == 3 && said.find_first_not_of("RLAPSI") == said.npos)
    h.space = scene::Space::kLps, h.unit = "mm";
  h.index_to_data = placement(axis(0), axis(1), axis(2), {origin[0], origin[1], origin[2]});
}

void find_data(const Lines& lines, const std::string& path, VolumeFileHeader& h) {
  const Fields& keys = lines.keys;
  h.big_endian = is_true(field(keys, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}));
  const std::string_view said = field(keys, {"BinaryData"});
  const bool binary = said.empty() || is_true(said);
  const bool packed = is_true(field(keys, {"CompressedData"}));
  h.encoding = packed ? Encoding::kGzip : binary ? Encoding::kRaw : Encoding::kText;
  const std::string_view data = field(keys, {"ElementDataFile"});
  if (data.empty()) refuse("{}: its ElementDataFile is empty", path);
  const bool local = data == "LOCAL" || data == "Local" || data == "local";
  if (!take_files(data, lines.files, path, h)) {
    h.data_path = local ? path : beside(path, data);
    h.data_at = local ? lines.data_at : 0;
  }
  const auto text = field(keys, {"HeaderSize"});
  if (text.empty() || local) return;
  const auto bytes = number(text);
  if (!bytes || *bytes < -1 || *bytes > 1e15 || (*bytes < 0 && h.encoding != Encoding::kRaw))
    refuse("{}: its HeaderSize is {}", path, in_quotes(text));
  if (*bytes < 0)
    h.data_at_end = true;
  else
    h.data_at = uint64_t(*bytes);
}

}  // namespace

Result<VolumeFileHeader> parse_metaimage(std::string_view content, const std::string& path) {
  return or_error([&] {
    const Lines lines = read_lines(content, path);
    VolumeFileHeader h;
    h.format = "metaimage";
    h.ct = field(lines.keys, {"Modality"}) == "MET_MOD_CT";
    read_voxel_type(lines.keys, path, h);
    read_size(lines.keys, path, h);
    read_placement(lines.keys, path, h);
    find_data(lines, path, h);
    return h;
  });
}

}  // namespace telesplat::data
