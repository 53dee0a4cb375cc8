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

// Gives the pixels of `row` without coverage their predictions, as reconstruct_row does for residuals of zero.
void fill_holes(FilledRow& above, FilledRow& row, const uint64_t* covered, size_t width) {
  for (size_t x = 0; x < width; ++x) {
    if (covered[x / 64] >> x % 64 & 1) continue;
    const bool edge = x == 0;
    row.depth()[x] = edge ? above.depth()[0] : predict_depth(row.depth()[x - 1], above.depth()[x], above.depth()[x - 1]);
    row.colour()[x] = edge ? above.colour()[0] : predict_bytes(row.colour()[x - 1], above.colour()[x], above.colour()[x - 1]);
    row.normal()[x] = edge ? above.normal()[0]
                           : static_cast<uint16_t>(predict_bytes(row.normal()[x - 1], above.normal()[x], above.normal()[x - 1]));
  }
}

void load_row(FilledRow& row, const image::DepthImage& image, size_t first, size_t width) {
  std::copy_n(image.depth.data() + first, width, row.depth());
  std::copy_n(image.colour.data() + first, width, row.colour());
  std::copy_n(image.normal.data() + first, width, row.normal());
}

}  // namespace

void encode_dense(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, bool full) {
  const size_t width = static_cast<size_t>(rect.width);
  FilledRow *above = &s.rows[0], *row = &s.rows[1];
  fill(*above, width, base);
  for (int y = 0; y < rect.height; ++y, std::swap(above, row)) {
    load_row(*row, image, rect.first + rect.stride * static_cast<size_t>(y), width);
    if (!full) fill_holes(*above, *row, s.mask.row(y), width);
    predict_row(*above, *row, width, s.residuals);
    if (full) {
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

bool decode_dense(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base, bool full) {
  const size_t width = static_cast<size_t>(rect.width);
  FilledRow *above = &s.rows[0], *row = &s.rows[1];
  fill(*above, width, base);
  bool good = true;
  for (int y = 0; y < rect.height; ++y, std::swap(above, row)) {
    const size_t first = rect.first + rect.stride * static_cast<size_t>(y);
    if (full) {
      if (!s.reader.take(s.residuals, width)) return false;
      reconstruct_row(*above, *row, width, s.residuals);
      uint32_t least = 1;
      for (size_t x = 0; x < width; ++x) least = std::min(least, row->depth()[x]);
      good &= least != 0;
      std::copy_n(row->depth(), width, image.depth.data() + first);
      std::copy_n(row->colour(), width, image.colour.data() + first);
      std::copy_n(row->normal(), width, image.normal.data() + first);
      continue;
    }
    size_t n = count_bits(s.mask.row(y), s.mask.words_per_row());
    if (!s.reader.take(s.packed, n)) return false;
    std::fill_n(s.residuals.depth.data(), width, 0u);
    std::fill_n(s.residuals.colour.data(), width, 0u);
    std::fill_n(s.residuals.normal.data(), width, uint16_t{0});
    n = 0;
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      s.residuals.depth[x] = s.packed.depth[n];
      s.residuals.colour[x] = s.packed.colour[n];
      s.residuals.normal[x] = s.packed.normal[n++];
    });
    reconstruct_row(*above, *row, width, s.residuals);
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      image.depth[first + x] = row->depth()[x];
      image.colour[first + x] = row->colour()[x];
      image.normal[first + x] = row->normal()[x];
      good &= row->depth()[x] != 0;
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
      const Pixel pixel{image.depth[i], image.colour[i], image.normal[i]}, guess = s.neighbours.predict(static_cast<int>(x), y);
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
  bool good = true;
  for (int y = 0; y < rect.height; ++y) {
    size_t n = count_bits(s.mask.row(y), s.mask.words_per_row());
    if (n == 0) continue;
    if (!s.reader.take(s.packed, n)) return false;
    n = 0;
    for_each_set(s.mask.row(y), s.mask.words_per_row(), [&](size_t x) {
      const Pixel guess = s.neighbours.predict(static_cast<int>(x), y);
      const Pixel pixel{(guess.depth + unfold_depth(s.packed.depth[n])) & image::kMaxDepthCode, add_bytes(guess.colour, s.packed.colour[n]),
                        static_cast<uint16_t>(add_bytes(guess.normal, s.packed.normal[n]))};
      ++n;
      const size_t i = rect.first + rect.stride * static_cast<size_t>(y) + x;
      image.depth[i] = pixel.depth, image.colour[i] = pixel.colour, image.normal[i] = pixel.normal;
      good &= pixel.depth != 0;
      s.neighbours.add(static_cast<int>(x), y, pixel);
    });
  }
  return good;
}

}  // namespace telesplat::codec::detail
