// The finish: stages that change a tile's resolved pixels before they are shown. Each stage is optional and works
// inside the tile, while it is in the cache. Every SIMD target computes the same pixels.
//
// Two pixels belong to different surfaces if their depth codes (pixel_key.h: 2^14 steps an octave) differ by more than
// kEdge, about 2 % of depth. An empty pixel counts as farther than everything.
//
// Fill (pin-holes): the depth map is closed with a 3x3 window:
//     closed(p) = max over the 3x3 pixels q around p of (min over the 3x3 pixels around q of the code).
//   A pixel is a hole if its code exceeds closed(p) by more than kEdge. Its supports are those of its 8 neighbours that
//   lie within kEdge of closed(p). If they are enough, its colour and depth become their means; the four at its sides
//   count twice. So gaps in a surface of up to two pixels are closed, also those through which something farther shows.
//   Surfaces grow nowhere outwards: closing leaves a pixel open if a 3x3 window around it fits into the gap.
//   Enough are four neighbours (Gaps::kAll, for sub-pixels, where coarse samples leave gaps beside fine ones), or
//   (Gaps::kPinHoles) a count of kPinHoleSupports of 12, or of kFlatSupports whose codes range over no more than kFlat:
//   gaps between ribs, whose sides lie at different depths, stay open. There is one more way (kPinHoles): if neighbours
//   that are nearer than the pixel by more than kEdge count kBetweenSupports, the farthest of them and those within
//   kEdge of it are its supports. What lies between a surface and a nearer one that hid it shows the farther.
//   This is pull-push, after Grossman and Dally 1998, with one level and a sliding window instead of a pyramid: coarser
//   levels bleed over silhouettes. Gathering along the four axes up to 3 pixels away gave 20.0, 36.4 and 36.4 dB where
//   this gives 20.6, 36.5 and 36.2, and took about four times as long.
// Smooth: interpolates the samples of magnified splats, along rows and then along columns. The weights are [1 2 1] / 4
//   where the spacing class is 2 or more (exactly bilinear interpolation for samples 2 pixels apart) and [1 6 1] / 8
//   where it is 1. A neighbour of another surface counts as the pixel itself.
// Antialias: where the codes of the 3x3 pixels around a pixel range over more than 2 kEdge, those within kEdge of the
//   least are near, the others far. The pixel's colour becomes
//     coverage * mean of the near + (1 - coverage) * mean of the far, with weights [1 2 1] x [1 2 1],
//   and coverage depends on the weight of the near and on whether the pixel is one of them (kCoverage). It is less than
//   their share: splats reach half of a sample distance beyond a silhouette, and the nearest of the samples in a pixel
//   is drawn. So near surfaces look thicker than they are, all the more with more samples.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "common/splat/cpu_splatter.h"
#include "common/splat/pixel_key.h"
#include "common/splat/render_options.h"

