// The number of a mosaic's points to draw: level of detail as a function without steps (T4.4.3.1).
#pragma once

#include <algorithm>

#include "common/points/point_model.h"

namespace telesplat::splat {

/// The mosaic's first `count` points: [0, mean) in the mean colours of level fine + 1, [mean, count) in the colours of
/// level `fine`. Either part may be empty. Lengths are in samples of level 0.
struct Drawn {
  uint32_t count, mean;
  int fine;
  float spacing;  ///< mean spacing: of evenly spread points of the same density
  float widest;   ///< largest spacing between neighbours, which splats must bridge
};

/// A mosaic whose next level adds fewer points than this switches as a whole, each at its own ratio: a few new points
/// are not noticed, and one draw item costs less than two.
inline constexpr uint32_t kSmallStep = 32;

/// Levels blend into each other within a quarter of an octave on both sides of the ratio at which the closest one
/// changes. Set by bench lod_transitions, away from a terrain and back. Whole levels: 31.0 dB and 7 popping blocks a
/// second. This width: 30.8 dB and 0.75. Half an octave (all ratios in transition): 30.1 dB and 22, since then even
/// views at the samples' own rate change. Along a recorded movement, which hardly switches levels, this width costs
/// 0.35 dB.
inline constexpr float kTransitionBegin = 0.59460356f, kTransitionEnd = 0.84089642f;  ///< 2^(-1/2 -+ 1/4)

/// The level whose pixel range is closest, in ratio, to `wanted` times level 0's.
inline Drawn closest_level(const points::Mosaic& m, float wanted) {
  static_assert(points::kLevels == 3);
  const int l = wanted >= 0.70710678f ? 0 : wanted >= 0.35355339f ? 1 : 2;
  const auto side = static_cast<float>(1 << l);
  return {m.count(l), 0, l, side, side};
}

/// Largest spacing of points, in samples of a level, if `share` of that level's additional points is drawn. It follows
/// from the order of ranks (decimate.h): 2 until half of the level is drawn (share 1/3), then a quincunx's sqrt 2, and
/// 1 when all points are. Each step is spread over a share of 0.2.
inline float widest_spacing(float share) {
  const auto ramp_down = [share](float from, float to) { return std::clamp((to - share) / (to - from), 0.0f, 1.0f); };
  return 1.0f + 0.58578644f * ramp_down(0.23f, 0.43f) + 0.41421356f * ramp_down(0.8f, 1.0f);
}

/// As closest_level, but near the ratio at which the level changes only a share of the finer level's additional points
/// is drawn. The share rises continuously from 0 to 1 with `wanted`, so that the density is quadratic in `wanted`. The
/// same share of the coarse level's points has its own colours instead of mean ones.
///   dither: in [0, 1), different for each mosaic: sets the ratio at which a small one switches.
inline Drawn between_levels(const points::Mosaic& m, float wanted, float dither) {
  static_assert(points::kLevels == 3);
  int fine = 0;
  if (wanted <= kTransitionBegin) fine = 1, wanted *= 2;
  if (wanted <= kTransitionBegin) return {m.count(2), 0, 2, 4.0f, 4.0f};
  const auto side = static_cast<float>(1 << fine);
  if (wanted >= kTransitionEnd) return {m.count(fine), 0, fine, side, side};
  const float t = (wanted - kTransitionBegin) / (kTransitionEnd - kTransitionBegin), spacing = 2.0f / (1.0f + t) * side;
  const float share = ((1.0f + t) * (1.0f + t) - 1.0f) / 3.0f;
  const uint32_t coarse = m.count(fine + 1), step = m.count(fine) - coarse;
  if (step < kSmallStep)
    return share > dither ? Drawn{m.count(fine), 0, fine, spacing, side}
                          : Drawn{coarse, 0, fine + 1, spacing, 2.0f * side};
  const auto part = [](float s, uint32_t n) {
    return std::min(static_cast<uint32_t>(s * static_cast<float>(n) + 0.5f), n);
  };
  return {coarse + part(share, step), part(1.0f - share, coarse), fine, spacing, widest_spacing(share) * side};
}

}  // namespace telesplat::splat
