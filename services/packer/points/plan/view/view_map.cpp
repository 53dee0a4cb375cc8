#include "services/packer/points/plan/view/view_map.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "common/image/normal.h"
#include "common/splat/finish.h"
#include "common/splat/splat_kernels.h"

namespace telesplat::packer {
namespace {

constexpr float kNothingMet = std::numeric_limits<float>::infinity();
constexpr int kReach = splat::ViewKeys::kReach;

// Nearer neighbours, of eight, that make a pixel a pin-hole.
constexpr int kPinHoleSides = 7;

}  // namespace

// The rows around the current one, kept from tile to tile.
struct PixelJudge::Rows {
  static constexpr int kKept = 8;  // a power of 2, at least the five rows that are read
  int stride = 0;
  std::vector<uint32_t> memory;

  void resize(int width) {
    stride = width + 2 * (kReach + kRowSlack);
    memory.resize(static_cast<size_t>(stride) * (3 * kKept + 3));
  }
  uint32_t* at(int n) { return memory.data() + static_cast<size_t>(n) * stride + kReach + kRowSlack; }
  int32_t* signed_at(int n) { return reinterpret_cast<int32_t*>(at(n)); }
  PixelRow row(int y) {
    const int n = 3 * (y & (kKept - 1));
    return {signed_at(n), at(n + 1), at(n + 2)};
  }
  // Contrasts of a row's pixels with the next ones, and of rows with the row below.
  int32_t* beside() { return signed_at(3 * kKept); }
  int32_t* between(int y) { return signed_at(3 * kKept + 1 + (y & 1)); }

  bool pin_hole(int x, int y) {
    const int32_t limit = row(y).code[x] - static_cast<int32_t>(splat::kEdge);
    int nearer = 0;
    for (int dy = -1; dy <= 1; ++dy)
      for (int dx = -1; dx <= 1; ++dx) nearer += row(y + dy).code[x + dx] < limit;
    return nearer >= kPinHoleSides;
  }
};

PixelJudge::PixelJudge(const geometry::Camera& camera, const PixelTest& test, const splat::RimBias& rim)
    : near_m_(static_cast<float>(camera.near_m)), planes_(camera), test_(test), bias_(bias_table(rim)) {}

// Judges like eliminate_redundancy() for a sample at the pixel's centre (reference_depth.h).
bool PixelJudge::has_sample_near(const splat::ViewKeys::Tile& tile, int x, int y, float depth_m,
                                 uint16_t normal) const {
  const float epsilon_m = test_.relative_epsilon * depth_m;
  const auto point = [&](int px, int py) { return std::bit_cast<float>(tile.depth_row(py)[px]); };
  constexpr float kUnit = 1.0f / (1 << splat::kReferenceSubBits);
  constexpr uint32_t kPlace = (1u << splat::kReferenceSubBits) - 1;
  const splat::PlaneSlope slope = planes_.at(normal, tile.rect.x + x, tile.rect.y + y);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      const float there = point(x + dx, y + dy);
      if (!(there < kNothingMet)) continue;
      const uint32_t bits = std::bit_cast<uint32_t>(there);
      const float ox = float(dx) + (float(bits & kPlace) + 0.5f) * kUnit - 0.5f,
                  oy = float(dy) + (float(bits >> splat::kReferenceSubBits & kPlace) + 0.5f) * kUnit - 0.5f;
      if (ox * ox + oy * oy > test_.nearest * test_.nearest) continue;
      if (std::abs(there - depth_m * (1.0f + slope.x * ox + slope.y * oy)) <= epsilon_m) return true;
    }
  return false;
}

// A tile without points shows nothing.
static void clear_planes(const geometry::Rect& r, ViewMap& map) {
  for (int y = r.y; y < r.y + r.height; ++y) {
    const size_t first = static_cast<size_t>(y) * map.covered.width() + r.x;
    std::fill_n(map.depth_m.data() + first, r.width, kNothingMet);
    std::fill_n(map.colour.data() + first, r.width, 0u);
    std::fill_n(map.normal.data() + first, r.width, uint16_t{0});
    std::fill_n(map.nearest_m.data() + first, r.width, kNothingMet);
  }
}

