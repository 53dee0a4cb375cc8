#include "common/codec/tile.h"

#include <algorithm>

#include "common/codec/poles.h"
#include "common/image/normal.h"

namespace telesplat::codec::detail {
namespace {

enum Kind : uint8_t { kEmpty = 0, kDense = 1, kSparse = 2, kPredictorBits = 3, kMasked = 4, kKnownBits = 7 };
constexpr int kRamp = 8;  // added to a sparse tile's pole: a ramp's axis follows

TileScratch& tile_scratch() {
  static thread_local TileScratch s;
  return s;
}

void put_base(std::vector<uint8_t>& out, const Pixel& base) {
  for (int shift = 0; shift < 24; shift += 8) out.push_back(static_cast<uint8_t>(base.depth >> shift));
  for (int shift = 0; shift < 24; shift += 8) out.push_back(static_cast<uint8_t>(base.colour >> shift));
  for (int shift = 0; shift < 16; shift += 8) out.push_back(static_cast<uint8_t>(base.normal >> shift));
}
std::optional<Pixel> get_base(Reader& in) {
  const auto b = in.bytes(8);
  if (!b) return std::nullopt;
  const auto at = [&](int i) { return uint32_t{(*b)[static_cast<size_t>(i)]}; };
  return Pixel{at(0) | at(1) << 8 | at(2) << 16, at(3) | at(4) << 8 | at(5) << 16,
               static_cast<uint16_t>(at(6) | at(7) << 8)};
}

void clear(image::DepthImage& image, const TileRect& rect) {
  for (int y = 0; y < rect.height; ++y) {
    const size_t first = rect.first + rect.stride * static_cast<size_t>(y), width = static_cast<size_t>(rect.width);
    std::fill_n(image.depth.begin() + static_cast<ptrdiff_t>(first), width, 0u);
    std::fill_n(image.colour.begin() + static_cast<ptrdiff_t>(first), width, 0u);
    std::fill_n(image.normal.begin() + static_cast<ptrdiff_t>(first), width, uint16_t{0});
  }
}

// Refuses sparse coding of denser tiles, which bounds the decoding time of a stream.
bool may_be_sparse(size_t covered, size_t pixels) { return covered * 4 < pixels; }

// Limits of an image that is one tile: of its pixels, since a walk keeps two bytes a pixel in each thread, and of the
// covered ones, since a walk numbers them in 16 bits.
constexpr size_t kMostOfOne = size_t{1} << 22, kMostScattered = 65535;

constexpr size_t kFewWithinBounds = 4000;  // bench codec on whole views: 2700 to 8000 do equally well

// Filled rows predict better if runs are long. Otherwise sparse tiles take fewer bits at any density (a tenth less at a
// third), but ten times longer a pixel than full ones: bench codec/patch* and codec/sparse*. Within bounds, filled rows
// have smaller tables, and pay from a few thousand pixels on.
bool is_sparse(size_t covered, size_t runs, size_t pixels, bool bounded) {
  const bool few = covered * 8 < pixels && (!bounded || covered < kFewWithinBounds);
  return few || (may_be_sparse(covered, pixels) && covered < runs * 4);
}

// Sets `mask` to the covered pixels of a tile.
void look_at(Mask& mask, const image::DepthImage& image, const TileRect& rect) {
  mask.reset(rect.width, rect.height);
  for (int y = 0; y < rect.height; ++y)
    covered_bits(image.depth.data() + rect.index(0, y), static_cast<size_t>(rect.width), mask.row(y));
}

size_t pixels_of(const TileRect& rect) { return static_cast<size_t>(rect.width) * static_cast<size_t>(rect.height); }

// Chooses the pole that turns a sparse tile's normals. exact: codes that are not canonical must be restored, too.
int pole_of(const image::DepthImage& image, const TileRect& rect, const Mask& mask, bool exact) {
  PoleChoice choice;
  bool canonical = true;
  for (int y = 0; y < rect.height; ++y)
    for_each_set(mask.row(y), mask.words_per_row(), [&](size_t x) {
      const uint16_t code = image.normal[rect.index(static_cast<int>(x), y)];
      choice.add(code);
      canonical &= image::canonical_normal16(code) == code;
    });
  return exact && !canonical ? kRaw : choice.best();
}

// Looks for a ramp that explains a sparse tile's colours, which takes 17 bytes. A sample of pixels is enough.
std::optional<RampAxis> find_ramp(const Mask& mask, const image::DepthImage& image, const TileRect& rect,
                                  const RoomAxes* axes) {
  constexpr size_t kMostSamples = 1024;
  if (axes == nullptr) return std::nullopt;
  const size_t step = mask.count() / kMostSamples + 1;
  size_t left = 0;
  std::vector<RampSample> samples;
  for (int y = 0; y < rect.height; ++y)
    for_each_set(mask.row(y), mask.words_per_row(), [&](size_t x) {
      if (left-- > 0) return;
      left = step - 1;
      const size_t i = rect.index(static_cast<int>(x), y);
      samples.push_back({static_cast<double>(static_cast<int>(x) - rect.width / 2),
                         static_cast<double>(y - rect.height / 2), static_cast<double>(image.depth[i]),
                         image.colour[i] & 0xFFFFFF});
    });
  return fit_ramp(*axes, samples, rect.width, rect.height);
}

// Fills pixels covered by s.mask from s.scatter_decoder, which was started; leaves others alone (they are zero).
// Returns false if the stream is damaged.
bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole) {
  s.predictor.start({base.depth, base.colour, turn_normal(base.normal, pole)});
  return s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    Magnitudes size;
    const auto pixel = s.scatter_decoder.get(x, y, s.predictor.predict(x, y, neighbours), size);
    if (!pixel) return false;
    const size_t i = rect.index(x, y);
    image.depth[i] = pixel->depth, image.colour[i] = pixel->colour, image.normal[i] = turn_back(pixel->normal, pole);
    s.predictor.add(x, y, *pixel, size);
    return true;
  });
}

}  // namespace

