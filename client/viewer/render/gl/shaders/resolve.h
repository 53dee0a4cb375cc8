// Turns keys into pairs (colour, info), and ends passes over the whole frame. Empty pixels have the background's
// colour.
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

/// Shades by the intensity of each of the 65536 normals, packed four to a word.
inline constexpr std::string_view kResolve = R"(
layout(binding = 0) uniform usampler2D keys;
layout(std430, binding = 3) readonly buffer Intensities { uint intensities[]; };

uint shade(uint albedo, uint light) {
  uvec3 rgb = ((uvec3(albedo >> 16, albedo >> 8, albedo) & 255u) * light + 127u) / 255u;
  return rgb.r << 16 | rgb.g << 8 | rgb.b;
}

// Low half: shaded colour; high half: depth code << 8 | spacing << 3 | ring, kEmptyInfo where nothing is.
uvec2 resolve(ivec2 at) {
  uvec2 key = texelFetch(keys, at, 0).xy;
  if (key == kEmptyKey) return uvec2(view.background, kEmptyInfo);
  uint normal = normal_of_key(key);
  uint light = (intensities[normal >> 2] >> ((normal & 3u) * 8u)) & 255u;
  return uvec2(shade(key.x & 0xffffffu, light), info_of_key(key));
}
)";

/// Ends a whole-frame pass, after a part that has uvec2 resolve(ivec2 at).
inline constexpr std::string_view kToPairs = R"(
layout(location = 0) out uvec2 pair;
void main() { pair = resolve(ivec2(gl_FragCoord.xy)); }
)";

/// Writes the output, without the margin. A frame buffer without depth has no second attachment.
inline constexpr std::string_view kToOutput = R"(
layout(location = 0) out vec4 out_colour;
layout(location = 1) out float out_depth_m;
void main() {
  uvec2 pair = resolve(ivec2(gl_FragCoord.xy) + view.margin);
  out_colour = vec4(vec3(uvec3(pair.x >> 16, pair.x >> 8, pair.x) & 255u) / 255.0, 1.0);
  out_depth_m = pair.y == kEmptyInfo ? uintBitsToFloat(0x7f800000u) : depth_of_code(unbiased_depth_code(pair.y));
}
)";

}  // namespace telesplat::viewer::shaders
