// MetaImage headers: "Key = value" lines, the last of which is ElementDataFile.
// https://itk.org/Wiki/ITK/MetaIO/Documentation
#include <fmt/format.h>

#include <algorithm>

#include <array>
#include <map>

#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

std::optional<StoredType> type_named(std::string_view name) {
  static const std::map<std::string_view, StoredType> kTypes{
      {"MET_CHAR", StoredType::kI8},    {"MET_UCHAR", StoredType::kU8},   {"MET_SHORT", StoredType::kI16},
      {"MET_USHORT", StoredType::kU16}, {"MET_INT", StoredType::kI32},    {"MET_UINT", StoredType::kU32},
      {"MET_LONG", StoredType::kI32},   {"MET_ULONG", StoredType::kU32},  {"MET_LONG_LONG", StoredType::kI64},
      {"MET_FLOAT", StoredType::kF32},  {"MET_DOUBLE", StoredType::kF64}, {"MET_ULONG_LONG", StoredType::kU64}};
  const auto found = kTypes.find(name);
  return found == kTypes.end() ? std::nullopt : std::optional(found->second);
}

bool is_true(std::string_view text) { return !text.empty() && (text[0] == 'T' || text[0] == 't' || text[0] == '1'); }

using Keys = std::map<std::string_view, std::string_view>;

std::string_view value(const Keys& keys, std::initializer_list<std::string_view> names) {
  for (const auto name : names)
    if (const auto found = keys.find(name); found != keys.end()) return found->second;
  return {};
}

// As many numbers as axes; `otherwise` if the key is not there.
Result<std::vector<double>> per_axis(const Keys& keys, std::initializer_list<std::string_view> names, size_t count,
                                     std::vector<double> otherwise, const std::string& path) {
  const std::string_view text = value(keys, names);
  if (text.empty()) return otherwise;
  const auto all = numbers(text);
  if (!all || all->size() < count)
    return Error{fmt::format("{}: its {} is {}, not {} numbers", path, *names.begin(), in_quotes(text), count)};
  return *all;
}

// The lines up to ElementDataFile, behind which local data begin.
struct Lines {
  Keys keys;
  std::vector<std::string> files;  // behind "ElementDataFile = LIST"
  size_t data_at = 0;
};
Result<Lines> read_lines(std::string_view content, const std::string& path) {
  Lines lines;
  for (size_t begin = 0; begin < content.size();) {
    const size_t end = std::min(content.find('\n', begin), content.size());
    const std::string_view line = content.substr(begin, end - begin);
    begin = end + 1;
    const size_t equals = line.find('=');
    if (equals == line.npos) {
      if (trim(line).empty()) continue;
      return Error{fmt::format("{}: its header has a line without \"=\": {}", path, in_quotes(line))};
    }
    const std::string_view key = trim(line.substr(0, equals));
    lines.keys.emplace(key, trim(line.substr(equals + 1)));
    lines.data_at = begin;
    if (key != "ElementDataFile") continue;
    for (std::string_view rest = content.substr(std::min(begin, content.size()));
         lines.keys[key].starts_with("LIST") && !rest.empty() && lines.files.size() < kMostFiles;) {
      const std::string_view name = rest.substr(0, rest.find('\n'));
      rest.remove_prefix(std::min(name.size() + 1, rest.size()));
      if (!trim(name).empty()) lines.files.emplace_back(trim(name));
    }
    return lines;
  }
  return Error{path + ": its header has no ElementDataFile, so that it has no end"};
}

Status read_voxel_type(const Keys& keys, const std::string& path, VolumeFileHeader& h) {
  const std::string_view type = value(keys, {"ElementType"});
  const auto stored = type_named(type);
  if (!stored) return Error{fmt::format("{}: its ElementType is {}; {}", path, in_quotes(type), kSupportedTypes)};
  h.stored = *stored;
  if (const auto channels = value(keys, {"ElementNumberOfChannels"}); !channels.empty() && number(channels) != 1.0)
    return Error{fmt::format("{}: has {} components a voxel, supported is 1", path, in_quotes(channels))};
  return ok_status();
}

