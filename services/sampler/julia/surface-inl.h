// From brackets to surface points: refines depths, finds normals, colours, occlusion, shadow. Included once for each
// target, by kernels.cpp.
#if defined(TELESPLAT_JULIA_SURFACE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_JULIA_SURFACE_INL_H_
#undef TELESPLAT_JULIA_SURFACE_INL_H_
#else
#define TELESPLAT_JULIA_SURFACE_INL_H_
#endif

#include <hwy/highway.h>

#include "services/sampler/julia/march-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

HWY_INLINE VF dot(const Vec3& a, const Vec3& b) {
  return hn::Add(hn::Add(hn::Mul(a.v[0], b.v[0]), hn::Mul(a.v[1], b.v[1])), hn::Mul(a.v[2], b.v[2]));
}
HWY_INLINE Vec3 choose(MF mask, const Vec3& yes, const Vec3& no) {
  return {{hn::IfThenElse(mask, yes.v[0], no.v[0]), hn::IfThenElse(mask, yes.v[1], no.v[1]),
           hn::IfThenElse(mask, yes.v[2], no.v[2])}};
}

// Scales vectors to unit length. Returns the mask of lanes in which that is possible.
HWY_INLINE MF normalise(Vec3& n) {
  const VF x = hn::Abs(n.v[0]), y = hn::Abs(n.v[1]), z = hn::Abs(n.v[2]), most = hn::Max(hn::Max(x, y), z);
  const VF nothing = set(kNothing);
  const MF good =
      hn::And(hn::And(hn::Lt(x, nothing), hn::Lt(y, nothing)), hn::And(hn::Lt(z, nothing), hn::Gt(most, set(kTiny))));
  for (VF& v : n.v) v = hn::Div(v, most);
  const VF length = hn::Sqrt(dot(n, n));
  for (VF& v : n.v) v = hn::Div(v, length);
  return good;
}

HWY_INLINE Vec4 orbit_vector(const Constants& k, const Vec3& n) {
  Vec4 d;
  for (int i = 0; i < 4; ++i)
    d.v[i] = hn::Add(hn::Add(hn::Mul(n.v[0], set(k.axes[0][i])), hn::Mul(n.v[1], set(k.axes[1][i]))),
                     hn::Mul(n.v[2], set(k.axes[2][i])));
  return d;
}

HWY_INLINE Vec4 load_direction(const Queue& hits, int at) {
  return {{hn::LoadU(f, hits.d[0] + at), hn::LoadU(f, hits.d[1] + at), hn::LoadU(f, hits.d[2] + at),
           hn::LoadU(f, hits.d[3] + at)}};
}

// Refines all hits by regula falsi; writes depths to hits.t0.
HWY_NOINLINE void Refine(const Constants& k, const JuliaRays& rays, Queue& hits) {
  constexpr int kWays = kMarchWays;
  const int lanes = static_cast<int>(hn::Lanes(f));
  const float threshold = k.lod * rays.footprint;
  for (int first = 0; first < hits.count; first += kWays * lanes) {
    Vec4 d[kWays], q[kWays];
    VF inverse[kWays], t0[kWays], g0[kWays], t1[kWays], g1[kWays], t[kWays], r[kWays];
    const auto secant = [&](int j) HWY_ATTR {
      const VF part = hn::Div(g0[j], hn::Max(hn::Sub(g0[j], g1[j]), set(kTiny)));
      return hn::Add(t0[j], hn::Mul(hn::Sub(t1[j], t0[j]), part));
    };
    for (int j = 0; j < kWays; ++j) {
      const int at = first + j * lanes;
      d[j] = load_direction(hits, at);
      inverse[j] = hn::LoadU(f, hits.inverse + at);
      t0[j] = hn::LoadU(f, hits.bracket_t0 + at), g0[j] = hn::LoadU(f, hits.bracket_g0 + at);
      t1[j] = hn::LoadU(f, hits.bracket_t1 + at), g1[j] = hn::LoadU(f, hits.bracket_g1 + at);
    }
    for (int i = 0; i < kRefinements; ++i) {
      for (int j = 0; j < kWays; ++j) {
        t[j] = secant(j);
        q[j] = along(rays.origin, d[j], t[j]);
      }
      Estimate<kWays>(k, q, r);
      for (int j = 0; j < kWays; ++j) {
        const VF g = hn::Sub(hn::Mul(r[j], inverse[j]), hn::Mul(hn::Mul(set(threshold), inverse[j]), t[j]));
        const MF outside = hn::Gt(g, hn::Zero(f));
        const VF half = set(0.5f);
        t0[j] = hn::IfThenElse(outside, t[j], t0[j]);
        t1[j] = hn::IfThenElse(outside, t1[j], t[j]);
        g0[j] = hn::IfThenElse(outside, g, hn::Mul(g0[j], half));
        g1[j] = hn::IfThenElse(outside, hn::Mul(g1[j], half), g);
      }
    }
    for (int j = 0; j < kWays; ++j) hn::StoreU(secant(j), f, hits.t0 + first + j * lanes);
  }
}

