// The raster sampler's GLSL. A chunk's block of bytes (geometry/mesh_chunk.h) is vertex buffer, index buffer and
// storage buffer at once. The rasteriser finds which triangle a pixel sees; the fragment shader then intersects the
// pixel's ray with that triangle, as the ray sampler does, so that both give the same depths, colours and normals.
#pragma once

namespace telesplat::sampler {

inline constexpr const char* kVertexShader = R"(#version 430 core
layout(location = 0) in vec3 position_room;
uniform vec3 eye_room;
uniform mat3 to_camera;
uniform vec4 frustum;  // left, right, bottom, top at depth 1
uniform float near_m;
uniform vec4 clip[8];  // of each plane that is switched on: its normal, and how far inside the eye is
out float gl_ClipDistance[8];
void main() {
  for (int i = 0; i < 8; ++i) gl_ClipDistance[i] = dot(clip[i].xyz, position_room - eye_room) + clip[i].w;
  vec3 c = to_camera * (position_room - eye_room);  // relative first: exact where it matters, near the eye
  float w = -c.z;
  gl_Position = vec4((2 * c.x - (frustum.x + frustum.y) * w) / (frustum.y - frustum.x),
                     ((frustum.z + frustum.w) * w - 2 * c.y) / (frustum.w - frustum.z),  // first row = top
                     w - 2 * near_m, w);  // window depth 1 - near / w: reciprocal, no far plane
}
)";

inline constexpr const char* kFragmentShader = R"(#version 430 core
layout(early_fragment_tests) in;
layout(std430, binding = 0) readonly buffer Chunk { uint words[]; };
uniform uint vertices;
uniform vec3 eye_room;
uniform mat3 to_camera;
uniform vec4 frustum;
uniform vec2 size_pixels;
// Chunks with scalars: colours of the range, and last the one of scalars that are not a number.
layout(std430, binding = 1) readonly buffer Colours { uint table[]; };
uniform bool scalars;
uniform vec3 range;  // first scalar of the range, entries a unit, entry of the first
uniform uint entries;
layout(location = 0) out float depth_m;
layout(location = 1) out uint colour;
layout(location = 2) out uint normal;

vec3 relative_position(uint v) {
  uint at = 16u + 3u * v;
  return vec3(uintBitsToFloat(words[at]), uintBitsToFloat(words[at + 1u]), uintBitsToFloat(words[at + 2u])) - eye_room;
}
vec3 decode_normal32(uint code) {
  vec2 p = min(vec2(code & 65535u, code >> 16) / 32767.0 - 1.0, 1.0);
  float z = 1 - abs(p.x) - abs(p.y), fold = max(-z, 0.0);
  return normalize(vec3(p.x + (p.x >= 0 ? -fold : fold), p.y + (p.y >= 0 ? -fold : fold), z));
}
vec3 seen(vec3 n, vec3 side) { return dot(n, side) < 0 ? -n : n; }
uint encode_normal16(vec3 n) {
  vec2 p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
  if (n.z < 0) p = vec2((1 - abs(p.y)) * (p.x >= 0 ? 1 : -1), (1 - abs(p.x)) * (p.y >= 0 ? 1 : -1));
  uvec2 q = uvec2(clamp((p * 0.5 + 0.5) * 254.0 + 0.5, 0.0, 254.0)), upper = max(q, 254u - q);
  uint x = q.y == 0u || q.y == 254u ? upper.x : q.x, y = q.x == 0u || q.x == 254u ? upper.y : q.y;
  return x | y << 8;
}
vec3 albedo(uint v) {
  uint c = words[16u + 4u * vertices + v];
  return vec3(c >> 16 & 255u, c >> 8 & 255u, c & 255u);
}
bool missing(uint bits) { return (bits & 0x7fffffffu) > 0x7f800000u; }
// The corners' scalars, interpolated.
uint scalar_colour(uvec3 corner, vec3 weight) {
  uint first = 16u + 4u * vertices;
  uvec3 bits = uvec3(words[first + corner.x], words[first + corner.y], words[first + corner.z]);
  if (missing(bits.x) || missing(bits.y) || missing(bits.z)) return table[entries];
  float entry = (dot(weight, uintBitsToFloat(bits)) - range.x) * range.y + range.z;
  return table[uint(clamp(entry, 0.0, float(entries - 1u)))];
}

void main() {
  uint at = 16u + 5u * vertices + 3u * uint(gl_PrimitiveID);
  uvec3 corner = uvec3(words[at], words[at + 1u], words[at + 2u]);
  vec3 a = relative_position(corner.x), b = relative_position(corner.y), c = relative_position(corner.z);

  // The pixel's ray, and where it meets the triangle's plane (Moeller and Trumbore 1997; a is relative to the eye).
  vec2 uv = vec2(frustum.x + gl_FragCoord.x / size_pixels.x * (frustum.y - frustum.x),
                 frustum.w - gl_FragCoord.y / size_pixels.y * (frustum.w - frustum.z));
  vec3 d = transpose(to_camera) * vec3(uv, -1);
  vec3 e1 = b - a, e2 = c - a, g = cross(e1, e2), r = cross(a, d);
  float w1 = dot(r, e2), w2 = -dot(r, e1), total = dot(d, g);
  vec3 weight = vec3(total - w1 - w2, w1, w2) / total;
  // Edges are snapped to the rasteriser's grid, so a centre may lie a little outside: stay on the triangle.
  weight = total == 0 ? vec3(1.0 / 3) : clamp(weight, 0.0, 1.0);
  weight /= weight.x + weight.y + weight.z;

  vec3 p = weight.x * a + weight.y * b + weight.z * c;
  depth_m = -(to_camera * p).z;
  vec3 side = total > 0 ? -g : g;  // that is seen
  vec3 n = weight.x * seen(decode_normal32(words[16u + 3u * vertices + corner.x]), side) +
           weight.y * seen(decode_normal32(words[16u + 3u * vertices + corner.y]), side) +
           weight.z * seen(decode_normal32(words[16u + 3u * vertices + corner.z]), side);
  if (dot(n, n) < 1e-6) n = side;
  normal = encode_normal16(n - 1.02 * max(dot(n, d), 0) / dot(d, d) * d);  // hit_packet.h: kTurn
  if (scalars) {
    colour = scalar_colour(corner, weight);
    return;
  }
  uvec3 rgb = uvec3(weight.x * albedo(corner.x) + weight.y * albedo(corner.y) + weight.z * albedo(corner.z) + 0.5);
  colour = rgb.r << 16 | rgb.g << 8 | rgb.b;
}
)";

}  // namespace telesplat::sampler
