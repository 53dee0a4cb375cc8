// Parses --raw for files that do not state their layout, and guesses it.
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

#include "common/volume/grid.h"
#include "services/data/volume/formats/header_text.h"

namespace telesplat::data {
namespace {

std::optional<StoredType> type_named(std::string_view name) {
  for (auto type = StoredType::kU8; type <= StoredType::kF64; type = StoredType(int(type) + 1))
    if (name == name_of(type)) return type;
  return std::nullopt;
}

// Reads "103x94x161" at the text's beginning; leaves the rest.
std::optional<std::array<int64_t, 3>> take_size(std::string_view& text) {
  std::array<int64_t, 3> size{};
  const char *at = text.data(), *const end = at + text.size();
  for (size_t a = 0; a < 3; ++a) {
    if (a > 0 && (at == end || *at++ != 'x')) return std::nullopt;
    const auto parsed = std::from_chars(at, end, size[a]);
    if (parsed.ec != std::errc() || size[a] < 0) return std::nullopt;
    at = parsed.ptr;
  }
  text.remove_prefix(size_t(at - text.data()));
  return size;
}

// Finds words for types in a file's name: "tooth_103x94x161_uint16.raw".
std::optional<StoredType> type_in(std::string_view name) {
  using enum StoredType;
  constexpr TypeName kWords[] = {{"uint8", kU8},   {"uint16", kU16},  {"uint32", kU32}, {"uchar", kU8},
                                 {"ushort", kU16}, {"int8", kI8},     {"int16", kI16},  {"int32", kI32},
                                 {"short", kI16},  {"float64", kF64}, {"double", kF64}, {"float", kF32}};
  for (const auto& [word, type] : kWords)
    if (name.find(word) != name.npos) return type;
  return std::nullopt;
}

StoredType usual_type(uint64_t bytes) {
  return bytes == 1   ? StoredType::kU8
         : bytes == 2 ? StoredType::kU16
         : bytes == 4 ? StoredType::kF32
                      : StoredType::kF64;
}

// Returns the layout in a file's name, if it fits the file's size.
std::string guess_by_name(std::string_view name, uint64_t bytes) {
  for (size_t at = 0; at < name.size(); ++at) {
    if (!std::isdigit(static_cast<unsigned char>(name[at])) ||
        (at > 0 && std::isdigit(static_cast<unsigned char>(name[at - 1]))))
      continue;
    std::string_view rest = name.substr(at);
    const auto size = take_size(rest);
    if (!size) continue;
    uint64_t voxels = 1;
    for (const int64_t n : *size) voxels *= n >= 1 && n <= volume::kMaxSide ? uint64_t(n) : 0;
    const auto named = type_in(name);
    for (const uint64_t each : {1, 2, 4, 8})
      if (voxels > 0 && voxels * each == bytes && (!named || stored_bytes(*named) == each))
        return fmt::format("{}x{}x{}:{}", (*size)[0], (*size)[1], (*size)[2],
                           name_of(named.value_or(usual_type(each))));
  }
  return "";
}

VolumeFileHeader parse(std::string_view spec, const std::string& path) {
  VolumeFileHeader h;
  h.format = "raw";
  h.data_path = path;
  const auto bad = [&](const std::string& what) {
    refuse("{}: --raw {}: {}, as in 256x256x256:u8 or 512x512x100:i16be:0.5,0.5,2", path, in_quotes(spec), what);
  };
  constexpr const char* kShape = "SIZExSIZExSIZE:TYPE[:SPACING,SPACING,SPACING][:skip=BYTES] is needed";
  std::string_view rest = spec;
  const auto size = spec.size() <= 200 ? take_size(rest) : std::nullopt;
  if (!size || !rest.starts_with(':')) bad(kShape);
  h.size = *size;
  rest.remove_prefix(1);
  const size_t colon = std::min(rest.find(':'), rest.size());
  std::string_view type = rest.substr(0, colon);
  const std::string_view whole = type;
  if (type.ends_with("be")) h.big_endian = true, type.remove_suffix(2);
  const auto stored = type_named(type);
  if (!stored) bad(fmt::format("{} is no type; types are {}", in_quotes(whole), kRawTypes));
  h.stored = *stored;
  if (colon + 1 == rest.size()) bad(kShape);
  for (std::string_view parts = rest.substr(std::min(colon + 1, rest.size())); !parts.empty();) {
    const std::string_view part = parts.substr(0, parts.find(':'));
    parts.remove_prefix(std::min(part.size() + 1, parts.size()));
    if (part.starts_with("skip=")) {
      const auto skip = whole_numbers(part.substr(5));
      if (!skip || skip->size() != 1) bad(fmt::format("{} is no number of bytes from 0 on", in_quotes(part)));
      h.data_at = uint64_t((*skip)[0]);
      continue;
    }
    const auto spacing = spacing_of(part);
    if (!spacing) bad(fmt::format("{} is not three spacings above 0", in_quotes(part)));
    h.index_to_data = placement(*spacing);
  }
  return h;
}

}  // namespace

Result<VolumeFileHeader> parse_raw_spec(std::string_view spec, const std::string& path) {
  return or_error([&] { return parse(spec, path); });
}

std::vector<std::string> raw_guesses(const std::string& path, uint64_t bytes) {
  const std::string name = lower(std::filesystem::path(path).filename().string());
  if (const std::string named = guess_by_name(name, bytes); !named.empty()) return {named};
  struct Guess {
    int64_t slices;  // ratio to the side: distance from a cube
    int64_t side;
    uint64_t each;
  };
  constexpr size_t kMost = 3;
  constexpr int64_t kFlattest = 4;
  std::vector<Guess> found;
  for (const uint64_t each : {1, 2, 4}) {
    const auto cube = int64_t(std::llround(std::cbrt(double(bytes / each))));
    if (cube >= 8 && cube <= volume::kMaxSide && uint64_t(cube) * uint64_t(cube) * uint64_t(cube) * each == bytes)
      found.push_back({cube, cube, each});
    for (const int64_t side : {64, 128, 256, 512, 1024, 2048}) {
      const uint64_t slice = uint64_t(side) * uint64_t(side) * each;
      const auto slices = int64_t(bytes / slice);
      if (bytes % slice == 0 && slices != side && slices * kFlattest >= side && slices <= side * kFlattest)
        found.push_back({slices, side, each});
    }
  }
  const auto flatness = [](const Guess& g) {
    return double(std::max(g.slices, g.side)) / double(std::min(g.slices, g.side));
  };
  std::stable_sort(found.begin(), found.end(), [&](auto& a, auto& b) { return flatness(a) < flatness(b); });
  std::vector<std::string> out;
  for (const Guess& g : found)
    if (out.size() < kMost)
      out.push_back(fmt::format("{}x{}x{}:{}", g.side, g.side, g.slices, name_of(usual_type(g.each))));
  return out;
}

}  // namespace telesplat::data