struct Orbit {
  Vec3 gradient;
  VF trap;
};
HWY_INLINE Orbit Follow(const Constants& k, const Vec4& q) {
  const VF limit = set(k.limit);
  const VF r0 = hn::Add(hn::Mul(q.v[2], q.v[2]), hn::Mul(q.v[3], q.v[3]));
  const VF across = hn::Add(hn::Mul(set(k.plane[1]), q.v[2]), hn::Mul(set(k.plane[2]), q.v[3]));
  VF w = q.v[0], p = q.v[1], s = set(1), dw[3], dp[3], ds[3], dr0[3];
  for (int i = 0; i < 3; ++i) {
    dw[i] = set(k.axes[i][0]), dp[i] = set(k.axes[i][1]), ds[i] = hn::Zero(f);
    dr0[i] = hn::Add(hn::Mul(q.v[2], set(k.axes[i][2])), hn::Mul(q.v[3], set(k.axes[i][3])));
  }
  Orbit out{{{hn::Zero(f), hn::Zero(f), hn::Zero(f)}}, limit};
  const bool from_axis = k.colour == static_cast<int>(julia::Colour::kTrap);
  MF live = hn::Le(limit, limit);
  for (int i = 0; i <= k.iterations; ++i) {
    const VF ww = hn::Mul(w, w), ss = hn::Mul(s, s), rr = hn::Mul(ss, r0), off_axis = hn::Add(hn::Mul(p, p), rr);
    const VF n = hn::Add(ww, off_axis), sr0 = hn::Mul(s, r0);
    const MF still = hn::Le(n, limit), escapes = hn::AndNot(still, live);
    const VF off_plane = hn::Add(hn::Mul(set(k.plane[0]), p), hn::Mul(across, s));
    const VF trap = from_axis ? off_axis : hn::Mul(off_plane, off_plane);
    out.trap = hn::IfThenElse(still, hn::Min(out.trap, trap), out.trap);
    live = still;
    for (int a = 0; a < 3; ++a) {
      const VF wdw = hn::Mul(w, dw[a]);
      const VF rest = hn::Add(hn::Add(hn::Mul(p, dp[a]), hn::Mul(sr0, ds[a])), hn::Mul(ss, dr0[a]));
      out.gradient.v[a] = hn::IfThenElse(escapes, hn::Add(wdw, rest), out.gradient.v[a]);
      dp[a] = hn::Add(hn::Mul(dw[a], p), hn::Mul(w, dp[a]));
      ds[a] = hn::Add(hn::Mul(dw[a], s), hn::Mul(w, ds[a]));
      dw[a] = hn::Sub(wdw, rest);
    }
    if (hn::AllFalse(f, still)) break;
    p = hn::Add(hn::Mul(w, p), set(k.c_p));
    s = hn::Mul(w, s);
    w = hn::Add(hn::Sub(ww, hn::Mul(n, set(0.5f))), set(k.c_w));
  }
  if (k.colour == static_cast<int>(julia::Colour::kDistance))
    out.trap = hn::Add(hn::Add(hn::Mul(q.v[0], q.v[0]), hn::Mul(q.v[1], q.v[1])), r0);
  return out;
}

