#include "common/image/file.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <string_view>
#include <utility>

#include "common/core/check.h"
#include "common/geometry/camera.h"
#include "common/image/srgb.h"

namespace telesplat::image {
namespace {

uint32_t byte_of(float v) { return v > 0 ? static_cast<uint32_t>(std::min(v, 1.0f) * 255.0f + 0.5f) : 0; }

// OpenImageIO may report several errors, one a line.
std::string first_line(const std::string& text) { return text.substr(0, text.find('\n')); }

// Indices of a file's red, green, blue and depth channels; -1: the file lacks it.
struct Channels {
  int r = -1, g = -1, b = -1, z = -1;
};

Channels find_channels(const OIIO::ImageSpec& spec) {
  Channels c{spec.channelindex("R"), spec.channelindex("G"), spec.channelindex("B"), spec.channelindex("Z")};
  if (c.r < 0 && c.g < 0 && c.b < 0 && c.z != 0) c.r = c.g = c.b = 0;  // grey
  return c;
}

// The only readers of OpenImageIO that are used: a hostile file could choose any of its many others.
constexpr const char* kEndings[] = {"png", "jpg", "jpeg", "webp", "tif", "tiff", "bmp", "gif",
                                    "tga", "exr", "hdr",  "ppm",  "pgm", "pbm",  "pnm"};

// OpenImageIO chooses a reader by a name's ending, but pictures inside files have none, and some a wrong one.
std::string name_for_reader(std::span<const std::byte> bytes, const std::string& name) {
  using namespace std::literals;
  constexpr std::pair<std::string_view, const char*> kBeginnings[] = {
      {"\x89PNG"sv, "picture.png"}, {"\xff\xd8\xff"sv, "picture.jpg"}, {"II*\0"sv, "picture.tif"},
      {"MM\0*"sv, "picture.tif"},   {"BM"sv, "picture.bmp"},           {"GIF8"sv, "picture.gif"},
      {"v/1\x01"sv, "picture.exr"}, {"#?RADIANCE"sv, "picture.hdr"}};
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("RIFF") && text.substr(0, 12).ends_with("WEBP")) return "picture.webp";
  for (const auto& [beginning, as] : kBeginnings)
    if (text.starts_with(beginning)) return as;
  return name;
}

// told: the name that OpenImageIO gets; name: for the error text.
Status check_reader(const std::string& told, const std::string& name) {
  // Else OpenImageIO asks all its readers, HEIF's and those of movies too, about a file whose name does not fit. One
  // takes minutes and all memory for a few letters (libheif 1.15, under ThreadSanitizer).
  static const bool asks_one = OIIO::attribute("try_all_readers", 0);
  CHECK(asks_one);
  std::string ending = told.substr(std::min(told.rfind('.'), told.size() - 1) + 1);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  if (std::find(std::begin(kEndings), std::end(kEndings), ending) != std::end(kEndings)) return ok_status();
  return Error{fmt::format("cannot read picture {}: it is none of {}", name, fmt::join(kEndings, ", "))};
}

// path: for error texts.
Result<View> read_pixels(OIIO::ImageInput& input, const std::string& path, uint64_t most_pixels) {
  const OIIO::ImageSpec spec = input.spec();
  if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.width > geometry::kMaxImageSide ||
      spec.height > geometry::kMaxImageSide)
    return Error{fmt::format("picture {} has {}x{}x{} pixels, limit is {} a side and one slice", path, spec.width,
                             spec.height, spec.depth, geometry::kMaxImageSide)};
  if (uint64_t(spec.width) * uint64_t(spec.height) > most_pixels)
    return Error{
        fmt::format("picture {} has {}x{} pixels, {} are left for it", path, spec.width, spec.height, most_pixels)};
  if (spec.nchannels < 1 || spec.nchannels > 64)
    return Error{fmt::format("picture {} has {} channels, limits are 1..64", path, spec.nchannels)};

  const Channels at = find_channels(spec);
  const bool linear = spec.format == OIIO::TypeDesc::HALF || spec.format == OIIO::TypeDesc::FLOAT;
  const auto code = [linear](float v) { return linear ? srgb_of_linear(v) : byte_of(v); };
  View view{spec.width, 0, {}, {}};
  // Reads a few rows at a time: memory follows the file's real content, not its header's claim.
  const int step = spec.tile_width > 0 ? std::max(1, std::min(spec.tile_height, 1024)) : 16;
  std::vector<float> rows(size_t(step) * spec.width * spec.nchannels);
  for (int y = 0; y < spec.height; y += step) {
    const int y0 = spec.y + y, y1 = spec.y + std::min(y + step, spec.height);
    const bool good = spec.tile_width > 0 ? input.read_tiles(0, 0, spec.x, spec.x + spec.width, y0, y1, 0, 1, 0,
                                                             spec.nchannels, OIIO::TypeDesc::FLOAT, rows.data())
                                          : input.read_scanlines(0, 0, y0, y1, 0, 0, spec.nchannels,
                                                                 OIIO::TypeDesc::FLOAT, rows.data());
    if (!good) return Error{fmt::format("cannot read row {} of picture {}: {}", y, path, first_line(input.geterror()))};
    const size_t pixels = size_t(y1 - y0) * spec.width;
    for (size_t i = 0; i < pixels; ++i) {
      const float* p = rows.data() + i * spec.nchannels;
      const auto channel = [&](int c) { return c < 0 ? 0u : code(p[c]); };
      view.colour.push_back(channel(at.r) << 16 | channel(at.g) << 8 | channel(at.b));
      if (at.z >= 0) view.depth_m.push_back(p[at.z]);
    }
  }
  view.height = spec.height;
  return view;
}

}  // namespace

Result<View> read_picture(std::span<const std::byte> bytes, const std::string& name, uint64_t most_pixels) {
  const std::string told = name_for_reader(bytes, name);
  if (const auto known = check_reader(told, name); !known) return known.error();
  OIIO::ImageSpec wishes;
  wishes.attribute("oiio:UnassociatedAlpha", 1);
  OIIO::Filesystem::IOMemReader memory(const_cast<std::byte*>(bytes.data()), bytes.size());  // it only reads
  OIIO::Filesystem::IOProxy* const proxy = &memory;
  wishes.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);  // these settings replace the proxy that open() gets
  const auto input = OIIO::ImageInput::open(told, &wishes, &memory);
  if (!input) return Error{fmt::format("cannot read picture {}: {}", name, first_line(OIIO::geterror()))};
  return read_pixels(*input, name, most_pixels);
}

}  // namespace telesplat::image
