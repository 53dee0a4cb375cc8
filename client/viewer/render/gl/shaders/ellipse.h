// Ellipses: opaque splats that lie on the surface.
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

inline constexpr std::string_view kEllipseVertex = R"(
flat out uvec2 splat;  // low half of the key; normal and spacing
flat out float bias;   // on the contour, depth codes

void main() {
  Draw d = draws[draw_number];
  uint i = uint(gl_VertexID);
  Surfel s = project_surfel(d, i);
  Conic c = surfel_conic(s, 1.0, OPAQUE_VARIANCE);
  send_conic(c, surfel_depth(s));
  bias = min(surfel_share(d.source.w, s.w, BIAS_PER_RADIUS, LEAST_BIAS, MOST_BIAS), float(MAX_BIAS));
  uint normal = point_normal(d, i);
  splat = uvec2(key_low(normal, point_albedo(d, i)), normal | surfel_spacing(s.determinant) << 16);
  place_conic(c, s.w >= view.near_m && !faces_away(clusters[d.cluster], normal));
}
)";

inline constexpr std::string_view kEllipseFragment = R"(
flat in uvec2 splat;
flat in float bias;
layout(location = 0) out uvec2 key;

void main() {
  vec2 d = conic_offset();
  float q = conic_at(d);
  if (q > 1.0 && !is_middle()) discard;
  precise float code = code_at(d) + bias * min(q, 1.0);
  uint high = key_high(uint(clamp(code, 0.0, float(MAX_DEPTH_CODE))), splat.y >> 16, ring_of(q), splat.y & 0xffffu);
  gl_FragDepth = depth_test_value(high);
  key = uvec2(splat.x, high);
}
)";

}  // namespace telesplat::viewer::shaders
