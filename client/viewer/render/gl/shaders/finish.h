// The finish, as common/splat/finish.h defines it: fill, smooth, antialias. Integers throughout: the same pixels as on
// the CPU. Each stage takes the pairs that the stage before it left. It defines uvec2 resolve(ivec2 at), `at` with
// margin.
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

  uint weights = 0u, depth = 0u;
  uvec3 rgb = uvec3(0u);
  int supports = 0;
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      uvec2 pair = pair_at(at + ivec2(i, j));
      if ((i == 0 && j == 0) || gap(pair.y, closed) > kEdgeInfo) continue;
      uint w = i == 0 || j == 0 ? 2u : 1u;
      ++supports;
      weights += w;
      rgb += w * split(pair.x);
      depth += w * (pair.y >> 8);
    }
  if (supports < FILL_SUPPORTS) return here;
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
uvec2 resolve(ivec2 at) {
  uvec2 here = pair_at(at);
  uint least = here.y, most = here.y;
  uvec3 sum = uvec3(0u);
  for (int j = -1; j <= 1; ++j)
    for (int i = -1; i <= 1; ++i) {
      uvec2 pair = pair_at(at + ivec2(i, j));
      least = min(least, pair.y), most = max(most, pair.y);
      sum += split(pair.x) << uint((i == 0 ? 1 : 0) + (j == 0 ? 1 : 0));
    }
  if (most - least <= 2u * kEdgeInfo) return here;
  return uvec2(join((sum + 8u) >> 4), here.y);
}
)";

}  // namespace telesplat::viewer::shaders
