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

// Pixel i = (x, y) of a sparse tile: as in a filled row where the three neighbours are covered, else the nearest pixel.
Pixel predict_sparse(const TileScratch& s, const image::DepthImage& image, size_t x, int y, size_t i, size_t stride) {
  const auto covered = [&](size_t column, int row) { return (s.mask.row(row)[column / 64] >> column % 64 & 1) != 0; };
  if (x == 0 || y == 0 || !covered(x - 1, y) || !covered(x, y - 1) || !covered(x - 1, y - 1))
    return s.neighbours.predict(static_cast<int>(x), y);
  const Pixel left = at(image, i - 1), up = at(image, i - stride), up_left = at(image, i - stride - 1);
  return {predict_depth(left.depth, up.depth, up_left.depth), predict_bytes(left.colour, up.colour, up_left.colour),
          static_cast<uint16_t>(predict_bytes(left.normal, up.normal, up_left.normal))};
}

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
  s.neighbours.reset(rect.width, rect.height, base);
  for (int y = 0; y < rect.height; ++y) {
    size_t n = 0;
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      const size_t i = rect.first + rect.stride * static_cast<size_t>(y) + x;
      const Pixel pixel = at(image, i), guess = predict_sparse(s, image, x, y, i, rect.stride);
      s.packed.depth[n] = fold_depth(pixel.depth - guess.depth);
      s.packed.colour[n] = fold_bytes(pixel.colour, guess.colour);
      s.packed.normal[n++] = static_cast<uint16_t>(fold_bytes(pixel.normal, guess.normal));
      s.neighbours.add(static_cast<int>(x), y, pixel);
    });
    if (n != 0) s.writer.add(s.packed, n);
  }
}

bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  s.neighbours.reset(rect.width, rect.height, base);
  JoinedRow& packed = s.decoded_packed;
  bool good = true;
  for (int y = 0; y < rect.height; ++y) {
    size_t n = count_bits(s.mask.row(y), s.mask.words_per_row());
    if (n == 0) continue;
    if (!s.reader.take(packed, n)) return false;
    n = 0;
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      const size_t i = rect.first + rect.stride * static_cast<size_t>(y) + x;
      const Pixel guess = predict_sparse(s, image, x, y, i, rect.stride);
      const Pixel pixel{(guess.depth + unfold_depth(packed.depth[n])) & image::kMaxDepthCode,
                        add_bytes(guess.colour, colour_of(packed.attributes[n])),
                        static_cast<uint16_t>(add_bytes(guess.normal, normal_of(packed.attributes[n])))};
      ++n;
      image.depth[i] = pixel.depth, image.colour[i] = pixel.colour, image.normal[i] = pixel.normal;
      good &= pixel.depth != 0;
      s.neighbours.add(static_cast<int>(x), y, pixel);
    });
  }
  return good;
}

}  // namespace telesplat::codec::detail
