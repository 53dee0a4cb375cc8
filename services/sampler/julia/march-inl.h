// Cones, clipping and marching: from a part of an image to brackets of the depths at which its rays meet the surface.
// Included once for each target, by kernels.cpp.
#if defined(TELESPLAT_JULIA_MARCH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_JULIA_MARCH_INL_H_
#undef TELESPLAT_JULIA_MARCH_INL_H_
#else
#define TELESPLAT_JULIA_MARCH_INL_H_
#endif

#include <hwy/highway.h>

#include "services/sampler/julia/estimate-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::sampler::HWY_NAMESPACE {

// Rays that are left after clipping, in the order of their blocks, and their brackets in the same places.
struct Queue {
  static constexpr size_t kSize = JuliaPoints::kPadded;
  HWY_ALIGN float d[4][kSize], inverse[kSize], t0[kSize], t1[kSize];
  HWY_ALIGN float bracket_t0[kSize], bracket_g0[kSize], bracket_t1[kSize], bracket_g1[kSize];
  int32_t x[kSize], y[kSize];
  bool met[kSize];
  int count = 0;
};

struct Interval {
  VF t0, t1;
};
HWY_INLINE Interval Clip(const Constants& k, const JuliaRays& rays, const VF* d, float ball, float margin) {
  const float* o = rays.origin;
  VF a = hn::Zero(f), b = hn::Zero(f), c = set(-(ball * ball));
  for (int i = 0; i < 4; ++i) {
    a = hn::Add(a, hn::Mul(d[i], d[i]));
    b = hn::Add(b, hn::Mul(set(o[i]), d[i]));
    c = hn::Add(c, set(o[i] * o[i]));
  }
  const VF inside = hn::Sub(hn::Mul(b, b), hn::Mul(a, c)), root = hn::Sqrt(hn::Max(inside, hn::Zero(f)));
  Interval out{hn::Max(set(rays.near_m), hn::Div(hn::Sub(hn::Neg(b), root), a)), hn::Div(hn::Add(hn::Neg(b), root), a)};
  out.t1 = hn::IfThenElse(hn::Lt(inside, hn::Zero(f)), set(-1), out.t1);
  for (int i = 0; i < 3; ++i) {
    const VF v = d[4 + i];
    const VF inverse = hn::Div(set(1), hn::IfThenElse(hn::Lt(hn::Abs(v), set(kParallel)), set(kParallel), v));
    const VF ta = hn::Mul(set((k.box_lo[i] - margin) - o[4 + i]), inverse);
    const VF tb = hn::Mul(set((k.box_hi[i] + margin) - o[4 + i]), inverse);
    out.t0 = hn::Max(out.t0, hn::Min(ta, tb));
    out.t1 = hn::Min(out.t1, hn::Max(ta, tb));
  }
  for (int i = 0; i < k.planes; ++i) {
    const float* n = k.plane_normal[i];
    const VF v = hn::Add(hn::Add(hn::Mul(set(n[0]), d[4]), hn::Mul(set(n[1]), d[5])), hn::Mul(set(n[2]), d[6]));
    const VF inverse = hn::Div(set(1), hn::IfThenElse(hn::Lt(hn::Abs(v), set(kParallel)), set(kParallel), v));
    const float eye = (n[0] * o[4] + n[1] * o[5]) + n[2] * o[6];
    const VF t = hn::Mul(set((k.plane_offset[i] - margin) - eye), inverse);
    const MF enters = hn::Gt(inverse, hn::Zero(f));
    out.t0 = hn::IfThenElse(enters, hn::Max(out.t0, t), out.t0);
    out.t1 = hn::IfThenElse(enters, out.t1, hn::Min(out.t1, t));
  }
  return out;
}