Status read_size(const Keys& keys, const std::string& path, VolumeFileHeader& h) {
  const auto sizes = whole_numbers(value(keys, {"DimSize"}));
  const auto axes = number(value(keys, {"NDims"}));
  if (!sizes || !axes || double(sizes->size()) != *axes || sizes->size() > 10)
    return Error{fmt::format("{}: its DimSize is {} with NDims {}", path, in_quotes(value(keys, {"DimSize"})),
                             in_quotes(value(keys, {"NDims"})))};
  if (sizes->size() != 3)
    return Error{fmt::format("{}: has {} axes ({}); a volume has 3 (a series is a folder of numbered files)", path,
                             sizes->size(), value(keys, {"DimSize"}).substr(0, 60))};
  std::copy_n(sizes->begin(), 3, h.size.begin());
  return ok_status();
}

Status read_placement(const Keys& keys, const std::string& path, VolumeFileHeader& h) {
  // The matrix has the direction of each axis, one after the other.
  const auto turn =
      per_axis(keys, {"TransformMatrix", "Orientation", "Rotation"}, 9, {1, 0, 0, 0, 1, 0, 0, 0, 1}, path);
  if (!turn) return turn.error();
  const auto size = per_axis(keys, {"ElementSize"}, 3, {1, 1, 1}, path);
  if (!size) return size.error();
  const auto spacing = per_axis(keys, {"ElementSpacing"}, 3, *size, path);
  if (!spacing) return spacing.error();
  const auto origin = per_axis(keys, {"Offset", "Origin", "Position"}, 3, {0, 0, 0}, path);
  if (!origin) return origin.error();
  const auto axis = [&](size_t a) {
    return glm::dvec3((*turn)[3 * a], (*turn)[3 * a + 1], (*turn)[3 * a + 2]) * (*spacing)[a];
  };
  // AnatomicalOrientation tells how the voxels' axes run, not what the placement's are: those are ITK's.
  if (const auto said = value(keys, {"AnatomicalOrientation"});
      said.size() == 3 && said.find_first_not_of("RLAPSI") == said.npos)
    h.space = scene::Space::kLps, h.unit = "mm";
  h.index_to_data = placement(axis(0), axis(1), axis(2), {(*origin)[0], (*origin)[1], (*origin)[2]});
  return ok_status();
}

Status find_data(const Lines& lines, const std::string& path, VolumeFileHeader& h) {
  const Keys& keys = lines.keys;
  h.big_endian = is_true(value(keys, {"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}));
  const std::string_view said = value(keys, {"BinaryData"});
  const bool binary = said.empty() || is_true(said);
  const bool packed = is_true(value(keys, {"CompressedData"}));
  h.encoding = packed ? Encoding::kGzip : binary ? Encoding::kRaw : Encoding::kText;
  const std::string_view data = value(keys, {"ElementDataFile"});
  if (data.empty()) return Error{path + ": its ElementDataFile is empty"};
  const bool local = data == "LOCAL" || data == "Local" || data == "local", listed = data.starts_with("LIST");
  if (listed || data.find('%') != data.npos) {
    const auto files = listed ? Result(lines.files) : files_of_pattern(data);
    if (!files) return Error{fmt::format("{}: {}", path, files.error().text)};
    if (const Status s = take_files(*files, path, h); !s) return s;
  } else {
    h.data_path = local ? path : beside(path, data);
    h.data_at = local ? lines.data_at : 0;
  }
  const auto text = value(keys, {"HeaderSize"});
  if (text.empty() || local) return ok_status();
  const auto bytes = number(text);
  if (!bytes || *bytes < -1 || *bytes > 1e15 || (*bytes < 0 && h.encoding != Encoding::kRaw))
    return Error{fmt::format("{}: its HeaderSize is {}", path, in_quotes(text))};
  if (*bytes < 0)
    h.data_at_end = true;
  else
    h.data_at = uint64_t(*bytes);
  return ok_status();
}

}  // namespace

Result<VolumeFileHeader> parse_metaimage(std::string_view content, const std::string& path) {
  const auto lines = read_lines(content, path);
  if (!lines) return lines.error();
  VolumeFileHeader h;
  h.format = "metaimage";
  h.ct = value(lines->keys, {"Modality"}) == "MET_MOD_CT";
  if (const Status s = read_voxel_type(lines->keys, path, h); !s) return s.error();
  if (const Status s = read_size(lines->keys, path, h); !s) return s.error();
  if (const Status s = read_placement(lines->keys, path, h); !s) return s.error();
  if (const Status s = find_data(*lines, path, h); !s) return s.error();
  return h;
}

}  // namespace telesplat::data
