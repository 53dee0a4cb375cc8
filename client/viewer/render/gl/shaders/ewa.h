// Elliptical weighted average: visibility, weighted sums of visible splats, and their means
// (common/splat/ewa/ewa-inl.h).
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

/// Pass 1: depth of opaque ellipses only.
inline constexpr std::string_view kEwaVisibilityVertex = R"(
void main() {
  Draw d = draws[draw_number];
  Surfel s = project_surfel(d, uint(gl_VertexID));
  Conic c = surfel_conic(s, 1.0, OPAQUE_VARIANCE);
  send_conic(c, surfel_depth(s));
  place_conic(c, s.w >= view.near_m && !faces_away(clusters[d.cluster], point_normal(d, uint(gl_VertexID))));
}
)";

inline constexpr std::string_view kEwaVisibilityFragment = R"(
void main() {
  vec2 d = conic_offset();
  if (conic_at(d) > 1.0 && !is_middle()) discard;
  gl_FragDepth = clamp(code_at(d), 0.0, float(MAX_DEPTH_CODE)) / 262144.0;
}
)";

/// Pass 2: adds up, for each pixel, weight * (albedo, 1) and weight * (normal in camera axes as its 16 bits
/// give it, depth code of the sample).
inline constexpr std::string_view kEwaSumVertex = R"(
flat out vec3 albedo;
flat out vec3 normal;
flat out vec2 scale;        // of the weight; epsilon, depth codes

void main() {
  Draw d = draws[draw_number];
  uint i = uint(gl_VertexID);
  Surfel s = project_surfel(d, i);
  precise float grow = max(SUPPORT_GROWTH - SUPPORT_DROP / sqrt(max(s.determinant, 1e-12)), 1.0);
  Conic c = surfel_conic(s, grow, FILTER_VARIANCE);
  send_conic(c, surfel_depth(s));
  uint colour = point_albedo(d, i);
  albedo = vec3(uvec3(colour >> 16, colour >> 8, colour) & 255u);
  normal = s.contour.normal;
  scale = vec2(1.0 / min(c.determinant, 1e6),
               surfel_share(d.source.w, s.w, EPSILON_PER_RADIUS, LEAST_EPSILON, MOST_EPSILON));
  place_conic(c, s.w >= view.near_m && !faces_away(clusters[d.cluster], point_normal(d, uint(gl_VertexID))));
}
)";

inline constexpr std::string_view kEwaSumFragment = R"(
flat in vec3 albedo;
flat in vec3 normal;
flat in vec2 scale;
layout(binding = 0) uniform sampler2D visible;
layout(location = 0) out vec4 colour_sum;
layout(location = 1) out vec4 normal_sum;

void main() {
  vec2 d = conic_offset();
  float q = conic_at(d);
  if (q > 1.0) discard;
  float code = code_at(d);
  precise float foremost = code - scale.y;
  float nearest = texelFetch(visible, ivec2(gl_FragCoord.xy), 0).x;
  if (nearest >= 1.0 || foremost > nearest * 262144.0) discard;  // 1: no opaque ellipse, outside all silhouettes
  precise float inside = 1.0 - q;
  precise float inside2 = inside * inside;
  precise float weight = scale.x * (inside2 * inside2);
  colour_sum = weight * vec4(albedo, 1.0);
  normal_sum = weight * vec4(normal, conic_depth.y);
}
)";

/// The means, shaded with the interpolated normal (common/splat/ewa/shading.h).
inline constexpr std::string_view kEwaResolve = R"(
layout(binding = 0) uniform sampler2D colour_sums;
layout(binding = 1) uniform sampler2D normal_sums;

uvec2 resolve(ivec2 at) {
  vec4 colour = texelFetch(colour_sums, at, 0);
  if (!(colour.w > 0.0)) return uvec2(view.background, kEmptyInfo);
  vec4 normal = texelFetch(normal_sums, at, 0);
  // Normals that cancel are lit as if they lay across.
  float scale = 1.0 / sqrt(max(dot(normal.xyz, normal.xyz), 1e-30));
  float head = abs(normal.z) * scale;
  float key = max(dot(normal.xyz, view.light_direction.xyz) * scale, 0.0);
  float intensity = clamp((view.light.x + view.light.y * head) + view.light.z * key, 0.0, 1.0);
  uvec3 rgb = uvec3(min(colour.rgb * (intensity / colour.w) + 0.5, 255.0));
  uint code = uint(clamp(normal.w / colour.w + 0.5, 0.0, float(MAX_DEPTH_CODE)));
  return uvec2(rgb.r << 16 | rgb.g << 8 | rgb.b, code << 8);
}
)";

}  // namespace telesplat::viewer::shaders
