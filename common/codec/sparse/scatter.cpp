// Encoder and decoder must predict alike on every machine: this file is compiled without contraction of products and
// sums, and uses only operations whose rounding IEEE 754 prescribes.
#include "common/codec/sparse/scatter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>

namespace telesplat::codec::detail {
namespace {

constexpr float kFlatten = 1e-3f;  // pulls slopes to 0 if neighbours lie on a line; 1e-1 to 1e-4 were tried

using Four = float __attribute__((vector_size(16)));
constexpr size_t kMost = ScatterWalk::kMostNeighbours;

Four four(float v) { return Four{v, v, v, v}; }
Four load(const float* p) {
  Four v;
  std::memcpy(&v, p, sizeof v);
  return v;
}

// Returns the distance to the power of -3, the best of -2 to -4; takes its square.
float near_weight(uint32_t square) { return 1 / (static_cast<float>(square) * std::sqrt(static_cast<float>(square))); }
constexpr uint32_t kWeights = 1024;
const auto kWeightOf = [] {
  std::array<float, kWeights> out{};
  for (uint32_t i = 1; i < kWeights; ++i) out[i] = near_weight(i);
  return out;
}();

// Rounds each number and limits it to [lo, hi]; NaN becomes lo.
using FourInt = int __attribute__((vector_size(16)));
FourInt rounded(Four v, Four lo, Four hi) {
  const Four inside = v > lo ? (v < hi ? v : hi) : lo;
  return __builtin_convertvector(inside + (inside < four(0) ? four(-0.5f) : four(0.5f)), FourInt);
}

struct Near {
  float x[kMost], y[kMost], weight[kMost], depth[kMost];  // relative to the predicted pixel; depth: to the nearest
  size_t count;
};

// Weighted sums over neighbours: (1, x, y, depth) by 1, x and y. They solve the normal equations of
// depth = a + b x + c y: a is row . (sum of depth, of x depth, of y depth).
struct Moments {
  explicit Moments(const Near& near) {
    for (size_t i = 0; i < near.count; ++i) {
      const Four v = four(near.weight[i]) * Four{1, near.x[i], near.y[i], near.depth[i]};
      by_1 += v, by_x += v * four(near.x[i]), by_y += v * four(near.y[i]);
    }
    const float flatten = kFlatten * (by_x[1] + by_y[2]);
    by_x[1] += flatten, by_y[2] += flatten;
    const float s = by_1[0], x = by_1[1], y = by_1[2], xx = by_x[1], xy = by_x[2], yy = by_y[2];
    row[0] = xx * yy - xy * xy, row[1] = xy * y - x * yy, row[2] = x * xy - xx * y;
    const float scale = 1 / (s * row[0] + x * row[1] + y * row[2]);
    for (float& r : row) r *= scale;
  }
  Four by_1 = {}, by_x = {}, by_y = {};
  float row[3];
};

}  // namespace

void ScatterWalk::start(const Mask& mask) {
  for (int level = 0; level < kLevels; ++level) {
    Grid& grid = grids_[static_cast<size_t>(level)];
    if (coded_.size() > grid.pixels.size() / 16)  // clears the cells of the tile before
      std::fill(grid.pixels.begin(), grid.pixels.end(), kNone);
    else
      for (const Place p : coded_) cell(level, p) = kNone;
    grid.stride = static_cast<size_t>((mask.width() - 1) >> level) + 3;
    const size_t cells = grid.stride * (static_cast<size_t>((mask.height() - 1) >> level) + 3);
    if (grid.pixels.size() < cells) grid.pixels.resize(cells, kNone);
  }
  coded_.clear();
  left_.clear();
  for (int y = 0; y < mask.height(); ++y)
    for_each_set(mask.row(y), mask.words_per_row(), [&](size_t x) {
      left_.push_back({static_cast<uint16_t>(x), static_cast<uint16_t>(y)});
    });
}

// Appends the pixels of the ring around p. Without branches: processors would mispredict them.
void ScatterWalk::add_ring(int level, Place p) {
  const size_t stride = grids_[static_cast<size_t>(level)].stride;
  const uint16_t* row = &cell(level, p) - stride - 1;
  for (int j = 0; j < 3; ++j, row += stride)
    for (int i = 0; i < 3; ++i) {
      found_[found_count_] = row[i];
      found_count_ += row[i] != kNone;
    }
}

// Appends pixels of a coarser level's ring that lie outside the ring of level `inner`, which was searched before.
void ScatterWalk::add_outer_ring(int level, int inner, Place p) {
  const size_t stride = grids_[static_cast<size_t>(level)].stride;
  const uint16_t* row = &cell(level, p) - stride - 1;
  const int left = (p.x >> inner) - 1, top = (p.y >> inner) - 1;
  for (int j = 0; j < 3; ++j, row += stride)
    for (int i = 0; i < 3; ++i) {
      const uint16_t pixel = row[i];
      const Place q = coded_[pixel == kNone ? 0 : pixel];
      const bool outside =
          static_cast<unsigned>((q.x >> inner) - left) > 2 || static_cast<unsigned>((q.y >> inner) - top) > 2;
      found_[found_count_] = pixel;
      found_count_ += (pixel != kNone) & outside;
    }
  found_count_ = std::min(found_count_, kMostNeighbours);
}

// Five neighbours are enough (3 to 7 were tried for bytes): in most places they lie all around.
void ScatterWalk::look_around(int level, Place p) {
  found_count_ = 0;
  if (coded_.empty()) return;
  add_ring(level, p);
  if (found_count_ < 5 && level + 1 < kLevels) add_outer_ring(level + 1, level, p);
  for (int outer = level + 2; outer < kLevels && found_count_ < (outer == level + 2 ? 3 : 2); ++outer)
    add_outer_ring(outer, outer - 1, p);
  if (found_count_ == 0) found_[found_count_++] = static_cast<uint16_t>(coded_.size() - 1);
}

void ScatterWalk::enter(int level, Place p) {
  const auto pixel = static_cast<uint16_t>(coded_.size());
  coded_.push_back(p);
  for (int finer = level; finer >= 0; --finer) cell(finer, p) = pixel;
}

void ScatterPredictor::add(int x, int y, const Pixel& pixel, const Magnitudes& k) {
  const auto byte = [](uint32_t word, int shift) { return static_cast<float>(word >> shift & 255); };
  known_.push_back({static_cast<float>(pixel.depth),
                    {byte(pixel.normal, 0), byte(pixel.normal, 8)},
                    k.colour == 0 ? 1.0f : 0.0f,
                    {byte(pixel.colour, 0), byte(pixel.colour, 8), byte(pixel.colour, 16)},
                    0,
                    {float(k.depth), float(k.normal[0]), float(k.normal[1]), float(k.colour)},
                    x,
                    y,
                    {}});
}

Guess ScatterPredictor::predict(int x, int y, std::span<const uint16_t> neighbours) {
  if (neighbours.empty()) {
    const auto sixteenths = [&](int shift) { return 16 * static_cast<int>(base_.normal >> shift & 255); };
    return {
        .depth = 16 * static_cast<int>(base_.depth), .normal = {sixteenths(0), sixteenths(8)}, .colour = base_.colour};
  }
  Near near;
  near.count = neighbours.size();
  const Known* nearest = nullptr;
  uint32_t least = std::numeric_limits<uint32_t>::max();
  for (size_t i = 0; i < near.count; ++i) {
    const Known& k = known_[neighbours[i]];
    const int dx = k.x - x, dy = k.y - y;
    const uint32_t square = static_cast<uint32_t>(dx) * static_cast<uint32_t>(dx) +
                            static_cast<uint32_t>(dy) * static_cast<uint32_t>(dy);  // below 2^32: tiles are small
    near.x[i] = static_cast<float>(dx), near.y[i] = static_cast<float>(dy);
    near.weight[i] = square < kWeights ? kWeightOf[square] : near_weight(square);
    if (square < least) least = square, nearest = &k;
  }
  for (size_t i = 0; i < near.count; ++i) near.depth[i] = known_[neighbours[i]].depth - nearest->depth;

  const Moments moments(near);
  const Four at = load(&nearest->depth), colour_at = load(nearest->colour);
  const Four most{1e30f, 127.5f, 127.5f, 1e30f}, turn{0, 256, 256, 0};  // a normal's bytes wrap: takes the shorter way
  Four sum = {}, colour = {}, sizes = {}, mean = {}, squares = {};
  for (size_t i = 0; i < near.count; ++i) {
    const Known& k = known_[neighbours[i]];
    const float w = near.weight[i];
    const Four share = four(w * (moments.row[0] + moments.row[1] * near.x[i] + moments.row[2] * near.y[i]));
    Four d = load(&k.depth) - at;
    d = d > most ? d - turn : d < -most ? d + turn : d;
    sum += share * d;
    mean += four(w) * d, squares += four(w) * d * d;
    colour += share * (load(k.colour) - colour_at);
    sizes += four(w) * load(k.sizes);
  }

  Guess out;
  constexpr float kFar = 16 * image::kMaxDepthCode;
  const FourInt by = rounded(sum * four(16), Four{-kFar, -16 * 128, -16 * 128, 0}, Four{kFar, 16 * 127, 16 * 127, 0});
  out.depth =
      std::clamp(16 * static_cast<int>(nearest->depth) + by[0], 16, 16 * static_cast<int>(image::kMaxDepthCode));
  for (int c = 0; c < 2; ++c) out.normal[c] = 16 * static_cast<int>(nearest->normal[c]) + by[1 + c];
  const FourInt bytes = rounded(colour_at + colour, four(0), four(255));
  out.colour = static_cast<uint32_t>(bytes[0] | bytes[1] << 8 | bytes[2] << 16);
  const FourInt expected = rounded(sizes * four(1 / moments.by_1[0]), four(0), four(255));
  const auto size = [&](int i) { return static_cast<uint8_t>(expected[i]); };
  out.expected = {size(0), {size(1), size(2)}, size(3)};
  const float plain = sum[3] + nearest->plain;
  out.plain_colour = plain > 0.9f ? 3 : plain > 0.5f ? 2 : plain > 0 ? 1 : 0;
  out.distance = std::min(least, Guess::kMostDistance);
  out.few = near.count < 3;
  constexpr float kMostSpread = 1 << 27;
  const Four inverse = four(1 / moments.by_1[0]), middle = mean * inverse,
             variance = squares * inverse - middle * middle;
  for (int i = 0; i < 3; ++i)
    out.spread[i] = static_cast<int>(std::min(kMostSpread, 16 * std::sqrt(std::max(0.0f, variance[i]))));
  out.slope = static_cast<int>(std::min(kMostSpread, 16 * std::abs(sum[0] - middle[0])));
  return out;
}

}  // namespace telesplat::codec::detail
