// Refinements: the difference between an exact image and a bounded one.
//   refinement = magic, version, varint width, varint height; then for each tile with covered pixels: u8 kind, and
//     kSame: no more bytes, since all pixels equal the known ones
//     kScattered: reach (varint depth, u8 pole + 8 * normal, u8 colour), and scattered pixels
//     kAnew: the tile as in a lossless stream
//   scattered = for the pixels row by row: stored block of bits (depth), [block of bytes (normals)], [3 blocks of bytes
//     (green, red, blue)]
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstdlib>

#include "common/codec/depth_codec.h"
#include "common/codec/entropy.h"
#include "common/codec/poles.h"
#include "common/codec/tile.h"
#include "common/image/normal.h"

namespace telesplat::codec {
namespace {

using detail::Mask;
using detail::Reader;
using detail::TileBounds;
using detail::TileGrid;
using detail::TileRect;
using image::DepthImage;

constexpr uint8_t kMagic = 0xD8, kVersion = 11;
enum Kind : uint8_t { kSame = 0, kScattered = 1, kAnew = 2 };
constexpr int kShifts[3] = {8, 16, 0};   // green, red, blue
constexpr unsigned kMostDepthBits = 25;  // bits of a scattered pixel's depth
constexpr size_t kPlentyBits = 8;        // bits a pixel; above, coding the tile anew is tried

/// Largest difference between the exact and the known pixels of a tile.
struct Reach {
  uint32_t depth = 0;  ///< a code c differs by at most floor(c * depth / 2^32)
  int pole = 0;        ///< pole that turns the normals: 0 to kPoles - 1
  int normal = 0;      ///< largest difference of each coordinate on that map
  int colour = 0;      ///< largest difference of each channel
  bool none() const { return depth == 0 && normal == 0 && colour == 0; }

  /// Range of the exact code.
  struct Codes {
    uint32_t low, high;
  };
  Codes around(uint32_t known) const {
    const auto by = static_cast<uint32_t>(uint64_t{known} * depth >> 32);
    return {known - std::min(by, known - 1), std::min(known + by, image::kMaxDepthCode)};
  }
};

Error damaged(std::string_view what) { return Error{fmt::format("depth image refinement: {}", what)}; }

bool same_mask(const DepthImage& a, const DepthImage& b) {
  if (a.width != b.width || a.height != b.height || a.pixels() != b.pixels()) return false;
  for (size_t i = 0; i < a.pixels(); ++i)
    if ((a.depth[i] == 0) != (b.depth[i] == 0)) return false;
  return true;
}

struct Scratch {
  Mask mask;
  size_t covered = 0;
  detail::BitWriter writer;
  detail::BitReader reader;
  std::vector<uint8_t> bytes;
};
Scratch& scratch() {
  static thread_local Scratch s;
  return s;
}

// Sets s.mask and s.covered from the covered pixels.
void look_at_mask(Scratch& s, const DepthImage& image, const TileRect& rect) {
  s.mask.reset(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y)
    detail::covered_bits(image.depth.data() + rect.index(0, y), static_cast<size_t>(rect.width), s.mask.row(y));
  s.covered = s.mask.count();
}

// Calls f(index) for each covered pixel, row by row.
template <class F>
void for_each_covered(const Scratch& s, const TileRect& rect, F f) {
  for (int y = 0; y < rect.height; ++y) {
    const size_t row = rect.index(0, y);
    detail::for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) { f(row + x); });
  }
}

// Largest difference between the coordinates of two turned normals.
int distance(uint16_t p, uint16_t q) {
  return std::max(std::abs((p & 255) - (q & 255)), std::abs((p >> 8) - (q >> 8)));
}

