// The finish, as common/splat/finish.h defines it: fill, smooth, antialias. All in integers: the same pixels as on the
// CPU. Each stage reads the pairs of the stage before it, and defines uvec2 resolve(ivec2 at), `at` with margin.
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

inline constexpr std::string_view kFinish = R"(
layout(binding = 0) uniform usampler2D pairs;
const uint kEdgeInfo = EDGE << 8;
uvec2 pair_at(ivec2 at) { return texelFetch(pairs, at, 0).xy; }
uvec3 split(uint colour) { return uvec3(colour >> 16, colour >> 8, colour) & 255u; }
uint join(uvec3 rgb) { return rgb.r << 16 | rgb.g << 8 | rgb.b; }
)";

/// ENOUGH: true if supports suffice (common/splat/finish.h, Gaps), by their `count`, their `weights`, and if they are
/// `even`. BETWEEN: true if nearer neighbours of these `weights` suffice.
inline constexpr std::string_view kPinHoles = R"(
#define ENOUGH(count, weights, even) (weights >= ((even) ? FLAT_SUPPORTS : PIN_HOLE_SUPPORTS))
#define BETWEEN(weights) (weights >= BETWEEN_SUPPORTS)
)";
inline constexpr std::string_view kAllGaps = R"(
#define ENOUGH(count, weights, even) (count >= FILL_SUPPORTS)
#define BETWEEN(weights) false
)";
inline constexpr std::string_view kFill = R"(
uint gap(uint a, uint b) { return max(a, b) - min(a, b); }

uvec2 resolve(ivec2 at) {
  // Infos of the 5x5 pixels around; the least of each 3x3 window in them, and the largest of those.
  uint infos[25];
  for (int i = 0; i < 25; ++i) infos[i] = pair_at(at + ivec2(i % 5 - 2, i / 5 - 2)).y;
  uint closed = 0u;
  for (int y = 1; y <= 3; ++y)
    for (int x = 1; x <= 3; ++x) {
      uint least = kEmptyInfo;
      for (int j = -1; j <= 1; ++j)
        for (int i = -1; i <= 1; ++i) least = min(least, infos[5 * (y + j) + x + i]);
      closed = max(closed, least);
    }
  uvec2 here = pair_at(at);
  if (here.y <= closed || here.y - closed <= kEdgeInfo) return here;

  uint count = 0u, weights = 0u, nearest = kEmptyInfo, farthest = 0u, between = 0u, behind = 0u;
  for (int i = 0; i < 9; ++i) {
    if (i == 4) continue;
    uint info = infos[6 + 5 * (i / 3) + i % 3], w = i % 2 == 1 ? 2u : 1u;
    if (gap(info, closed) <= kEdgeInfo) {
      ++count, weights += w;
      nearest = min(nearest, info), farthest = max(farthest, info);
    }
    if (info < here.y && here.y - info > kEdgeInfo) between += w, behind = max(behind, info);
  }
  uint target = closed;
  if (!ENOUGH(count, weights, max(farthest, nearest) - nearest <= FLAT << 8)) {
    if (!BETWEEN(between)) return here;
    target = behind;
  }
  uint depth = 0u;
  uvec3 rgb = uvec3(0u);
  weights = 0u;
  for (int i = 0; i < 9; ++i) {
    uvec2 pair = pair_at(at + ivec2(i % 3 - 1, i / 3 - 1));
    if (i == 4 || gap(pair.y, target) > kEdgeInfo) continue;
    uint w = i % 2 == 1 ? 2u : 1u;
    weights += w;
    rgb += w * split(pair.x);
    depth += w * (pair.y >> 8);
  }
  return uvec2(join((rgb + weights / 2u) / weights), depth / weights << 8);
}
)";

inline constexpr std::string_view kSmooth = R"(
uint gap(uint a, uint b) { return max(a, b) - min(a, b); }

// 8 times the centre smoothed with its two neighbours, by its spacing class.
uvec3 smooth3(uvec3 before, uvec3 centre, uvec3 after, uint info_before, uint info, uint info_after) {
  uint spacing = info >> 3 & 3u;
  if (spacing == 0u) return centre * 8u;
  uvec3 b = gap(info, info_before) > kEdgeInfo ? centre : before;
  uvec3 a = gap(info, info_after) > kEdgeInfo ? centre : after;
  uvec3 four = b + a + centre * 2u;
  return spacing > 1u ? four * 2u : four + centre * 4u;
}

uvec2 resolve(ivec2 at) {
  uvec3 rows[3];
  uint infos[3];
  uvec2 here = pair_at(at);
  for (int j = 0; j < 3; ++j) {
    ivec2 p = at + ivec2(0, j - 1);
    uvec2 before = pair_at(p - ivec2(1, 0)), centre = pair_at(p), after = pair_at(p + ivec2(1, 0));
    rows[j] = smooth3(split(before.x), split(centre.x), split(after.x), before.y, centre.y, after.y);
    infos[j] = centre.y;
  }
  uvec3 rgb = smooth3(rows[0], rows[1], rows[2], infos[0], infos[1], infos[2]);
  return uvec2(join((rgb + 32u) >> 6), here.y);
}
)";

inline constexpr std::string_view kAntialias = R"(
const uint kOfNear[34] = uint[34](COVERAGE_NEAR), kOfFar[34] = uint[34](COVERAGE_FAR);

uvec2 resolve(ivec2 at) {
  uvec2 pairs_there[9];
  uvec2 here = pair_at(at);
  uint least = here.y, most = here.y;
  for (int i = 0; i < 9; ++i) {
    pairs_there[i] = pair_at(at + ivec2(i % 3 - 1, i / 3 - 1));
    least = min(least, pairs_there[i].y), most = max(most, pairs_there[i].y);
  }
  if (most - least <= 2u * kEdgeInfo) return here;
  uvec3 near = uvec3(0u), far = uvec3(0u);
  uint weight = 0u;
  for (int i = 0; i < 9; ++i) {
    uint w = (i % 3 == 1 ? 2u : 1u) * (i / 3 == 1 ? 2u : 1u);
    uvec3 c = w * split(pairs_there[i].x);
    if (pairs_there[i].y - least <= kEdgeInfo)
      near += c, weight += w;
    else
      far += c;
  }
  uint i = weight + (here.y - least <= kEdgeInfo ? 17u : 0u);
  return uvec2(join((near * kOfNear[i] + far * kOfFar[i] + 32768u) >> 16), here.y);
}
)";

}  // namespace telesplat::viewer::shaders
