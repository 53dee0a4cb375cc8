// Parts of all shaders: the view, the coding of pixels (common/splat/pixel_key.h), points and their projection.
// Arithmetic has the same order as on the CPU, and `precise` forbids fusing it, so that both draw the same picture.
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

/// First part of every shader.
inline constexpr std::string_view kVersion = R"(#version 430 core
)";

/// ViewRecord of splat_passes.h, in the same order.
inline constexpr std::string_view kView = R"(
layout(std140, binding = 0) uniform View {
  vec4 right, down, forward;  // axes of the camera in room space
  vec2 focal, centre, step;   // pixels; pixels; 1 / focal
  vec2 frame_size;            // pixels, margin included
  ivec2 size;                 // pixels, without it
  float near_m;
  uint near_bits;
  int margin;                 // pixels around the image, so that splats whose centre is outside are not lost
  uint background;            // 0x00RRGGBB
  vec4 light;                 // ambient, head, key
  vec4 light_direction;       // of the key light, camera axes
  vec4 spacing_limits;        // of det S: ellipse
  uvec4 rim_bias;             // depth codes, for each class of spacing
} view;
)";

/// A pixel while splatting: a key of 64 bits in two halves, .x = low, .y = high.
inline constexpr std::string_view kKeys = R"(
const uvec2 kEmptyKey = uvec2(0xffffffffu);
const uint kEmptyInfo = 0xffffffffu;

uint depth_code_of(float depth_m) {
  return min((floatBitsToUint(depth_m) - view.near_bits) >> DEPTH_SHIFT, MAX_CENTRE_CODE);
}
float depth_of_code(uint code) {
  return uintBitsToFloat(view.near_bits + (code << DEPTH_SHIFT) + (1u << (DEPTH_SHIFT - 1)));
}
uint ring_of(float q) { return uint(min(8.0 * q, 7.0)); }

// Without the sign that the CPU's keys have.
uint key_high(uint code, uint spacing, uint ring, uint normal) {
  return code << 13 | spacing << 11 | ring << 8 | normal >> 8;
}
uint key_low(uint normal, uint albedo) { return normal << 24 | albedo; }
uint info_of_key(uvec2 key) { return key.y >> 13 << 8 | (key.y >> 8 & 31u); }
uint normal_of_key(uvec2 key) { return (key.y & 255u) << 8 | key.x >> 24; }

uint unbiased_depth_code(uint info) {
  uint bias = (view.rim_bias[info >> 3 & 3u] * (2u * (info & 7u) + 1u) + 8u) >> 4;
  uint code = info >> 8;
  return code - min(bias, code);
}

// The depth test orders pixels as their keys: 24 bits are exact in a float of [0, 1].
float depth_test_value(uint high) { return float(high >> 7) * (1.0 / 16777216.0); }
)";

/// Points, and the draws that send them, in the vertex stage. DrawRecord and ClusterRecord of splat_passes.h.
inline constexpr std::string_view kPoints = R"(
struct Cluster { vec4 row_x, row_y, row_w, facing; };
struct Draw {
  uint word, count, cluster, spacing;
  float size, bias_growth;
  int side, sub_steps;
  vec4 source;  // towards the sampling eye, in camera axes; radius in metres
};
layout(std430, binding = 0) readonly buffer Points { uint points[]; };
layout(std430, binding = 1) readonly buffer Draws { Draw draws[]; };
layout(std430, binding = 2) readonly buffer Clusters { Cluster clusters[]; };
layout(location = 0) in uint draw_number;

uint half_word(uint i) { return (points[i >> 1] >> ((i & 1u) * 16u)) & 0xffffu; }
vec3 point_position(Draw d, uint i) {
  uint first = 2u * d.word + i;
  return vec3(half_word(first), half_word(first + d.count), half_word(first + 2u * d.count));
}
uint point_normal(Draw d, uint i) { return half_word(2u * d.word + 3u * d.count + i); }
uint point_albedo(Draw d, uint i) { return points[d.word + 2u * d.count + i] & 0xffffffu; }

float row(vec4 r, vec3 p) {
  precise float xy = p.x * r.x + p.y * r.y;
  precise float h = (xy + p.z * r.z) + r.w;
  return h;
}

// Normal of 16 bits, not of unit length: whole numbers, as on the CPU.
vec3 whole_normal(uint code) {
  vec2 n = min(vec2(code & 255u, code >> 8) - 127.0, 127.0);
  float z = (127.0 - abs(n.x)) - abs(n.y), fold = max(-z, 0.0);
  return vec3(n.x - (n.x < 0.0 ? -fold : fold), n.y - (n.y < 0.0 ? -fold : fold), z);
}
// common/splat/facing.h
bool faces_away(Cluster c, uint normal) {
  vec3 n = whole_normal(normal);
  float towards = dot(n, c.facing.xyz);
  return towards < 0.0 && towards * towards > dot(n, n);
}

// A square of `side` pixels from `first` (margin included) on, or nothing.
void place_square(ivec2 first, int side, bool seen) {
  vec2 middle = (vec2(first) + 0.5 * float(side)) / view.frame_size;
  gl_Position = seen ? vec4(middle * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = float(side);
}
)";

/// Draws one triangle that covers the frame.
inline constexpr std::string_view kWholeFrame = R"(
void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }
)";

}  // namespace telesplat::viewer::shaders