// False: normals differ by more than ErrorBounds::kMostNormal on each map, or are not canonical.
bool reach_of_normals(const Scratch& s, const TileRect& rect, const DepthImage& exact, const DepthImage& known,
                      Reach& reach) {
  uint32_t differ = 0;
  for (int y = 0; y < rect.height; ++y) {
    const size_t row = rect.index(0, y);
    for (size_t x = 0; x < static_cast<size_t>(rect.width); ++x)
      differ |= static_cast<uint32_t>(exact.normal[row + x] ^ known.normal[row + x]);
  }
  if (differ == 0) return true;
  int most[detail::kPoles] = {};
  size_t n = 0;
  bool canonical = true;
  for_each_covered(s, rect, [&](size_t i) {
    const uint16_t a = exact.normal[i], b = known.normal[i];
    canonical &= image::canonical_normal16(a) == a;
    if (n++ % 16 == 0)
      for (int p = 0; p < detail::kPoles; ++p)
        most[p] = std::max(most[p], distance(detail::turn_normal(a, p), detail::turn_normal(b, p)));
  });
  if (!canonical) return false;
  reach.pole = static_cast<int>(std::min_element(most, most + detail::kPoles) - most);
  const auto turned = [&](uint16_t code) { return detail::turn_normal(code, reach.pole); };
  int largest = 0;
  for (int y = 0; y < rect.height; ++y) {
    const size_t row = rect.index(0, y);  // pixels that are not covered are equal
    for (size_t x = 0; x < static_cast<size_t>(rect.width); ++x)
      largest = std::max(largest, distance(turned(exact.normal[row + x]), turned(known.normal[row + x])));
  }
  reach.normal = largest;
  return largest <= ErrorBounds::kMostNormal;
}

// False: the differences exceed the limits of ErrorBounds, so that known pixels help little.
bool reach_of(const Scratch& s, const TileRect& rect, const DepthImage& exact, const DepthImage& known, Reach& reach) {
  int32_t share_bits = 0, colour = 0;  // bits of floats that are not negative have the floats' order
  for (int y = 0; y < rect.height; ++y) {
    const size_t row = rect.index(0, y);  // pixels that are not covered are equal
    const uint32_t *const a = exact.depth.data() + row, *const b = known.depth.data() + row;
    const uint32_t *const p = exact.colour.data() + row, *const q = known.colour.data() + row;
    for (size_t x = 0; x < static_cast<size_t>(rect.width); ++x) {
      const auto c = static_cast<int32_t>(a[x]), d = static_cast<int32_t>(b[x]);
      const float share = static_cast<float>(std::abs(c - d)) / static_cast<float>(std::max(d, 1));
      share_bits = std::max(share_bits, std::bit_cast<int32_t>(share));
      for (const int shift : kShifts)
        colour =
            std::max(colour, std::abs(static_cast<int>(p[x] >> shift & 255) - static_cast<int>(q[x] >> shift & 255)));
    }
  }
  reach.colour = colour;
  const auto share = static_cast<double>(std::bit_cast<float>(share_bits));
  if (share * 4294967296.0 >= ErrorBounds::kMostDepth || colour > ErrorBounds::kMostColour) return false;
  if (share > 0)
    reach.depth = static_cast<uint32_t>(share * 4294967296.0 * (1 + 1e-6)) + 1;  // a rounded share may be too small
  return reach_of_normals(s, rect, exact, known, reach);
}

// Codes a number below `count`, all equally likely: in two lengths that differ by a bit.
struct Even {
  explicit Even(uint32_t count)
      : bits(static_cast<unsigned>(std::bit_width(count)) - 1), short_ones((2u << bits) - count) {}
  void put(detail::BitSink& sink, uint32_t v) const {
    if (v < short_ones) {
      sink.put(v, bits);
    } else {
      sink.put((v + short_ones) >> 1, bits);
      sink.put((v + short_ones) & 1, 1);
    }
  }
  uint32_t get(detail::BitSource& source) const {
    const uint32_t v = source.take(bits);
    return v < short_ones ? v : 2 * v + source.take(1) - short_ones;
  }
  unsigned bits;
  uint32_t short_ones;
};

