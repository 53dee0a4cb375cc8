// The scalar oracle of the Julia kernels: one ray after the other, the same operations in the same order. Read this
// file first.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>

#include "services/sampler/julia/steps.h"
#include "services/sampler/julia/trace.h"

namespace telesplat::sampler {
namespace plain {

using Constants = JuliaScene::Constants;

struct Vec4 {
  float v[4];
};
inline Vec4 along(const float* origin, const Vec4& d, float t) {
  Vec4 q;
  for (int i = 0; i < 4; ++i) q.v[i] = origin[i] + t * d.v[i];
  return q;
}
// Change of orbit coordinates for a step of n, set units, in room space.
inline Vec4 orbit_vector(const Constants& k, const float* n) {
  Vec4 d;
  for (int i = 0; i < 4; ++i) d.v[i] = (n[0] * k.axes[0][i] + n[1] * k.axes[1][i]) + n[2] * k.axes[2][i];
  return d;
}

// log x for normal x > 0: x = 2^e m, m in [sqrt(1/2), sqrt(2)), log m = 2 artanh s, s = (m - 1) / (m + 1). Error below
// 2e-7.
inline float log_of(float x) {
  const uint32_t offset = std::bit_cast<uint32_t>(x) - kSqrtHalfBits;
  const auto e = static_cast<float>(static_cast<int32_t>(offset) >> 23);
  const float m = std::bit_cast<float>((offset & 0x7fffff) + kSqrtHalfBits);
  const float s = (m - 1.0f) / (m + 1.0f), z = s * s;
  const float series = z * (kArtanh3 + z * (kArtanh5 + z * kArtanh7));
  return e * kLog2 + (s + s) * (1.0f + series);
}

// The distance estimate in set units.
inline float estimate(const Constants& k, const Vec4& q) {
  float w = q.v[0], p = q.v[1], r = q.v[2] * q.v[2] + q.v[3] * q.v[3], d = 1;
  for (int i = 0; i <= k.iterations; ++i) {
    const float ww = w * w, n = ww + (p * p + r);
    if (n > k.limit) return std::min(0.125f * std::sqrt(n / d) * log_of(n * 0.25f), k.radius);
    d = d * n;
    p = w * p + k.c_p;
    r = ww * r;
    w = (ww - n * 0.5f) + k.c_w;
  }
  return 0;
}

inline float dot(const float* a, const float* b) { return (a[0] * b[0] + a[1] * b[1]) + a[2] * b[2]; }

// Depths between which a line lies in the ball |q| <= radius, in the box and inside the clip's planes, all grown by
// `margin`; t1 < t0: it misses them.
struct Interval {
  float t0, t1;
};
inline Interval clip(const Constants& k, const JuliaRays& rays, const float* d, float ball, float margin) {
  const float* o = rays.origin;
  float a = 0, b = 0, c = -(ball * ball);
  for (int i = 0; i < 4; ++i) a = a + d[i] * d[i], b = b + o[i] * d[i], c = c + o[i] * o[i];
  const float inside = b * b - a * c, root = std::sqrt(std::max(inside, 0.0f));
  Interval out{std::max(rays.near_m, (-b - root) / a), (-b + root) / a};
  if (inside < 0) out.t1 = -1;
  for (int i = 0; i < 3; ++i) {
    const float v = d[4 + i], inverse = 1.0f / (std::abs(v) < kParallel ? kParallel : v);
    const float ta = ((k.box_lo[i] - margin) - o[4 + i]) * inverse, tb = ((k.box_hi[i] + margin) - o[4 + i]) * inverse;
    out.t0 = std::max(out.t0, std::min(ta, tb));
    out.t1 = std::min(out.t1, std::max(ta, tb));
  }
  for (int i = 0; i < k.planes; ++i) {
    const float v = dot(k.plane_normal[i], d + 4), inverse = 1.0f / (std::abs(v) < kParallel ? kParallel : v);
    const float t = ((k.plane_offset[i] - margin) - dot(k.plane_normal[i], o + 4)) * inverse;
    if (inverse > 0)
      out.t0 = std::max(out.t0, t);
    else
      out.t1 = std::min(out.t1, t);
  }
  return out;
}

inline float speed_of(const float* d) {
  return 0.5f * std::sqrt((d[0] * d[0] + d[1] * d[1]) + (d[2] * d[2] + d[3] * d[3]));
}

// Depth up to which the rays of a block are free; kNothing if they meet nothing.
inline float cone_start(const Constants& k, const JuliaRays& rays, int block_x, int block_y) {
  float d[7];
  for (int i = 0; i < 7; ++i) d[i] = rays.block_column[i][block_x] + rays.block_row[i][block_y];
  const Interval range = clip(k, rays, d, rays.block_ball, rays.block_margin);
  const float growth = rays.spread + kConeMargin * k.lod * rays.footprint;
  const float scale = 1.0f / (speed_of(d) + growth);
  float t = range.t0;
  for (int i = 0; i < kMaxConeSteps; ++i) {
    if (t > range.t1) return kNothing;
    const float radius = growth * t, free = estimate(k, along(rays.origin, {d[0], d[1], d[2], d[3]}, t)) - radius;
    if (free < kConeStop * radius) break;
    t = t + free * scale;
  }
  return t;
}

// Depths before and behind the surface, and the estimate minus the threshold there: g0 > 0 >= g1, or t0 = t1 if a ray
// begins below the surface.
struct Bracket {
  float t0, g0, t1, g1;
};
inline bool march(const Constants& k, const JuliaRays& rays, const Vec4& d, Interval range, Bracket& out) {
  const float inverse = 1.0f / speed_of(d.v), threshold = (k.lod * rays.footprint) * inverse;  // set units -> depth
  float t = range.t0, last_t = t, last_r = 0;
  for (int i = 0; i < kMaxSteps; ++i) {
    const float r = estimate(k, along(rays.origin, d, t)) * inverse, gone = t - last_t;
    if (gone >
        last_r * kSlack + r * kTrust) {  // the free balls about the two points do not meet: take the safe step instead
      t = last_t + last_r;
      continue;
    }
    const float g = r - threshold * t;
    if (g <= 0) {
      out = gone == 0 ? Bracket{t, 0, t, -1} : Bracket{last_t, last_r - threshold * last_t, t, g};
      return true;
    }
    if (t + r >= range.t1) return false;
    // If the estimate goes on changing as it did, the next free ball touches this one:
    // r + r' = step, r' = r + slope * step.
    const float slope = gone > 0 ? (r - last_r) / gone : -1.0f;
    const float ratio = std::max(kRelax / (1.0f - std::min(std::max(slope, -1.0f), kMaxSlope)), 1.0f);
    // Close by, the surface may stay within the threshold for less than a step: take short steps.
    const float most = r < kNear * (threshold * t) ? kNearRatio : ratio;
    last_t = t, last_r = r;
    t = std::min(t + r * std::min(ratio, most), range.t1);
  }
  return false;
}

// Regula falsi by the Illinois rule: an end that stays has its value halved.
inline float refine(const Constants& k, const JuliaRays& rays, const Vec4& d, Bracket b) {
  const float inverse = 1.0f / speed_of(d.v), threshold = (k.lod * rays.footprint) * inverse;
  const auto secant = [&] { return b.t0 + (b.t1 - b.t0) * (b.g0 / std::max(b.g0 - b.g1, kTiny)); };
  for (int i = 0; i < kRefinements; ++i) {
    const float t = secant(), g = estimate(k, along(rays.origin, d, t)) * inverse - threshold * t;
    if (g > 0) {
      b.t0 = t, b.g0 = g, b.g1 = b.g1 * 0.5f;
    } else {
      b.t1 = t, b.g1 = g, b.g0 = b.g0 * 0.5f;
    }
  }
  return secant();
}

// The orbit of a surface point with its derivatives along X, Y, Z: half the gradient of N at its escape (0 if it does
// not escape), and the least square of the length that the colour uses.
struct Orbit {
  float gradient[3], trap;
};
inline Orbit follow(const Constants& k, const Vec4& q) {
  const float r0 = q.v[2] * q.v[2] + q.v[3] * q.v[3];
  const float across = k.plane[1] * q.v[2] + k.plane[2] * q.v[3];
  float w = q.v[0], p = q.v[1], s = 1;  // s: factor by which r1 and r2 have been multiplied
  float dw[3], dp[3], ds[3] = {0, 0, 0}, dr0[3];
  for (int i = 0; i < 3; ++i)
    dw[i] = k.axes[i][0], dp[i] = k.axes[i][1], dr0[i] = q.v[2] * k.axes[i][2] + q.v[3] * k.axes[i][3];
  Orbit out{{0, 0, 0}, k.limit};
  for (int i = 0; i <= k.iterations; ++i) {
    const float ww = w * w, ss = s * s, rr = ss * r0, off_axis = p * p + rr, n = ww + off_axis, sr0 = s * r0;
    float wdw[3], rest[3];
    for (int a = 0; a < 3; ++a) wdw[a] = w * dw[a], rest[a] = (p * dp[a] + sr0 * ds[a]) + ss * dr0[a];
    if (n > k.limit) {
      for (int a = 0; a < 3; ++a) out.gradient[a] = wdw[a] + rest[a];
      break;
    }
    const float off_plane = k.plane[0] * p + across * s;
    out.trap =
        std::min(out.trap, k.colour == static_cast<int>(julia::Colour::kTrap) ? off_axis : off_plane * off_plane);
    for (int a = 0; a < 3; ++a) {
      dp[a] = dw[a] * p + w * dp[a];
      ds[a] = dw[a] * s + w * ds[a];
      dw[a] = wdw[a] - rest[a];
    }
    p = w * p + k.c_p;
    s = w * s;
    w = (ww - n * 0.5f) + k.c_w;
  }
  if (k.colour == static_cast<int>(julia::Colour::kDistance)) out.trap = (q.v[0] * q.v[0] + q.v[1] * q.v[1]) + r0;
  return out;
}

// Scales to unit length; false if n is zero or not finite.
inline bool normalise(float* n) {
  const float most = std::max(std::max(std::abs(n[0]), std::abs(n[1])), std::abs(n[2]));
  for (int i = 0; i < 3; ++i)
    if (!(std::abs(n[i]) < kNothing)) return false;
  if (!(most > kTiny)) return false;
  for (int i = 0; i < 3; ++i) n[i] = n[i] / most;
  const float length = std::sqrt(dot(n, n));
  for (int i = 0; i < 3; ++i) n[i] = n[i] / length;
  return true;
}

// At a rim a surface turns away within a pixel: the surface is rounded by its threshold, which is less than a pixel.
// One ray meets it anywhere between facing and edge-on, so rims would be dotted with dark pixels. A steep normal
// becomes the mean of itself and the one half a pixel further in, away from the rim. If nothing is there, as in a
// thread thinner than a pixel, the direction towards the viewer replaces it. Flat surfaces keep their normals at any
// steepness. back: towards the viewer, unit length; reach: a pixel there, in set units.
inline void widen(const Constants& k, const Vec4& q, float reach, const float* back, float* n) {
  const float lean = dot(n, back), in = kInward * reach;
  if (!(lean < kSteep)) return;
  float side[3];
  for (int i = 0; i < 3; ++i) side[i] = n[i] - back[i] * lean;
  normalise(side);
  // Starts before the surface: by the rise of a flat one on the way in, and as much more.
  const float slope = std::sqrt(std::max(1.0f - lean * lean, 0.0f)) / std::max(lean, kLeastLean);
  const Vec4 towards = orbit_vector(k, back), base = along(q.v, orbit_vector(k, side), -in);
  float ahead = in * (std::min(slope, kInwardSlope) + 1.0f), off = 0;
  for (int i = 0; i < kInwardSteps; ++i) {
    off = estimate(k, along(base.v, towards, ahead)) - k.lod * reach;
    ahead = ahead - off;
  }
  Orbit second = follow(k, along(base.v, towards, ahead));
  const bool found = normalise(second.gradient) && dot(second.gradient, back) > 0 && std::abs(off) < kInwardOff * reach;
  for (int i = 0; i < 3; ++i) n[i] = n[i] + (found ? second.gradient[i] : back[i]);
  normalise(n);
}

// Returns the gradient if it is good; else the estimate's differences over a footprint; else the direction towards the
// viewer. A normal that still faces away, at a silhouette, is turned until it just does not.
inline void normal_at(const Constants& k, const Vec4& q, const float* gradient, float reach, const float* ray,
                      float* n) {
  float back[3] = {-ray[0], -ray[1], -ray[2]};
  normalise(back);
  std::copy_n(gradient, 3, n);
  if (!normalise(n) || dot(n, back) < 0) {
    for (int i = 0; i < 3; ++i) {
      Vec4 step;
      for (int j = 0; j < 4; ++j) step.v[j] = k.axes[i][j];
      n[i] = estimate(k, along(q.v, step, reach)) - estimate(k, along(q.v, step, -reach));
    }
    if (!normalise(n)) std::copy_n(back, 3, n);
  }
  const float lean = dot(n, back);
  if (lean < 0) {
    for (int i = 0; i < 3; ++i) n[i] = n[i] + back[i] * (kLeast - lean);
    normalise(n);
  }
  widen(k, q, reach, back, n);
}

// Set units from a point of the room to where a line leaves the part that the clip keeps: removed parts darken nothing.
inline float exit_of(const Constants& k, const float* room, const float* towards) {
  float out = kNothing;
  for (int i = 0; i < k.planes; ++i) {
    const float inside = dot(k.plane_normal[i], room) - k.plane_offset[i], along = dot(k.plane_normal[i], towards);
    if (along < 0) out = std::min(out, std::max(inside / -along, 0.0f) * k.units_per_metre);
  }
  return out;
}

inline float occlusion_at(const Constants& k, const Vec4& q, const float* n, float exit) {
  const Vec4 step = orbit_vector(k, n);
  float sum = 0;
  for (int i = 0; i < kOcclusionSteps; ++i) {
    const float h = kOcclusionAt[i] * k.radius;
    const float open = h > exit ? 1.0f : std::min(estimate(k, along(q.v, step, h)) / (kOpen * h), 1.0f);
    sum = sum + kOcclusionWeight[i] * (1.0f - open);
  }
  return sum;
}

// 0 in full shadow .. 1 in full light.
inline float lit_at(const Constants& k, const Vec4& q, float exit) {
  const Vec4 step = orbit_vector(k, k.light);
  float lit = 1, s = kShadowBegin * k.radius;
  for (int i = 0; i < kShadowSteps && s < std::min(kShadowEnd * k.radius, exit) && lit > 0; ++i) {
    const float r = estimate(k, along(q.v, step, s));
    lit = std::min(lit, kShadowSharpness * r / s);
    s = s + std::max(r, kShadowLeast * k.radius);
  }
  return lit;
}

inline void add_point(const Constants& k, const JuliaRays& rays, int x, int y, const float* d, const Bracket& bracket,
                      JuliaPoints& out) {
  const Vec4 direction{d[0], d[1], d[2], d[3]};
  const float t = refine(k, rays, direction, bracket);
  const Vec4 q = along(rays.origin, direction, t);
  const Orbit orbit = follow(k, q);
  float n[3];
  normal_at(k, q, orbit.gradient, rays.footprint * t, d + 4, n);
  if (bracket.t0 == bracket.t1) face_normal(k, rays, d + 4, t, n);
  float light = 1, room[3];
  for (int a = 0; a < 3; ++a) room[a] = rays.origin[4 + a] + t * d[4 + a];
  if (k.ambient > 0) light = light * (1.0f - k.ambient * occlusion_at(k, q, n, exit_of(k, room, n)));
  if (k.shadow > 0) light = light * (1.0f - k.shadow * (1.0f - lit_at(k, q, exit_of(k, room, k.light))));

  const int i = out.count++;
  out.x[i] = x, out.y[i] = y;
  out.depth_m[i] = t;
  for (int a = 0; a < 3; ++a) out.normal[a][i] = n[a];
  out.tone[i] = std::sqrt(orbit.trap) * k.tone_scale + k.tone_shift;
  out.light[i] = light;
}

inline void trace_block(const Constants& k, const JuliaRays& rays, const JuliaPart& part, int block, JuliaPoints& out) {
  const float start = cone_start(k, rays, block, part.block_row);
  for (int row = 0; row < kJuliaBlock; ++row)
    for (int column = 0; column < kJuliaBlock; ++column) {
      if (!(part.wanted[row][block - part.block_begin] >> column & 1)) continue;
      const int x = block * kJuliaBlock + column, y = part.block_row * kJuliaBlock + row;
      float d[7];
      for (int i = 0; i < 7; ++i) d[i] = rays.column[i][x] + rays.row[i][y];
      Interval range = clip(k, rays, d, rays.ball, 0);
      range.t0 = std::max(range.t0, start);
      Bracket bracket;
      if (range.t0 <= range.t1 && march(k, rays, {d[0], d[1], d[2], d[3]}, range, bracket))
        add_point(k, rays, x, y, d, bracket, out);
    }
}

}  // namespace plain

inline void julia_trace_plainly(const JuliaScene::Constants& k, const JuliaRays& rays, std::span<const JuliaPart> parts,
                                JuliaPoints& out) {
  for (const JuliaPart& part : parts)
    for (int block = part.block_begin; block < part.block_end; ++block)
      if (part.any(block)) plain::trace_block(k, rays, part, block, out);
}

}  // namespace telesplat::sampler