// Writes to `start` the depth up to which each block's rays are free; kNothing for blocks without rays. Whole vectors.
HWY_NOINLINE void MarchCones(const Constants& k, const JuliaRays& rays, const JuliaPart& part,
                             float* HWY_RESTRICT start) {
  const VF growth = set(rays.spread + kConeMargin * k.lod * rays.footprint);
  const int lanes = static_cast<int>(hn::Lanes(f));
  for (int block = part.block_begin; block < part.block_end; block += lanes) {
    HWY_ALIGN float wanted[kMaxLanes];
    for (int i = 0; i < lanes; ++i) wanted[i] = block + i < part.block_end && part.any(block + i) ? 1 : 0;
    MF live = hn::Gt(hn::Load(f, wanted), hn::Zero(f));
    if (hn::AllFalse(f, live)) {
      hn::StoreU(set(kNothing), f, start + (block - part.block_begin));
      continue;
    }
    VF d[7];
    for (int i = 0; i < 7; ++i)
      d[i] = hn::Add(hn::LoadU(f, rays.block_column[i].data() + block), set(rays.block_row[i][part.block_row]));
    const Vec4 direction{{d[0], d[1], d[2], d[3]}};
    const Interval range = Clip(k, rays, d, rays.block_ball, rays.block_margin);
    const VF scale = hn::Div(set(1), hn::Add(speed_of(direction), growth));
    VF t = hn::IfThenElse(live, range.t0, set(kNothing));
    for (int i = 0; i < kMaxConeSteps; ++i) {
      const MF over = hn::And(live, hn::Gt(t, range.t1));
      t = hn::IfThenElse(over, set(kNothing), t);
      live = hn::AndNot(over, live);
      if (hn::AllFalse(f, live)) break;
      const VF radius = hn::Mul(growth, t);
      const VF free = hn::Sub(Estimate(k, along(rays.origin, direction, t)), radius);
      live = hn::And(live, hn::Ge(free, hn::Mul(set(kConeStop), radius)));
      t = hn::IfThenElse(live, hn::Add(t, hn::Mul(free, scale)), t);
    }
    hn::StoreU(t, f, start + (block - part.block_begin));
  }
}

// Appends the rays of a part whose interval is not empty after clipping.
HWY_NOINLINE void ClipRays(const Constants& k, const JuliaRays& rays, const JuliaPart& part,
                           const float* HWY_RESTRICT start, Queue& queue) {
  HWY_ALIGN float d_of[4][kMaxLanes], inverse[kMaxLanes], t0[kMaxLanes], t1[kMaxLanes];
  const int lanes = static_cast<int>(hn::Lanes(f));
  const int first = part.block_begin * kJuliaBlock, count = (part.block_end - part.block_begin) * kJuliaBlock;
  // Go through blocks, then rows in a block, so that neighbours in the queue behave alike.
  for (int x8 = 0; x8 < count; x8 += std::max(lanes, kJuliaBlock))
    for (int row = 0; row < kJuliaBlock; ++row)
      for (int x0 = x8; x0 < x8 + kJuliaBlock; x0 += lanes) {
        HWY_ALIGN float free[kMaxLanes];
        float least = kNothing;
        for (int i = 0; i < lanes; ++i) {
          const int x = x0 + i, block = x / kJuliaBlock;
          free[i] = part.wanted[row][block] >> x % kJuliaBlock & 1 ? start[block] : kNothing;
          least = std::min(least, free[i]);
        }
        if (least == kNothing) continue;
        const int y = part.block_row * kJuliaBlock + row;
        VF d[7];
        for (int i = 0; i < 7; ++i)
          d[i] = hn::Add(hn::LoadU(f, rays.column[i].data() + first + x0), set(rays.row[i][y]));
        Interval range = Clip(k, rays, d, rays.ball, 0);
        range.t0 = hn::Max(range.t0, hn::Load(f, free));
        const MF live = hn::Le(range.t0, range.t1);
        if (hn::AllFalse(f, live)) continue;
        const Vec4 direction{{d[0], d[1], d[2], d[3]}};
        for (int i = 0; i < 4; ++i) hn::Store(d[i], f, d_of[i]);
        hn::Store(hn::Div(set(1), speed_of(direction)), f, inverse);
        hn::Store(range.t0, f, t0);
        hn::Store(range.t1, f, t1);
        for (int i = 0; i < lanes; ++i) {
          if (!(t0[i] <= t1[i])) continue;
          const int at = queue.count++;
          for (int a = 0; a < 4; ++a) queue.d[a][at] = d_of[a][i];
          queue.inverse[at] = inverse[i];
          queue.t0[at] = t0[i], queue.t1[at] = t1[i];
          queue.x[at] = first + x0 + i, queue.y[at] = y;
        }
      }
}