TileGrid::TileGrid(int width, int height, bool one)
    : width(width), height(height), tile_width(width), tile_height(height), columns(1), rows(1) {
  if (one) return;
  // About 256 x 256, longer in narrow images; of equal size up to rounding, so that no tile is a sliver.
  constexpr int kSide = 256, kPixels = static_cast<int>(kMaxTilePixels);
  const int most_rows = width < kSide ? kPixels / width : kSide,
            most_columns = height < kSide ? kPixels / height : kSide;
  const auto equal_parts = [](int size, int most) {
    const int parts = (size + most - 1) / most;
    return (size + parts - 1) / parts;
  };
  tile_width = equal_parts(width, most_columns), tile_height = equal_parts(height, most_rows);
  columns = (width + tile_width - 1) / tile_width, rows = (height + tile_height - 1) / tile_height;
}

TileRect TileGrid::rect(int column, int row) const {
  const int x = column * tile_width, y = row * tile_height;
  return {static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x), static_cast<size_t>(width),
          std::min(tile_width, width - x), std::min(tile_height, height - y)};
}

void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole) {
  s.predictor.start({base.depth, base.colour, turn_normal(base.normal, pole)});
  s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    const size_t i = rect.index(x, y);
    Pixel pixel{image.depth[i], image.colour[i], turn_normal(image.normal[i], pole)};
    const Magnitudes size = s.scatter_encoder.put(x, y, pixel, s.predictor.predict(x, y, neighbours));
    s.predictor.add(x, y, pixel, size);
    return true;
  });
}

bool is_one_tile(const image::DepthImage& image, const TileBounds& bounds) {
  const TileGrid grid(image.width, image.height);
  if (image.pixels() > kMostOfOne || grid.columns * grid.rows == 1) return false;
  Mask& mask = tile_scratch().mask;
  size_t total = 0, tiles = 0;
  for (int row = 0; row < grid.rows; ++row)
    for (int column = 0; column < grid.columns; ++column) {
      const TileRect rect = grid.rect(column, row);
      look_at(mask, image, rect);
      const size_t covered = mask.count();
      if (covered == 0) continue;
      if (!is_sparse(covered, mask.runs(), pixels_of(rect), bounds.depth != nullptr)) return false;
      ++tiles, total += covered;
    }
  return tiles > 1 && total <= kMostScattered;
}