namespace telesplat::splat {

inline constexpr uint32_t kEdge = 480;  ///< depth codes: 1.5 to 2.9 % of depth
inline constexpr int kFillReach = 2;    ///< pixels
inline constexpr uint32_t kFillSupports = 4;
inline constexpr uint32_t kPinHoleSupports = 9, kFlatSupports = 6, kBetweenSupports = 10;
inline constexpr uint32_t kFlat = 128;  ///< depth codes: 0.4 to 0.8 % of depth
/// Share of a pixel that near surfaces cover, from the 3x3 pixels around it, in 64ths; [1 if the pixel is
/// near][weight of the near, in 16ths]. Chosen from means over the silhouettes of bones and a head along walk-around-a,
/// displayed at 640x400 and 1280x800, sampled with steering and without, against 16 rays a pixel.
inline constexpr std::array<std::array<uint32_t, 17>, 2> kCoverage{
    {{0, 0, 0, 0, 1, 3, 5, 11, 19, 38, 45, 58, 61, 61, 61, 61, 61},
     {13, 13, 13, 13, 13, 16, 19, 21, 22, 26, 19, 32, 40, 54, 61, 63, 64}}};
/// Factors of the near and the far pixels' weighted sums, in 2^-16; [17 * is near + weight of the near].
struct CoverageWeights {
  std::array<uint32_t, 34> near{}, far{};
};
constexpr CoverageWeights coverage_weights() {
  CoverageWeights w;
  for (uint32_t i = 0; i < 34; ++i) {
    const uint32_t covered = kCoverage[i / 17][i % 17], near = i % 17, far = 16 - near;
    if (near > 0) w.near[i] = (1024 * covered + near / 2) / near;
    if (far > 0) w.far[i] = (1024 * (64 - covered) + far / 2) / far;
  }
  return w;
}
inline constexpr CoverageWeights kCoverageWeights = coverage_weights();
inline constexpr int kFinishSlack = 16;  ///< pixels that vectors may read and write beyond a stage's area

/// Number of valid pixels that the selected stages need around a tile.
constexpr int finish_reach(const Finish& f) {
  return (f.fill ? kFillReach : 0) + (f.smooth ? 1 : 0) + (f.antialias ? 1 : 0);
}

/// Resolved pixels of a tile and of a margin around it, row by row: `stride` colours (0x00RRGGBB), then `stride` infos
/// (depth code << 8 | spacing class << 3 | ring; 0xffffffff: empty).
struct ResolvedTile {
  uint32_t* rows = nullptr;  ///< aligned as uint64_t; (height + 2 margin) rows of 2 stride
  int stride = 0;            ///< at least width + 2 margin
  int margin = 0;            ///< at least finish_reach() + kFinishSlack if any stage is on
  int width = 0, height = 0;

  /// Pixel x = 0 of row y; x in -margin..stride - margin - 1, y in -margin..height + margin - 1. Before the row is
  /// resolved, its keys (pixel_key.h) lie where its colours and infos will be.
  uint64_t* key(int y) const {
    return reinterpret_cast<uint64_t*>(rows) + static_cast<size_t>(y + margin) * stride + margin;
  }
  uint32_t* colour(int y) const { return rows + static_cast<size_t>(y + margin) * 2 * stride + margin; }
  uint32_t* info(int y) const { return colour(y) + stride; }
};

/// The part of the tile that a stage may change: pixels farther than kFillReach from all non-empty ones stay empty.
/// Width or height 0: the tile is empty.
ResolvedTile crop_to_content(const ResolvedTile& tile, int reach);

/// Working memory of the stages, kept from tile to tile.
struct FinishScratch {
  struct Pixel {
    int x, y;
    uint32_t colour, info;
  };
  std::vector<Pixel> pixels;
  std::vector<uint32_t> rows;
  std::vector<uint32_t*> places;
};

/// Rule that selects the gaps to close.
enum class Gaps { kPinHoles, kAll };
/// Without antialiasing, gaps left open would not be softened: closes all.
constexpr Gaps gaps_to_fill(const Finish& f) { return f.antialias ? Gaps::kPinHoles : Gaps::kAll; }

/// Closes gaps in the tile grown by `grow` pixels. Reads kFillReach pixels more. Returns the number of closed pixels.
int fill_holes(const ResolvedTile& tile, int grow, Gaps gaps, FinishScratch& scratch);
/// Smooths the tile grown by `grow` pixels. Reads one pixel more.
void smooth(const ResolvedTile& tile, int grow, FinishScratch& scratch);
/// Antialiases the tile. Reads one pixel more.
void antialias(const ResolvedTile& tile, FinishScratch& scratch);

/// Rows [first, last) of `to`: bilinear between the pixels of `half`, whose centres lie at (2 i + 1, 2 j + 1); the
/// outermost pixels continue beyond their centres. Channels are off by at most 2 in 255. Depths are those of the
/// pixel of `half` that covers a pixel. Preconditions: half has half of to's size, rounded up, and depths if `to` has.
void double_rows(const FrameTarget& half, const FrameTarget& to, int first, int last);

}  // namespace telesplat::splat