void put_scattered(Scratch& s, std::vector<uint8_t>& out, const DepthImage& exact, const DepthImage& known,
                   const TileRect& rect, const Reach& reach) {
  s.writer.start(s.covered * kMostDepthBits);
  for_each_covered(s, rect, [&](size_t i) {
    const auto [low, high] = reach.around(known.depth[i]);
    Even(high - low + 1).put(s.writer.sink, exact.depth[i] - low);
  });
  detail::put_stored_block(out, s.writer.bytes());
  const auto put_bytes = [&](auto byte_of) {
    s.bytes.clear();
    for_each_covered(s, rect, [&](size_t i) { s.bytes.push_back(static_cast<uint8_t>(byte_of(i))); });
    detail::put_block(out, s.bytes);
  };
  if (reach.normal != 0)
    put_bytes([&](size_t i) {
      const uint16_t a = detail::turn_normal(exact.normal[i], reach.pole),
                     b = detail::turn_normal(known.normal[i], reach.pole);
      return (a & 255) - (b & 255) + reach.normal + (2 * reach.normal + 1) * ((a >> 8) - (b >> 8) + reach.normal);
    });
  if (reach.colour != 0)
    for (const int shift : kShifts)
      put_bytes([&](size_t i) { return (exact.colour[i] >> shift) - (known.colour[i] >> shift); });
}

bool get_scattered(Scratch& s, Reader& in, DepthImage& image, const TileRect& rect, const Reach& reach) {
  const auto bits = detail::get_stored_block(in);
  if (!bits || bits->size() > (s.covered * kMostDepthBits + 7) / 8) return false;
  s.reader.start(*bits, s.covered * kMostDepthBits);
  bool good = true;
  for_each_covered(s, rect, [&](size_t i) {
    const auto [low, high] = reach.around(image.depth[i]);
    const uint32_t v = Even(high - low + 1).get(s.reader.source);
    good &= v <= high - low;
    image.depth[i] = std::min(low + v, high);
  });
  if (!good || !s.reader.finished()) return false;
  s.bytes.resize(s.covered);
  if (reach.normal != 0) {
    if (!detail::get_block(in, s.bytes)) return false;
    const int step = 2 * reach.normal + 1;
    const uint8_t* at = s.bytes.data();
    for_each_covered(s, rect, [&](size_t i) {
      const int v = *at++;
      const uint16_t b = detail::turn_normal(image.normal[i], reach.pole);
      const int x = (b & 255) + v % step - reach.normal, y = (b >> 8) + v / step - reach.normal;
      good &= v < step * step && x >= 0 && x <= 254 && y >= 0 && y <= 254;
      image.normal[i] = detail::turn_back(static_cast<uint16_t>((x & 255) | (y & 255) << 8), reach.pole);
    });
  }
  for (int c = 0; good && c < 3 && reach.colour != 0; ++c) {
    if (!detail::get_block(in, s.bytes)) return false;
    const uint8_t* at = s.bytes.data();
    const int shift = kShifts[c];
    for_each_covered(s, rect, [&](size_t i) {
      const uint32_t v = ((image.colour[i] >> shift) + *at++) & 255;
      image.colour[i] = (image.colour[i] & ~(255u << shift)) | v << shift;
    });
  }
  return good;
}

void put_tile(Scratch& s, std::vector<uint8_t>& out, const DepthImage& exact, const DepthImage& known,
              const TileRect& rect) {
  look_at_mask(s, known, rect);
  if (s.covered == 0) return;
  Reach reach;
  if (!reach_of(s, rect, exact, known, reach)) {
    out.push_back(kAnew);
    detail::put_tile(out, exact, rect, TileBounds({}));
    return;
  }
  if (reach.none()) {
    out.push_back(kSame);
    return;
  }
  const size_t begin = out.size();
  out.push_back(kScattered);
  detail::put_varint(out, reach.depth);
  out.push_back(static_cast<uint8_t>(reach.pole + 8 * reach.normal));
  out.push_back(static_cast<uint8_t>(reach.colour));
  put_scattered(s, out, exact, known, rect, reach);
  // With wide bounds, predicting from neighbours may take fewer bytes.
  if (8 * (out.size() - begin) <= kPlentyBits * s.covered) return;
  std::vector<uint8_t> anew{kAnew};
  detail::put_tile(anew, exact, rect, TileBounds({}));
  if (anew.size() >= out.size() - begin) return;
  out.resize(begin);
  out.insert(out.end(), anew.begin(), anew.end());
}

