// Squares and discs: splats that face the screen (common/splat/flat/splat_table.h).
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

inline constexpr std::string_view kFlatVertex = R"(
flat out uvec3 splat;        // low half of the key; normal and spacing; depth code
flat out ivec2 first_pixel;  // of the splat's square, margin included
flat out vec2 centre;        // of the splat, from that pixel's corner
flat out vec3 shape;         // bias growth; half of the size; squared radius of the contour

void main() {
  Draw d = draws[draw_number];
  Cluster c = clusters[d.cluster];
  uint i = uint(gl_VertexID);
  vec3 p = point_position(d, i);
  float w = row(c.row_w, p);
  float steps = float(d.sub_steps);
  precise float inverse = steps / max(w, view.near_m);
  float shift = steps * 0.5 * float(1 - d.side);
  precise float fixed_x = row(c.row_x, p) * inverse + shift;
  precise float fixed_y = row(c.row_y, p) * inverse + shift;
  ivec2 fixed_place = ivec2(clamp(floor(vec2(fixed_x, fixed_y)), -1e6, 1e6));
  int bits = findMSB(d.sub_steps);
  ivec2 pixel = fixed_place >> bits;
  first_pixel = pixel + view.margin;
  centre = (vec2(fixed_place - (pixel << bits)) + 0.5) / steps + 0.5 * float(d.side - 1);
  shape = d.side == 1 ? vec3(0) : vec3(d.bias_growth, 0.5 * d.size, CONTOUR_R2(d.size));

  uint normal = point_normal(d, i);
  splat = uvec3(key_low(normal, point_albedo(d, i)), normal | d.spacing << 16, depth_code_of(w));
  place_square(first_pixel, d.side, w >= view.near_m && !faces_away(c, normal));
}
)";

/// CONTOUR_R2(size): squared radius of the circle on which q = 1 (KernelTraits::flat_contour_r2). DISTANCE2(d): squared
/// distance of the pixel at offset d in the metric in which the splat is a ball of radius shape.y
/// (KernelTraits::flat_distance2).
inline constexpr std::string_view kFlatFragment = R"(
flat in uvec3 splat;
flat in ivec2 first_pixel;
flat in vec2 centre;
flat in vec3 shape;
layout(location = 0) out uvec2 key;

void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy) - first_pixel;
  vec2 d = vec2(pixel) + 0.5 - centre;
  if (shape.y > 0.0 && DISTANCE2(d) > shape.y * shape.y && pixel != ivec2(centre)) discard;
  float r2 = dot(d, d);
  uint bias = min(uint(floor(shape.x * r2 + 0.5)), MAX_BIAS);
  uint ring = shape.y > 0.0 ? ring_of(r2 / shape.z) : 0u;
  uint high = key_high(splat.z + bias, splat.y >> 16, ring, splat.y & 0xffffu);
  gl_FragDepth = depth_test_value(high);
  key = uvec2(splat.x, high);
}
)";

}  // namespace telesplat::viewer::shaders
