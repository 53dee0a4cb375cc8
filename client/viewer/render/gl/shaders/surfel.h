// Ellipse and ewa: turns contours into pixels (common/splat/surfel/splat.h, operation by operation).
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

/// Stands after kContour.
inline constexpr std::string_view kSurfel = R"(
// Depth codes before rounding, and how they change as depth changes by its own size.
float depth_code_linear(float w) {
  return float(int(floatBitsToUint(w) - view.near_bits)) * (1.0 / float(1 << DEPTH_SHIFT));
}
float codes_per_depth(float w) { return uintBitsToFloat((floatBitsToUint(w) & 0x007fffffu) | 0x46800000u); }

struct Surfel {
  vec2 place;  // projected centre, pixels of the image
  float w;
  Contour contour;
  float determinant;  // of S
};

Surfel project_surfel(Draw d, uint i) {
  Cluster c = clusters[d.cluster];
  vec3 p = point_position(d, i);
  Surfel s;
  s.w = row(c.row_w, p);
  precise float inverse = 1.0 / max(s.w, view.near_m);
  precise float x = row(c.row_x, p) * inverse, y = row(c.row_y, p) * inverse;
  s.place = clamp(vec2(x, y), -1e5, 1e5);
  s.contour = surfel_contour(d.source, s.place, max(s.w, view.near_m), surfel_normal(point_normal(d, i)));
  precise float determinant = s.contour.xx * s.contour.yy - s.contour.xy * s.contour.xy;
  s.determinant = determinant;
  return s;
}

// d^T (grow S + add I)^-1 d = dx (conic.x dx + conic.y dy) + conic.z dy dy about `centre`.
struct Conic {
  vec2 centre;  // pixels of the image
  vec3 form;
  ivec2 first, last;  // pixels whose centres lie in its box, cut to MAX_SPLAT_SIDE
  float determinant;  // of the matrix
};

void conic_bounds(float centre, float reach, out int first, out int last) {
  int pixel = int(floor(centre));
  precise float from = centre - 0.5;
  precise float low = from - reach, high = from + reach;
  first = max(int(ceil(low)), pixel - (MAX_SPLAT_SIDE / 2 - 1));
  last = min(int(floor(high)) + 1, pixel + MAX_SPLAT_SIDE / 2 + 1);
  // The pixel that holds the centre, always: the others that this adds are outside the ellipse.
  first = min(first, pixel);
  last = max(last, pixel + 1);
}

Conic surfel_conic(Surfel s, float grow, float add) {
  Conic c;
  const float kFarthest = float(MAX_SPLAT_SIDE / 2 - 1);
  precise vec2 centre = s.place + clamp(s.contour.offset, -kFarthest, kFarthest);
  precise float xx = grow * s.contour.xx + add;
  precise float xy = grow * s.contour.xy;
  precise float yy = grow * s.contour.yy + add;
  precise float determinant = xx * yy - xy * xy;
  precise float inverse = 1.0 / determinant;
  precise vec3 form = vec3(yy * inverse, (xy * -2.0) * inverse, xx * inverse);
  c.centre = centre, c.form = form, c.determinant = determinant;
  conic_bounds(c.centre.x, sqrt(xx), c.first.x, c.last.x);
  conic_bounds(c.centre.y, sqrt(yy), c.first.y, c.last.y);
  return c;
}

// The depth code across a splat: .x + .y dx + .z dy, offsets from the conic's centre.
vec3 surfel_depth(Surfel s) {
  precise float scale = -codes_per_depth(s.w);
  precise float x = scale * s.contour.slope.x, y = scale * s.contour.slope.y;
  precise float code = (depth_code_linear(s.w) + x * s.contour.offset.x) + y * s.contour.offset.y;
  return vec3(code, x, y);
}

// A share of depth = clamp(factor * radius / w, least, most), in depth codes.
float surfel_share(float radius_m, float w, float factor, float least, float most) {
  precise float rho = min(radius_m / w, MAX_RADIUS_OVER_DEPTH);
  precise float share = codes_per_depth(w) * clamp(factor * rho, least, most);
  return share;
}

uint surfel_spacing(float determinant) {
  bvec3 reached = greaterThanEqual(vec3(determinant), view.spacing_limits.xyz);
  return uint(reached.x) + uint(reached.y) + uint(reached.z);
}

void place_conic(Conic c, bool seen) {
  ivec2 size = c.last - c.first;
  place_square(c.first + view.margin, max(size.x, size.y), seen);
}
)";

/// Values of a conic for fragments: outputs of the vertex stage, inputs of the fragment stage.
#define TELESPLAT_CONIC_VARYINGS(direction)                                  \
  "flat " direction                                                          \
  " vec4 conic_place;\n" /* its centre, pixels of the image; form.xy */      \
  "flat " direction                                                          \
  " vec4 conic_depth;\n"                  /* form.z; depth code across it */ \
  "flat " direction " ivec4 conic_box;\n" /* first pixel, first beyond, margin included */
inline constexpr std::string_view kConicOut = TELESPLAT_CONIC_VARYINGS("out");
inline constexpr std::string_view kConicIn = TELESPLAT_CONIC_VARYINGS("in");
#undef TELESPLAT_CONIC_VARYINGS

inline constexpr std::string_view kConicVertex = R"(
void send_conic(Conic c, vec3 depth) {
  conic_place = vec4(c.centre, c.form.xy);
  conic_depth = vec4(c.form.z, depth);
  conic_box = ivec4(c.first, c.last) + view.margin;
}
)";

inline constexpr std::string_view kConicFragment = R"(
// Offset of this pixel from the conic's centre; discards what lies outside the box.
vec2 conic_offset() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  if (any(lessThan(pixel, conic_box.xy)) || any(greaterThanEqual(pixel, conic_box.zw))) discard;
  precise vec2 d = (vec2(pixel - view.margin) + 0.5) - conic_place.xy;
  return d;
}
float conic_at(vec2 d) {
  precise float q = d.x * (conic_place.z * d.x + conic_place.w * d.y) + (conic_depth.x * d.y) * d.y;
  return q;
}
float code_at(vec2 d) {
  precise float code = (conic_depth.y + conic_depth.z * d.x) + conic_depth.w * d.y;
  return code;
}
// Whether this is the pixel that contains the conic's centre.
bool is_middle() { return ivec2(gl_FragCoord.xy) - view.margin == ivec2(floor(conic_place.xy)); }
)";

}  // namespace telesplat::viewer::shaders
