// The stages, each in its own file: tiles of about 256 x 256 (tile), their coverage masks (mask), and dense tiles
// (dense/): depth first (depth), normals predicted from depth (normals, guided), colours by a palette or by channels
// (colours); residuals -> tokens by context -> words (symbols, tables, rans). For tiles with few covered pixels:
// prediction from coarse to fine (scatter), residuals -> bits by their expected spread (scatter_coder, spread).
#include "common/codec/depth_codec.h"

#include <fmt/format.h>

#include <cmath>

#include "common/codec/lattice.h"
#include "common/codec/room_axes.h"
#include "common/codec/tile.h"

namespace telesplat::codec {
namespace {

using detail::Reader;
using detail::TileGrid;
using image::DepthImage;

// stream = magic, version, flags, varint width, varint height, [bounds], tiles of TileGrid row by row (tile.h), and no
// more bytes. bounds = varint depth, u8 normal, u8 colour. flags: bounds follow; the image is one sparse tile.
constexpr uint8_t kMagic = 0xD7, kVersion = 12, kBounded = 1, kOneTile = 2, kKnownFlags = kBounded | kOneTile;

Error damaged(std::string_view what) { return Error{fmt::format("depth image stream: {}", what)}; }

bool is_valid(const ErrorBounds& b) {
  return b.depth <= ErrorBounds::kMostDepth && b.normal >= 0 && b.normal <= ErrorBounds::kMostNormal && b.colour >= 0 &&
         b.colour <= ErrorBounds::kMostColour;
}

struct Header {
  int width, height;
  bool one_tile;
  ErrorBounds bounds;
};

// Nothing: encode() does not write such bounds.
std::optional<ErrorBounds> read_bounds(Reader& in) {
  const auto depth = in.varint();
  const auto normal = in.u8(), colour = in.u8();
  if (!colour) return std::nullopt;
  const ErrorBounds bounds{*depth, *normal, *colour};
  const bool known = is_valid(bounds) && !bounds.exact();
  return known && (*depth == 0 || *depth >= ErrorBounds::kLeastDepth) ? std::optional(bounds) : std::nullopt;
}

// Refuses sizes that the rest of the stream cannot hold: every tile, of at most kMaxTilePixels pixels, takes at least a
// byte.
Result<Header> read_header(Reader& in) {
  const auto magic = in.u8(), version = in.u8();
  if (!version) return damaged("shorter than its header");
  if (*magic != kMagic) return damaged(fmt::format("begins with {:#04x}, not {:#04x}", *magic, kMagic));
  if (*version != kVersion) return damaged(fmt::format("version {}, expected {}", *version, kVersion));
  const auto flags = in.u8();
  if (flags && *flags & ~kKnownFlags) return damaged(fmt::format("flags {:#04x}, known {:#04x}", *flags, kKnownFlags));
  const auto width = in.varint(), height = in.varint();
  if (!height) return damaged("shorter than its header");
  if (*width == 0 || *height == 0 || *width > kMaxPixels || *height > kMaxPixels ||
      uint64_t{*width} * *height > kMaxPixels)
    return damaged(fmt::format("{} x {} pixels, limit {} in all and at least 1 x 1", *width, *height, kMaxPixels));
  Header header{static_cast<int>(*width), static_cast<int>(*height), (*flags & kOneTile) != 0, {}};
  if (*flags & kBounded) {
    const auto bounds = read_bounds(in);
    if (!bounds) return damaged("bounds of error that nobody writes");
    header.bounds = *bounds;
  }
  const TileGrid grid(header.width, header.height, header.one_tile);
  const size_t tiles = static_cast<size_t>(grid.columns) * static_cast<size_t>(grid.rows);
  if (in.left() < tiles)
    return damaged(
        fmt::format("{} bytes left for {} x {} pixels, which take {} or more", in.left(), *width, *height, tiles));
  return header;
}

// Axes for columns and rows that are counted from (x, y).
RoomAxes moved(const RoomAxes& axes, int x, int y) {
  RoomAxes out = axes;
  for (auto& axis : out) axis[2] += axis[0] * x + axis[1] * y;
  return out;
}

// Calls f(column, row) -> bool for every tile in order, until one returns false.
template <class F>
bool for_each_tile(const TileGrid& grid, F f) {
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      if (!f(column, row)) return false;
  return true;
}

std::vector<uint8_t> encode(const DepthImage& image, const ErrorBounds& given, DepthImage* decoded,
                            const RoomAxes* axes) {
  CHECK(image.width > 0 && image.height > 0 && image.pixels() <= kMaxPixels);
  CHECK(image.pixels() == static_cast<size_t>(image.width) * static_cast<size_t>(image.height));
  CHECK(image.colour.size() == image.pixels() && image.normal.size() == image.pixels());
  CHECK(is_valid(given));
  ErrorBounds bounds = given;
  if (bounds.depth < ErrorBounds::kLeastDepth) bounds.depth = 0;
  const bool bounded = !bounds.exact();
  const detail::TileBounds tile_bounds(bounds);
  const bool one_tile = detail::is_one_tile(image, tile_bounds);
  std::vector<uint8_t> out;
  out.reserve(64 + image.pixels() / 8);
  out.assign({kMagic, kVersion, static_cast<uint8_t>((bounded ? kBounded : 0) | (one_tile ? kOneTile : 0))});
  detail::put_varint(out, static_cast<uint32_t>(image.width));
  detail::put_varint(out, static_cast<uint32_t>(image.height));
  if (bounded) {
    detail::put_varint(out, bounds.depth);
    out.push_back(static_cast<uint8_t>(bounds.normal));
    out.push_back(static_cast<uint8_t>(bounds.colour));
  }
  const TileGrid grid(image.width, image.height, one_tile);
  for_each_tile(grid, [&](int column, int row) {
    const detail::TileRect rect = grid.rect(column, row);
    RoomAxes of_tile;
    if (axes != nullptr)
      of_tile = moved(*axes, column * grid.tile_width + rect.width / 2, row * grid.tile_height + rect.height / 2);
    return detail::put_tile(out, image, rect, tile_bounds, axes != nullptr ? &of_tile : nullptr), true;
  });
  if (decoded != nullptr) CHECK(decode_into(*decoded, out).ok());
  return out;
}

}  // namespace

std::vector<uint8_t> encode(const DepthImage& image, const ErrorBounds& bounds, DepthImage* decoded) {
  return encode(image, bounds, decoded, nullptr);
}

std::vector<uint8_t> encode(const DepthImage& image, const ErrorBounds& bounds, DepthImage* decoded,
                            const RoomAxes& axes) {
  constexpr double kMost = 1e30;  // larger axes, and those that are not numbers, are ignored
  bool known = true;
  for (const auto& axis : axes)
    for (const double v : axis) known &= std::abs(v) < kMost;
  return encode(image, bounds, decoded, known ? &axes : nullptr);
}

Result<DepthImage> decode(std::span<const uint8_t> bytes, int expected_width, int expected_height) {
  DepthImage image;
  if (const Status status = decode_into(image, bytes, expected_width, expected_height); !status) return status.error();
  return image;
}

Status decode_into(DepthImage& image, std::span<const uint8_t> bytes, int expected_width, int expected_height) {
  const auto fail = [&](std::string_view what) {
    image = {};
    return damaged(what);
  };
  Reader in(bytes);
  const auto size = read_header(in);
  if (!size) {
    image = {};
    return size.error();
  }
  if ((expected_width != 0 && size->width != expected_width) ||
      (expected_height != 0 && size->height != expected_height))
    return fail(fmt::format("{} x {} pixels, expected {} x {} (0: any)", size->width, size->height, expected_width,
                            expected_height));
  const size_t pixels = static_cast<size_t>(size->width) * static_cast<size_t>(size->height);
  image.width = size->width, image.height = size->height;
  image.depth.resize(pixels);  // not cleared: every tile writes all its pixels
  image.colour.resize(pixels);
  image.normal.resize(pixels);
  const TileGrid grid(image.width, image.height, size->one_tile);
  const detail::TileBounds bounds(size->bounds);
  std::string problem;
  const bool good = for_each_tile(grid, [&](int column, int row) {
    if (detail::get_tile(in, image, grid.rect(column, row), bounds)) return true;
    problem = fmt::format("damaged or cut off in tile {}, {} of {} x {}", column, row, grid.columns, grid.rows);
    return false;
  });
  if (!good) return fail(problem);
  if (in.left() != 0) return fail(fmt::format("{} bytes after its end", in.left()));
  return ok_status();
}

Result<StreamInfo> inspect(std::span<const uint8_t> bytes) {
  Reader in(bytes);
  const auto size = read_header(in);
  if (!size) return size.error();
  StreamInfo info{.width = size->width, .height = size->height, .bounds = size->bounds};
  const TileGrid grid(info.width, info.height, size->one_tile);
  if (!for_each_tile(grid, [&](int column, int row) { return detail::skip_tile(in, grid.rect(column, row), info); }))
    return damaged("damaged or cut off");
  if (in.left() != 0) return damaged(fmt::format("{} bytes after its end", in.left()));
  return info;
}

}  // namespace telesplat::codec
