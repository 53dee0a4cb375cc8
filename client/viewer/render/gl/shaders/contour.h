// Computes a sample's footprint on the screen: common/splat/surfel/surfel-inl.h, operation by operation.
// Based on: M. Zwicker, J. Raesaenen, M. Botsch, C. Dachsbacher, M. Pauly, "Perspective accurate splatting", Graphics
// Interface 2004.
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

inline constexpr std::string_view kContour = R"(
float dot_in_order(vec3 a, vec3 b) {
  precise float sum = (a.x * b.x + a.y * b.y) + a.z * b.z;
  return sum;
}

vec3 to_camera(vec3 v) {
  return vec3(dot_in_order(view.right.xyz, v), dot_in_order(view.down.xyz, v), dot_in_order(view.forward.xyz, v));
}

// copysign(magnitude, s): the bits tell apart what sign() does not, 0 and -0.
float with_sign(float magnitude, float s) {
  return uintBitsToFloat((floatBitsToUint(magnitude) & 0x7fffffffu) | (floatBitsToUint(s) & 0x80000000u));
}

// Normal of 16 bits, not of unit length: its coordinates are whole numbers.
vec3 surfel_normal(uint code) {
  float x = min(float(code & 255u) - 127.0, 127.0), y = min(float(code >> 8) - 127.0, 127.0);
  float z = (127.0 - abs(x)) - abs(y), fold = max(-z, 0.0);
  return vec3(x - with_sign(fold, x), y - with_sign(fold, y), z);
}

struct Contour {
  vec2 offset;      // of the ellipse's centre from the projected centre of the splat, pixels
  float xx, xy, yy; // a pixel at d from the contour's centre is inside if d^T S^-1 d <= 1
  vec2 slope;       // depth of the tangent plane = w / (1 + slope . offset from the projected centre)
  vec3 normal;      // in camera axes, not of unit length
};

// source: direction to the sampling eye in camera axes, radius in metres. place: projected centre, pixels; w: its
// depth.
Contour surfel_contour(vec4 source, vec2 place, float w, vec3 normal_room) {
  vec3 m = to_camera(normal_room);
  vec3 e = source.xyz;
  precise float u = (place.x - view.centre.x) * view.step.x;
  precise float v = (place.y - view.centre.y) * view.step.y;

  precise float sx = m.x - u * m.z;
  precise float sy = m.y - v * m.z;
  precise float i = 1.0 / ((m.x * m.x + m.y * m.y) + m.z * m.z);
  precise float em = (m.x * e.x + m.y * e.y) + m.z * e.z;
  precise float em_i = em * i;
  precise float kappa = 1.0 / max(em * em_i, MIN_SAMPLED_COSINE * MIN_SAMPLED_COSINE);
  precise float tx = (e.x - u * e.z) - em_i * sx;
  precise float ty = (e.y - v * e.z) - em_i * sy;
  precise float tz = e.z - em_i * m.z;

  precise float isx = i * sx, isy = i * sy, isz = i * m.z;
  precise float ktx = kappa * tx, kty = kappa * ty, ktz = kappa * tz;
  precise float gxx = ((1.0 + u * u) - isx * sx) + ktx * tx;
  precise float gyy = ((1.0 + v * v) - isy * sy) + kty * ty;
  precise float gxy = (u * v - isx * sy) + ktx * ty;
  precise float gxz = (ktx * tz - isx * m.z) - u;
  precise float gyz = (kty * tz - isy * m.z) - v;
  precise float gzz = (1.0 - isz * m.z) + ktz * tz;

  precise float rho = min(source.w / w, MAX_RADIUS_OVER_DEPTH);
  precise float rho2 = rho * rho;
  precise float k = 1.0 - rho2 * gzz;
  bool parallel = k < 0.25;
  precise float a = rho2 / (parallel ? 1.0 : k);
  float shift = parallel ? 0.0 : a;
  precise float ax = a * view.focal.x, ay = a * view.focal.y;

  Contour c;
  precise float cx = -((shift * view.focal.x) * gxz);
  precise float cy = -((shift * view.focal.y) * gyz);
  precise float xx = (ax * view.focal.x) * gxx + cx * cx;
  precise float xy = (ax * view.focal.y) * gxy + cx * cy;
  precise float yy = (ay * view.focal.y) * gyy + cy * cy;
  c.offset = vec2(cx, cy);
  c.xx = xx, c.xy = xy, c.yy = yy;

  // The tangent plane m . P = m . p. Seen edge-on it has no depth to follow: it gets the steepest.
  precise float along = (m.x * u + m.y * v) + m.z;
  precise float inverse = 1.0 / with_sign(max(abs(along), 1e-3), along);
  vec2 limit = STEEPEST * view.step;
  precise vec2 slope = (m.xy * inverse) * view.step;
  c.slope = clamp(slope, -limit, limit);
  c.normal = m;
  return c;
}
)";

}  // namespace telesplat::viewer::shaders