// Widens steep normals: each becomes the mean of two (steps.h).
HWY_INLINE Vec3 Widen(const Constants& k, const Vec4& q, VF reach, const Vec3& back, const Vec3& n) {
  const VF lean = dot(n, back), in = hn::Mul(set(kInward), reach);
  const MF steep = hn::Lt(lean, set(kSteep));
  if (hn::AllFalse(f, steep)) return n;
  Vec3 side;
  for (int i = 0; i < 3; ++i) side.v[i] = hn::Sub(n.v[i], hn::Mul(back.v[i], lean));
  normalise(side);
  const VF rest = hn::Max(hn::Sub(set(1), hn::Mul(lean, lean)), hn::Zero(f));
  const VF slope = hn::Div(hn::Sqrt(rest), hn::Max(lean, set(kLeastLean)));
  const Vec4 towards = orbit_vector(k, back), base = along(q, orbit_vector(k, side), hn::Neg(in));
  VF ahead = hn::Mul(in, hn::Add(hn::Min(slope, set(kInwardSlope)), set(1))), off = hn::Zero(f);
  for (int i = 0; i < kInwardSteps; ++i) {
    off = hn::Sub(Estimate(k, along(base, towards, ahead)), hn::Mul(set(k.lod), reach));
    ahead = hn::Sub(ahead, off);
  }
  Vec3 second = Follow(k, along(base, towards, ahead)).gradient;
  const MF good = hn::And(normalise(second), hn::Lt(hn::Abs(off), hn::Mul(set(kInwardOff), reach)));
  const MF found = hn::And(good, hn::Gt(dot(second, back), hn::Zero(f)));
  const Vec3 other = choose(found, second, back);
  Vec3 mean;
  for (int i = 0; i < 3; ++i) mean.v[i] = hn::Add(n.v[i], other.v[i]);
  normalise(mean);
  return choose(steep, mean, n);
}

HWY_INLINE Vec3 NormalAt(const Constants& k, const Vec4& q, const Vec3& gradient, VF reach, const Vec3& ray) {
  Vec3 back{{hn::Neg(ray.v[0]), hn::Neg(ray.v[1]), hn::Neg(ray.v[2])}}, n = gradient;
  normalise(back);
  const MF good = normalise(n), bad = hn::Or(hn::Not(good), hn::Lt(dot(n, back), hn::Zero(f)));
  if (!hn::AllFalse(f, bad)) {
    Vec3 difference;
    for (int i = 0; i < 3; ++i) {
      Vec4 step;
      for (int j = 0; j < 4; ++j) step.v[j] = set(k.axes[i][j]);
      const Vec4 ends[2] = {along(q, step, reach), along(q, step, hn::Neg(reach))};
      VF e[2];
      Estimate<2>(k, ends, e);
      difference.v[i] = hn::Sub(e[0], e[1]);
    }
    const MF differs = normalise(difference);
    n = choose(bad, choose(differs, difference, back), n);
    const VF lean = dot(n, back);
    const MF away = hn::Lt(lean, hn::Zero(f));
    Vec3 turned;
    for (int i = 0; i < 3; ++i) turned.v[i] = hn::Add(n.v[i], hn::Mul(back.v[i], hn::Sub(set(kLeast), lean)));
    normalise(turned);
    n = choose(away, turned, n);
  }
  return Widen(k, q, reach, back, n);
}

// Returns the distance at which a line leaves the part that the clip keeps, in set units.
HWY_INLINE VF ExitOf(const Constants& k, const Vec3& room, const Vec3& towards) {
  VF out = set(kNothing);
  for (int i = 0; i < k.planes; ++i) {
    const float* n = k.plane_normal[i];
    const Vec3 normal{{set(n[0]), set(n[1]), set(n[2])}};
    const VF inside = hn::Sub(dot(normal, room), set(k.plane_offset[i])), along = dot(normal, towards);
    const VF distance = hn::Mul(hn::Max(hn::Div(inside, hn::Neg(along)), hn::Zero(f)), set(k.units_per_metre));
    out = hn::IfThenElse(hn::Lt(along, hn::Zero(f)), hn::Min(out, distance), out);
  }
  return out;
}

HWY_INLINE VF OcclusionAt(const Constants& k, const Vec4& q, const Vec3& n, VF exit) {
  const Vec4 step = orbit_vector(k, n);
  VF sum = hn::Zero(f);
  static_assert(kOcclusionSteps % 2 == 0);
  for (int i = 0; i < kOcclusionSteps; i += 2) {
    const float h[2] = {kOcclusionAt[i] * k.radius, kOcclusionAt[i + 1] * k.radius};
    const Vec4 points[2] = {along(q, step, set(h[0])), along(q, step, set(h[1]))};
    VF e[2];
    Estimate<2>(k, points, e);
    for (int j = 0; j < 2; ++j) {
      const VF near = hn::Min(hn::Div(e[j], set(kOpen * h[j])), set(1));
      const VF open = hn::IfThenElse(hn::Gt(set(h[j]), exit), set(1), near);
      sum = hn::Add(sum, hn::Mul(set(kOcclusionWeight[i + j]), hn::Sub(set(1), open)));
    }
  }
  return sum;
}