void PixelJudge::judge(const splat::ViewKeys::Tile& tile, int x, int y, ViewMap& map) const {
  const int width = tile.rect.width, height = tile.rect.height;
  const bool planes = !map.depth_m.empty();
  if (tile.empty) {
    if (planes) clear_planes({x, y, width, height}, map);
    return;
  }
  thread_local Rows rows;
  rows.resize(width);
  const auto split = [&](int row) { split_row(tile.key_row(row), -kReach, width + kReach, bias_, rows.row(row)); };
  // Compares a row with the one below.
  const auto compare = [&](int row) {
    compare_rows({rows.row(row - 1).code, rows.row(row), rows.row(row + 1), rows.row(row + 2).code}, 0, width,
                 rows.between(row));
  };
  for (int row = -kReach; row < kReach; ++row) split(row);
  compare(-1);
  for (int row = 0; row < height; ++row) {
    split(row + kReach);
    compare(row);
    const PixelRow at = rows.row(row);
    const PixelRow next{at.code + 1, at.attributes + 1, at.normal_high + 1};
    compare_rows({at.code - 1, at, next, at.code + 2}, -1, width, rows.beside());
    if (planes) {
      const size_t first = static_cast<size_t>(y + row) * map.covered.width() + x;
      write_row(at, near_m_, width, map.depth_m.data() + first, map.colour.data() + first, map.normal.data() + first);
      std::memcpy(map.nearest_m.data() + first, tile.depth_row(row), static_cast<size_t>(width) * sizeof(float));
    }
    for (int x0 = 0; x0 < width; x0 += 64) judge_64(tile, rows, x0, row, {x + x0, y + row}, map);
  }
}

void PixelJudge::judge_64(const splat::ViewKeys::Tile& tile, Rows& rows, int x0, int y, const glm::ivec2& at,
                          ViewMap& map) const {
  const int left = tile.rect.width - x0;
  const uint64_t inside = left >= 64 ? ~uint64_t{0} : (uint64_t{1} << left) - 1;
  const RowBits bits =
      judge_row_64({rows.row(y).code, rows.beside(), rows.between(y - 1), rows.between(y), tile.depth_row(y)}, near_m_,
                   1.0f + test_.relative_epsilon, x0);
  uint64_t lacking = 0;
  // Few pixels need a closer look: those without a point of their own, and pin-holes at edges.
  for (uint64_t rest = (bits.covered & ~bits.own) & inside; rest != 0; rest &= rest - 1) {
    const int x = x0 + std::countr_zero(rest);
    const float depth_m = splat::decode_depth_code(uint32_t(rows.row(y).code[x]), near_m_);
    if (!has_sample_near(tile, x, y, depth_m, uint16_t(splat::key_normal(tile.key_row(y)[x])))) lacking |= rest & -rest;
  }
  for (uint64_t rest = bits.covered & bits.edge & ~lacking & inside; rest != 0; rest &= rest - 1)
    if (rows.pin_hole(x0 + std::countr_zero(rest), y)) lacking |= rest & -rest;
  const size_t word = static_cast<size_t>(at.x) >> 6;
  map.covered.row(at.y)[word] |= bits.covered & inside;
  map.lacking.row(at.y)[word] |= lacking;
  map.edge.row(at.y)[word] |= bits.edge & inside;
  map.strong.row(at.y)[word] |= bits.strong & inside;
  map.weak.row(at.y)[word] |= bits.weak & inside;
}

void reset_masks(int width, int height, ViewMap& map) {
  for (image::PixelMask* mask : {&map.covered, &map.lacking, &map.edge, &map.strong, &map.weak})
    mask->reset(width, height);
}

void render_view_map(const points::PointModel& model, const geometry::Camera& camera, const PixelTest& test,
                     splat::ViewKeys& keys, ViewMap& map, bool rests) {
  map.camera = camera;
  reset_masks(camera.width, camera.height, map);
  const size_t pixels = static_cast<size_t>(camera.width) * camera.height;
  map.depth_m.resize(pixels), map.colour.resize(pixels), map.normal.resize(pixels);
  map.nearest_m.resize(pixels);
  keys.begin(model, camera, kPlanTileWidth, kPlanTileHeight, rests);
  const PixelJudge judge(camera, test, keys.rim());
  keys.draw_all([&](const splat::ViewKeys::Tile& tile) { judge.judge(tile, tile.rect.x, tile.rect.y, map); });
}

}  // namespace telesplat::packer