std::optional<Reach> get_reach(Reader& in) {
  const auto depth = in.varint();
  const auto normal = in.u8(), colour = in.u8();
  if (!colour) return std::nullopt;
  const Reach reach{*depth, *normal % 8, *normal / 8, *colour};
  // A share that was rounded up may slightly exceed a bound.
  const bool known = reach.depth <= 2 * ErrorBounds::kMostDepth && reach.pole < detail::kPoles &&
                     reach.normal <= ErrorBounds::kMostNormal && reach.colour <= ErrorBounds::kMostColour;
  return known && !reach.none() ? std::optional(reach) : std::nullopt;
}

bool get_anew(Scratch& s, Reader& in, DepthImage& image, const TileRect& rect) {
  const Mask mask = s.mask;
  if (!detail::get_tile(in, image, rect, TileBounds({}))) return false;
  look_at_mask(s, image, rect);
  return s.mask == mask;
}

bool get_tile(Scratch& s, Reader& in, DepthImage& image, const TileRect& rect) {
  look_at_mask(s, image, rect);
  if (s.covered == 0) return true;
  const auto kind = in.u8();
  if (!kind || *kind > kAnew) return false;
  if (*kind == kSame) return true;
  if (*kind == kAnew) return get_anew(s, in, image, rect);
  const auto reach = get_reach(in);
  if (!reach) return false;
  return get_scattered(s, in, image, rect, *reach);
}

}  // namespace

std::vector<uint8_t> encode_refinement(const DepthImage& exact, const DepthImage& bounded) {
  CHECK(exact.width > 0 && exact.height > 0 && exact.pixels() <= kMaxPixels);
  CHECK(same_mask(exact, bounded));
  std::vector<uint8_t> out{kMagic, kVersion};
  detail::put_varint(out, static_cast<uint32_t>(exact.width));
  detail::put_varint(out, static_cast<uint32_t>(exact.height));
  const TileGrid grid(exact.width, exact.height);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      put_tile(scratch(), out, exact, bounded, grid.rect(column, row));
  return out;
}

Result<DepthImage> decode_refinement(std::span<const uint8_t> bytes, const DepthImage& bounded) {
  CHECK(bounded.width > 0 && bounded.height > 0 && bounded.pixels() <= kMaxPixels);
  Reader in(bytes);
  const auto magic = in.u8(), version = in.u8();
  if (!version) return damaged("shorter than its header");
  if (*magic != kMagic) return damaged(fmt::format("begins with {:#04x}, not {:#04x}", *magic, kMagic));
  if (*version != kVersion) return damaged(fmt::format("version {}, expected {}", *version, kVersion));
  const auto width = in.varint(), height = in.varint();
  if (!height) return damaged("shorter than its header");
  if (*width != static_cast<uint32_t>(bounded.width) || *height != static_cast<uint32_t>(bounded.height))
    return damaged(fmt::format("{} x {} pixels, expected {} x {}", *width, *height, bounded.width, bounded.height));
  DepthImage image = bounded;
  const TileGrid grid(image.width, image.height);
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column)
      if (!get_tile(scratch(), in, image, grid.rect(column, row)))
        return damaged(
            fmt::format("damaged or cut off in tile {}, {} of {} x {}", column, row, grid.columns, grid.rows));
  if (in.left() != 0) return damaged(fmt::format("{} bytes after its end", in.left()));
  return image;
}

}  // namespace telesplat::codec