HWY_INLINE VF LitAt(const Constants& k, const Vec4& q, VF exit) {
  const Vec4 step = orbit_vector(k, {{set(k.light[0]), set(k.light[1]), set(k.light[2])}});
  VF lit = set(1), s = set(kShadowBegin * k.radius);
  for (int i = 0; i < kShadowSteps; ++i) {
    const MF live = hn::And(hn::Lt(s, hn::Min(set(kShadowEnd * k.radius), exit)), hn::Gt(lit, hn::Zero(f)));
    if (hn::AllFalse(f, live)) break;
    const VF r = Estimate(k, along(q, step, s));
    lit = hn::IfThenElse(live, hn::Min(lit, hn::Div(hn::Mul(set(kShadowSharpness), r), s)), lit);
    s = hn::IfThenElse(live, hn::Add(s, hn::Max(r, set(kShadowLeast * k.radius))), s);
  }
  return lit;
}

// Appends the hits as surface points to `out`. Depths are in hits.t0.
HWY_NOINLINE void Shade(const Constants& k, const JuliaRays& rays, const Queue& hits, JuliaPoints& out) {
  const int lanes = static_cast<int>(hn::Lanes(f));
  for (int first = 0; first < hits.count; first += lanes) {
    const int at = out.count + first;
    HWY_ALIGN float ray_of[3][kMaxLanes];
    for (int i = 0; i < lanes; ++i) {
      out.x[at + i] = hits.x[first + i], out.y[at + i] = hits.y[first + i];
      for (int a = 0; a < 3; ++a)
        ray_of[a][i] = rays.column[4 + a][hits.x[first + i]] + rays.row[4 + a][hits.y[first + i]];
    }
    const Vec3 ray{{hn::Load(f, ray_of[0]), hn::Load(f, ray_of[1]), hn::Load(f, ray_of[2])}};
    const VF t = hn::LoadU(f, hits.t0 + first);
    const Vec4 q = along(rays.origin, load_direction(hits, first), t);
    const Orbit orbit = Follow(k, q);
    Vec3 n = NormalAt(k, q, orbit.gradient, hn::Mul(set(rays.footprint), t), ray);
    for (int a = 0; a < 3; ++a) hn::StoreU(n.v[a], f, out.normal[a] + at);

    // Hits where the box cuts the set.
    const MF cut = hn::Eq(hn::LoadU(f, hits.bracket_t0 + first), hn::LoadU(f, hits.bracket_t1 + first));
    if (!hn::AllFalse(f, cut)) {
      for (int i = 0; i < lanes; ++i) {
        if (hits.bracket_t0[first + i] != hits.bracket_t1[first + i]) continue;
        const float direction[3] = {ray_of[0][i], ray_of[1][i], ray_of[2][i]};
        float face[3];
        if (!face_normal(k, rays, direction, hits.t0[first + i], face)) continue;
        for (int a = 0; a < 3; ++a) out.normal[a][at + i] = face[a];
      }
      for (int a = 0; a < 3; ++a) n.v[a] = hn::LoadU(f, out.normal[a] + at);
    }

    VF light = set(1);
    Vec3 room;
    for (int a = 0; a < 3; ++a) room.v[a] = hn::Add(set(rays.origin[4 + a]), hn::Mul(t, ray.v[a]));
    if (k.ambient > 0) {
      const VF occlusion = OcclusionAt(k, q, n, ExitOf(k, room, n));
      light = hn::Mul(light, hn::Sub(set(1), hn::Mul(set(k.ambient), occlusion)));
    }
    if (k.shadow > 0) {
      const VF lit = LitAt(k, q, ExitOf(k, room, {{set(k.light[0]), set(k.light[1]), set(k.light[2])}}));
      light = hn::Mul(light, hn::Sub(set(1), hn::Mul(set(k.shadow), hn::Sub(set(1), lit))));
    }
    hn::StoreU(t, f, out.depth_m + at);
    hn::StoreU(hn::Add(hn::Mul(hn::Sqrt(orbit.trap), set(k.tone_scale)), set(k.tone_shift)), f, out.tone + at);
    hn::StoreU(light, f, out.light + at);
  }
  out.count += hits.count;
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