size_t put_tile(std::vector<uint8_t>& out, const image::DepthImage& image, const TileRect& rect,
                const TileBounds& bounds, const RoomAxes* axes) {
  TileScratch& s = tile_scratch();
  look_at(s.mask, image, rect);
  const size_t pixels = pixels_of(rect), covered = s.mask.count();
  if (covered == 0) {
    out.push_back(kEmpty);
    return 0;
  }
  const bool full = covered == pixels,
             sparse = !full &&
                      (pixels > kMaxTilePixels || is_sparse(covered, s.mask.runs(), pixels, bounds.depth != nullptr));
  out.push_back(static_cast<uint8_t>((sparse ? kSparse : kDense) | (full ? 0 : kMasked)));

  size_t first = rect.first;  // index of the first covered pixel
  for (int y = 0; y < rect.height; ++y) {
    const size_t row = rect.first + rect.stride * static_cast<size_t>(y), end = row + static_cast<size_t>(rect.width);
    for (first = row; first < end && image.depth[first] == 0;) ++first;
    if (first < end) break;
  }
  Pixel base{image.depth[first], image.colour[first] & 0xFFFFFF, image.normal[first]};
  if (bounds.depth != nullptr) base.depth = bounds.depth->index(base.depth);
  put_base(out, base);
  if (!full) put_mask(out, s.mask);

  if (sparse) {
    if (bounds.depth != nullptr) base.depth = bounds.depth->code(base.depth);
    const int pole = pole_of(image, rect, s.mask, bounds.normal == 0);
    const auto ramp = find_ramp(s.mask, image, rect, axes);
    out.push_back(static_cast<uint8_t>(pole | (ramp ? kRamp : 0)));
    if (ramp) put_ramp(out, *ramp), s.ramp.start(*ramp, rect.width, rect.height);
    s.scatter_encoder.start(bounds, ramp ? &s.ramp : nullptr);
    encode_sparse(s, image, rect, base, pole);
    s.scatter_encoder.finish(out);
    return covered;
  }
  s.dense.put(out, image, {rect, full ? nullptr : &s.mask, base, bounds}, axes);
  return covered;
}

std::optional<size_t> get_tile(Reader& in, image::DepthImage& image, const TileRect& rect, const TileBounds& bounds) {
  const auto kind = in.u8();
  if (kind == kEmpty) {
    clear(image, rect);
    return 0;
  }
  if (!kind || *kind & ~kKnownBits) return std::nullopt;
  const int predictor = *kind & kPredictorBits;
  const bool full = !(*kind & kMasked), sparse = predictor == kSparse;
  if ((!sparse && predictor != kDense) || (full && sparse)) return std::nullopt;

  TileScratch& s = tile_scratch();
  const auto base = get_base(in);
  if (!base) return std::nullopt;
  const size_t pixels = pixels_of(rect);
  if (!sparse && pixels > kMaxTilePixels) return std::nullopt;
  size_t covered = pixels;
  if (!full) {
    s.mask.reset(rect.width, rect.height);
    if (!get_mask(in, s.mask)) return std::nullopt;
    covered = s.mask.count();
    if (covered == 0) return std::nullopt;  // an empty tile has its own kind
    if (sparse) clear(image, rect);
  }
  if (sparse) {
    if (!may_be_sparse(covered, pixels) || covered > kMostScattered) return std::nullopt;
    const auto turns = in.u8();
    if (!turns) return std::nullopt;
    const int pole = *turns & ~kRamp;
    const bool has_ramp = (*turns & kRamp) != 0;
    if (has_ramp) {
      const auto ramp = get_ramp(in, rect.width, rect.height);
      if (!ramp) return std::nullopt;
      s.ramp.start(*ramp, rect.width, rect.height);
    }
    if (pole > (bounds.normal != 0 ? kPoles - 1 : kRaw) ||
        !s.scatter_decoder.start(in, bounds, has_ramp ? &s.ramp : nullptr))
      return std::nullopt;
    const Pixel first{bounds.depth != nullptr ? bounds.depth->code(base->depth) : base->depth, base->colour,
                      base->normal};
    if (!decode_sparse(s, image, rect, first, pole) || !s.scatter_decoder.finished()) return std::nullopt;
    return covered;
  }
  if (!s.dense.get(in, image, {rect, full ? nullptr : &s.mask, *base, bounds})) return std::nullopt;
  return covered;
}

bool skip_tile(Reader& in, const TileRect& rect, StreamInfo& info) {
  const auto kind = in.u8();
  if (kind == kEmpty) return true;
  if (!kind || *kind & ~kKnownBits || !get_base(in)) return false;
  size_t covered = static_cast<size_t>(rect.width) * static_cast<size_t>(rect.height);
  if (*kind & kMasked) {
    Mask& mask = tile_scratch().mask;
    mask.reset(rect.width, rect.height);
    const size_t before = in.left();
    if (!get_mask(in, mask)) return false;
    info.mask_bytes += before - in.left();
    covered = mask.count();
  }
  info.covered_pixels += covered;
  const auto skip = [&](size_t& total, int blocks) {
    const size_t before = in.left();
    for (; blocks > 0; --blocks)
      if (!skip_block(in)) return false;
    total += before - in.left();
    return true;
  };
  if ((*kind & kPredictorBits) == kSparse) {
    const auto turns = in.u8();
    if (!turns) return false;
    const size_t before = in.left();
    if ((*turns & kRamp) != 0 && !get_ramp(in, rect.width, rect.height)) return false;
    info.sparse_bytes += before - in.left();
    return skip(info.sparse_bytes, 1);
  }
  return DenseCoder::skip(in, info);
}

}  // namespace telesplat::codec::detail