HWY_INLINE uint64_t BitsOf(MF mask) {
  uint8_t bytes[8] = {};
  hn::StoreMaskBits(f, mask, bytes);
  uint64_t bits;
  __builtin_memcpy(&bits, bytes, sizeof bits);
  return bits;
}

// Rays under way, one in each lane.
template <int kWays>
struct Lanes {
  static constexpr size_t kMost = kWays * kMaxLanes;
  HWY_ALIGN float d[4][kMost], inverse[kMost], t[kMost], t1[kMost], last_t[kMost], last_r[kMost], steps[kMost];
  HWY_ALIGN float g[kMost];  // the estimate less the threshold, in depth
  int ray[kMost];
  uint64_t busy = 0;  // bits of lanes that have a ray

  // Gives lane i the ray `next`, or, if that is -1, a point that has escaped already.
  HWY_INLINE void begin(int i, int next, const Queue& queue) {
    ray[i] = next;
    last_r[i] = steps[i] = 0;
    if (next < 0) {
      busy &= ~(uint64_t{1} << i);
      for (int a = 0; a < 4; ++a) d[a][i] = 1e9f;
      t[i] = last_t[i] = 1;
      inverse[i] = t1[i] = 0;
      return;
    }
    busy |= uint64_t{1} << i;
    for (int a = 0; a < 4; ++a) d[a][i] = queue.d[a][next];
    inverse[i] = queue.inverse[next];
    t[i] = last_t[i] = queue.t0[next];
    t1[i] = queue.t1[next];
  }

  // Loads one vector for each way.
  HWY_INLINE void load(int lanes, Vec4 (&d_of)[kWays], VF (&inverse_of)[kWays], VF (&t_of)[kWays], VF (&t1_of)[kWays],
                       VF (&last_t_of)[kWays], VF (&last_r_of)[kWays], VF (&steps_of)[kWays]) const {
    for (int j = 0; j < kWays; ++j) {
      const int at = j * lanes;
      for (int a = 0; a < 4; ++a) d_of[j].v[a] = hn::Load(f, d[a] + at);
      inverse_of[j] = hn::Load(f, inverse + at);
      t_of[j] = hn::Load(f, t + at), t1_of[j] = hn::Load(f, t1 + at);
      last_t_of[j] = hn::Load(f, last_t + at), last_r_of[j] = hn::Load(f, last_r + at);
      steps_of[j] = hn::Load(f, steps + at);
    }
  }

  // Stores the values that a march changes.
  HWY_INLINE void store(int lanes, const VF (&t_of)[kWays], const VF (&last_t_of)[kWays], const VF (&last_r_of)[kWays],
                        const VF (&steps_of)[kWays], const VF (&g_of)[kWays]) {
    for (int j = 0; j < kWays; ++j) {
      const int at = j * lanes;
      hn::Store(t_of[j], f, t + at);
      hn::Store(last_t_of[j], f, last_t + at);
      hn::Store(last_r_of[j], f, last_r + at);
      hn::Store(steps_of[j], f, steps + at);
      hn::Store(g_of[j], f, g + at);
    }
  }

  HWY_INLINE void end(int i, bool hit, float threshold, Queue& queue) const {
    const int at = ray[i];
    queue.met[at] = hit;
    if (!hit) return;
    const bool first = t[i] == last_t[i];
    queue.bracket_t0[at] = last_t[i];
    queue.bracket_g0[at] = first ? 0 : last_r[i] - (threshold * inverse[i]) * last_t[i];
    queue.bracket_t1[at] = t[i];
    queue.bracket_g1[at] = first ? -1 : g[i];
  }
};

