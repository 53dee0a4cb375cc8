#include "common/codec/walk.h"

#include <algorithm>
#include <bit>

namespace telesplat::codec::detail {
namespace {

size_t count_bits(const uint64_t* words, size_t word_count) {
  size_t n = 0;
  for (size_t w = 0; w < word_count; ++w) n += static_cast<size_t>(std::popcount(words[w]));
  return n;
}

void fill(FilledRow& row, size_t width, const Pixel& pixel) {
  std::fill_n(row.depth(), width, pixel.depth);
  std::fill_n(row.colour(), width, pixel.colour);
  std::fill_n(row.normal(), width, pixel.normal);
}

// Gives the pixels of `row` without coverage their predictions, as decoding does with residuals of zero.
void fill_holes(FilledRow& above, FilledRow& row, const uint64_t* covered, size_t width) {
  for (size_t w = 0; w * 64 < width; ++w) {
    uint64_t holes = ~covered[w];
    if (width - w * 64 < 64) holes &= (uint64_t{1} << (width - w * 64)) - 1;
    for_each_set(&holes, 1, [&](size_t bit) {
      const size_t x = w * 64 + bit;
      const size_t left = x == 0 ? 0 : x - 1;
      const FilledRow& beside = x == 0 ? above : row;
      row.depth()[x] = predict_depth(beside.depth()[left], above.depth()[x], above.depth()[left]);
      row.colour()[x] = predict_bytes(beside.colour()[left], above.colour()[x], above.colour()[left]);
      row.normal()[x] =
          static_cast<uint16_t>(predict_bytes(beside.normal()[left], above.normal()[x], above.normal()[left]));
    });
  }
}

void load_row(FilledRow& row, const image::DepthImage& image, size_t first, size_t width) {
  std::copy_n(image.depth.data() + first, width, row.depth());
  std::copy_n(image.colour.data() + first, width, row.colour());
  std::copy_n(image.normal.data() + first, width, row.normal());
}

Pixel at(const image::DepthImage& image, size_t i) { return {image.depth[i], image.colour[i], image.normal[i]}; }

}  // namespace

void encode_dense(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, bool full) {
  const size_t width = static_cast<size_t>(rect.width);
  FilledRow *above = &s.rows[0], *row = &s.rows[1];
  fill(*above, width, base);
  for (int y = 0; y < rect.height; ++y, std::swap(above, row)) {
    load_row(*row, image, rect.first + rect.stride * static_cast<size_t>(y), width);
    const size_t covered = full ? width : count_bits(s.mask.row(y), s.mask.words_per_row());
    if (covered != width) fill_holes(*above, *row, s.mask.row(y), width);
    if (covered == 0) continue;
    predict_row(*above, *row, width, s.residuals);
    if (covered == width) {
      s.writer.add(s.residuals, width);
      continue;
    }
    size_t n = 0;
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      s.packed.depth[n] = s.residuals.depth[x];
      s.packed.colour[n] = s.residuals.colour[x];
      s.packed.normal[n++] = s.residuals.normal[x];
    });
    s.writer.add(s.packed, n);
  }
}

bool decode_full(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  const size_t width = static_cast<size_t>(rect.width);
  JoinedRow *above = &s.decoded[0], *row = &s.decoded[1], &residuals = s.decoded_residuals;
  std::fill_n(above->depth.data(), width, base.depth);
  std::fill_n(above->attributes.data(), width, join(base.colour, base.normal));
  bool good = true;
  const uint32_t* depth_above = above->depth.data();
  for (int y = 0; y < rect.height; ++y, std::swap(above, row)) {
    if (!s.reader.take(residuals, width)) return false;
    const size_t first = rect.first + rect.stride * static_cast<size_t>(y);
    uint32_t* const depth = image.depth.data() + first;  // in place: nothing is hidden here
    good &= reconstruct_depth(depth_above, residuals.depth.data(), width, depth);
    depth_above = depth;
    reconstruct_attributes(above->attributes.data(), residuals.attributes.data(), width, row->attributes.data());
    split_attributes(row->attributes.data(), width, image.colour.data() + first, image.normal.data() + first);
  }
  return good;
}

bool decode_masked(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  const size_t width = static_cast<size_t>(rect.width);
  JoinedRow *above = &s.decoded[0], *row = &s.decoded[1], &residuals = s.decoded_residuals, &packed = s.decoded_packed;
  std::fill_n(above->depth.data(), width, base.depth);
  std::fill_n(above->attributes.data(), width, join(base.colour, base.normal));
  bool good = true;
  for (int y = 0; y < rect.height; ++y, std::swap(above, row)) {
    const size_t first = rect.first + rect.stride * static_cast<size_t>(y);
    const size_t covered = count_bits(s.mask.row(y), s.mask.words_per_row());
    if (!s.reader.take(covered == width ? residuals : packed, covered)) return false;
    if (covered != width) {  // a residual of zero leaves a hole its prediction
      std::fill_n(residuals.depth.data(), width, 0u);
      std::fill_n(residuals.attributes.data(), width, uint64_t{0});
      size_t n = 0;
      for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
        residuals.depth[x] = packed.depth[n];
        residuals.attributes[x] = packed.attributes[n++];
      });
    }
    const bool no_zeros = reconstruct_depth(above->depth.data(), residuals.depth.data(), width, row->depth.data());
    reconstruct_attributes(above->attributes.data(), residuals.attributes.data(), width, row->attributes.data());
    if (covered == width) {
      good &= no_zeros;
      std::copy_n(row->depth.data(), width, image.depth.data() + first);
      split_attributes(row->attributes.data(), width, image.colour.data() + first, image.normal.data() + first);
      continue;
    }
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      image.depth[first + x] = row->depth[x];
      image.colour[first + x] = colour_of(row->attributes[x]);
      image.normal[first + x] = normal_of(row->attributes[x]);
      good &= row->depth[x] != 0;
    });
  }
  return good;
}

void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  s.predictor.start(base);
  s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    const Pixel pixel = at(image, rect.index(x, y));
    const Magnitudes size = s.scatter_encoder.put(pixel, s.predictor.predict(x, y, neighbours));
    s.predictor.add(x, y, pixel, size);
    return true;
  });
}

bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  s.predictor.start(base);
  return s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    Magnitudes size;
    const auto pixel = s.scatter_decoder.get(s.predictor.predict(x, y, neighbours), size);
    if (!pixel) return false;
    const size_t i = rect.index(x, y);
    image.depth[i] = pixel->depth, image.colour[i] = pixel->colour, image.normal[i] = pixel->normal;
    s.predictor.add(x, y, *pixel, size);
    return true;
  });
}

}  // namespace telesplat::codec::detail