// Marches every ray of the queue. When enough lanes are done they are given new rays.
HWY_NOINLINE void March(const Constants& k, const JuliaRays& rays, Queue& queue) {
  constexpr int kWays = kMarchWays;
  const int lanes = static_cast<int>(hn::Lanes(f)), all = kWays * lanes;
  Lanes<kWays> lane;
  int next = 0;
  for (int i = 0; i < all; ++i, ++next) lane.begin(i, next < queue.count ? next : -1, queue);

  const float threshold = k.lod * rays.footprint;  // set units a metre of depth
  Vec4 d[kWays];
  VF inverse[kWays], t[kWays], t1[kWays], last_t[kWays], last_r[kWays], steps[kWays];
  lane.load(lanes, d, inverse, t, t1, last_t, last_r, steps);
  while (lane.busy != 0) {
    Vec4 q[kWays];
    VF r[kWays], g[kWays];
    for (int j = 0; j < kWays; ++j) q[j] = along(rays.origin, d[j], t[j]);
    Estimate<kWays>(k, q, r);
    uint64_t hits = 0, finished = 0;
    VF next_t[kWays], next_last_t[kWays], next_last_r[kWays];
    for (int j = 0; j < kWays; ++j) {
      r[j] = hn::Mul(r[j], inverse[j]);
      const VF gone = hn::Sub(t[j], last_t[j]);
      const MF apart = hn::Gt(gone, hn::Add(hn::Mul(last_r[j], set(kSlack)), hn::Mul(r[j], set(kTrust))));
      const VF threshold_t = hn::Mul(hn::Mul(set(threshold), inverse[j]), t[j]);
      g[j] = hn::Sub(r[j], threshold_t);
      steps[j] = hn::Add(steps[j], set(1));
      const MF hit = hn::AndNot(apart, hn::Le(g[j], hn::Zero(f)));
      const MF out = hn::AndNot(apart, hn::Ge(hn::Add(t[j], r[j]), t1[j]));
      const MF done = hn::Or(hit, hn::Or(out, hn::Ge(steps[j], set(kMaxSteps))));
      hits |= BitsOf(hit) << (j * lanes);
      finished |= BitsOf(done) << (j * lanes);

      const VF slope = hn::IfThenElse(hn::Gt(gone, hn::Zero(f)), hn::Div(hn::Sub(r[j], last_r[j]), gone), set(-1));
      const VF even = hn::Div(set(kRelax), hn::Sub(set(1), hn::Min(hn::Max(slope, set(-1)), set(kMaxSlope))));
      const VF ratio = hn::Max(even, set(1));
      const MF near = hn::Lt(r[j], hn::Mul(set(kNear), threshold_t));
      const VF most = hn::IfThenElse(near, set(kNearRatio), ratio);
      const VF far = hn::Min(hn::Add(t[j], hn::Mul(r[j], hn::Min(ratio, most))), t1[j]);
      next_t[j] = hn::IfThenElse(done, t[j], hn::IfThenElse(apart, hn::Add(last_t[j], last_r[j]), far));
      const MF keep = hn::Or(done, apart);
      next_last_t[j] = hn::IfThenElse(keep, last_t[j], t[j]);
      next_last_r[j] = hn::IfThenElse(keep, last_r[j], r[j]);
    }
    for (int j = 0; j < kWays; ++j) t[j] = next_t[j], last_t[j] = next_last_t[j], last_r[j] = next_last_r[j];

    finished &= lane.busy;
    if (finished == 0 || (hwy::PopCount(finished) < kRefill && finished != lane.busy)) continue;
    lane.store(lanes, t, last_t, last_r, steps, g);
    for (; finished != 0; finished &= finished - 1) {
      const int i = static_cast<int>(hwy::Num0BitsBelowLS1Bit_Nonzero64(finished));
      lane.end(i, hits >> i & 1, threshold, queue);
      lane.begin(i, next < queue.count ? next : -1, queue);
      ++next;
    }
    lane.load(lanes, d, inverse, t, t1, last_t, last_r, steps);
  }
}

}  // namespace telesplat::sampler::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
