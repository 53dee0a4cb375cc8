#include "common/codec/dense/kernels.h"

#include <algorithm>
#include <cstdlib>

#include "common/codec/mask.h"
#include "common/codec/poles.h"

// Each loop is compiled for every kind of vector unit, and its first call chooses one (CMakeLists.txt). Loops use
// integers, or floats in one order without contraction, so that all versions give the same bits.
#ifdef TELESPLAT_CODEC_CLONES
#define VECTORS __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define VECTORS
#endif
#define RESTRICT __restrict

namespace telesplat::codec::detail {
namespace {

inline uint32_t mask_if(bool condition) { return 0 - static_cast<uint32_t>(condition); }

// Returns the token for plane k if the pixel lies within 2 of it (off: its distance from the plane + 2); else `before`.
inline uint32_t hit(uint32_t before, uint32_t k, uint32_t off) {
  const uint32_t near = off & 0xFFFFFF, hit = mask_if(near < 5);
  return (before & ~hit) | ((5 * k + near) & hit);
}

// Calls run(axis) with a literal axis, so that the compiler makes a loop for each.
template <class Run>
inline void for_axis(int pole, Run run) {
  pole / 2 == 0 ? run(0) : pole / 2 == 1 ? run(1) : pole / 2 == 2 ? run(2) : run(3);
}

inline int32_t within16(int32_t v) { return std::clamp(v, -32767, 32767); }

inline int32_t exponent_of(int32_t v) {  // 1 to 2^24
  return static_cast<int32_t>(std::bit_cast<uint32_t>(static_cast<float>(v)) >> 23) - 127;
}

}  // namespace

VECTORS void covered_bits(const uint32_t* RESTRICT depth, size_t count, uint64_t* RESTRICT words) {
  for (size_t x = 0; x < count; x += 64) {
    const size_t bits = std::min<size_t>(64, count - x);
    uint64_t word = 0;
    for (size_t i = 0; i < bits; ++i) word |= uint64_t{depth[x + i] != 0} << i;
    words[x / 64] = word;
  }
}

VECTORS void tokens_of(const uint32_t* RESTRICT z, size_t n, uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) tokens[x] = static_cast<uint8_t>(token_of(z[x]));
}

VECTORS void make_contexts(const ContextRows& rows, size_t n, ContextScale scale, uint8_t* RESTRICT contexts) {
  const uint8_t *RESTRICT a = rows.above, *RESTRICT b = rows.above2, *RESTRICT o = rows.other;
  const auto context = [scale](int sum) {
    return static_cast<uint8_t>(std::clamp((sum - scale.bias) >> scale.shift, 0, 15) >> scale.merges);
  };
  if (o == nullptr)
    for (size_t x = 0; x < n; ++x) contexts[x] = context(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x]);
  else
    for (size_t x = 0; x < n; ++x)
      contexts[x] = context(3 * a[x] + 2 * a[x - 1] + 2 * a[x + 1] + b[x] + 4 * o[x] + 2 * o[x - 1] + 2 * o[x + 1]);
}

VECTORS void plane_kinds(const uint8_t* RESTRICT tokens, size_t n, uint8_t* RESTRICT kinds) {
  for (size_t x = 0; x < n; ++x) {
    const unsigned t = tokens[x], missed = std::min(15u, (t + 88) >> 4);
    kinds[x] = static_cast<uint8_t>(t < kHits ? t * 52 >> 8 : missed);
  }
}

VECTORS void depth_residuals(const uint32_t* RESTRICT above, const uint32_t* RESTRICT row, size_t n,
                             uint32_t* RESTRICT z) {
  for (size_t x = 0; x < n; ++x) z[x] = fold24(row[x] - row[x - 1] - above[x] + above[x - 1]);
}

// Tests the planes from the last to the first, so that the first that fits wins.
VECTORS void plane_residuals(const uint32_t* RESTRICT above2, const uint32_t* RESTRICT above,
                             const uint32_t* RESTRICT row, size_t n, uint32_t* RESTRICT z, uint8_t* RESTRICT tokens) {
  for (size_t x = 0; x < n; ++x) {
    const uint32_t up = above[x], corner = above[x - 1], right = above[x + 1];
    const uint32_t left = row[x - 1], v = row[x] + 2, past_left = v - left, past_up = v - up;
    z[x] = fold24(past_left - up + corner - 2);
    uint32_t token = token_of(z[x]) + kHits;
    token = hit(token, 7, v - 2 * right + above2[x + 2]);
    token = hit(token, 6, past_up - corner + above2[x - 1]);
    token = hit(token, 5, past_up - right + above2[x + 1]);
    token = hit(token, 4, past_left - corner + above[x - 2]);
    token = hit(token, 3, past_up - up + above2[x]);
    token = hit(token, 2, past_left - right + up);
    token = hit(token, 1, past_left - left + row[x - 2]);
    token = hit(token, 0, past_left - up + corner);
    tokens[x] = static_cast<uint8_t>(token);
  }
}

VECTORS void plane_terms(const uint32_t* RESTRICT above2, const uint32_t* RESTRICT above, const uint32_t* RESTRICT z,
                         const uint8_t* RESTRICT tokens, size_t n, const PlaneTerms& out) {
  uint32_t *RESTRICT terms = out.terms, *RESTRICT take_left = out.take_left, *RESTRICT take_slope = out.take_slope;
  for (size_t x = 0; x < n; ++x) {
    const uint32_t up = above[x], corner = above[x - 1], right = above[x + 1];
    const uint32_t token = tokens[x], k = token * 52 >> 8, off = token - 5 * k - 2;
    // Computes all eight: reading only the wanted ones takes longer.
    const uint32_t lines[8] = {up - corner,
                               0,
                               right - up,
                               2 * up - above2[x],
                               corner - above[x - 2],
                               up + right - above2[x + 1],
                               up + corner - above2[x - 1],
                               2 * right - above2[x + 2]};
    uint32_t term = up - corner + static_cast<uint32_t>(unfold(z[x]));
    for (uint32_t plane = 0; plane < 8; ++plane) term ^= (term ^ (lines[plane] + off)) & mask_if(k == plane);
    terms[x] = term;
    take_left[x] = ~(mask_if(k == 3) | mask_if(k - 5 < 3));
    take_slope[x] = mask_if(k == 1);
  }
}

VECTORS void turn_normals(const uint16_t* RESTRICT codes, size_t n, int pole, int16_t* RESTRICT xs,
                          int16_t* RESTRICT ys) {
  const auto run = [&](int axis) {
    for (size_t i = 0; i < n; ++i) {
      const uint16_t code = turn_normal(codes[i], axis, pole % 2 != 0);
      xs[i] = static_cast<int16_t>((code & 255) * 64), ys[i] = static_cast<int16_t>((code >> 8) * 64);
    }
  };
  for_axis(pole, run);
}

VECTORS void turn_normals_back(const int16_t* RESTRICT xs, const int16_t* RESTRICT ys, size_t n, int pole,
                               uint16_t* RESTRICT codes) {
  const auto run = [&](int axis) {
    for (size_t i = 0; i < n; ++i)
      codes[i] = turn_back(static_cast<uint16_t>(xs[i] >> 6 | ys[i] >> 6 << 8), axis, pole % 2 != 0);
  };
  for_axis(pole, run);
}

VECTORS void divide(int16_t* row, size_t n, int offset, uint32_t share) {
  for (size_t x = 0; x < n; ++x)
    row[x] = static_cast<int16_t>(static_cast<uint32_t>(std::max(row[x] + offset, 0)) * share >> 18);
}

VECTORS void unfold_row(const uint32_t* RESTRICT z, size_t n, int bits, int16_t* RESTRICT out) {
  for (size_t x = 0; x < n; ++x) out[x] = static_cast<int16_t>(static_cast<uint32_t>(unfold(z[x])) << bits);
}

VECTORS void guided_sums(const GuidedRows& rows, size_t n, int32_t* RESTRICT sums) {
  const int16_t *RESTRICT up = rows.above, *RESTRICT g0 = rows.guide[0], *RESTRICT g1 = rows.guide[1],
                          *RESTRICT g2 = rows.guide[2], *RESTRICT other = rows.residual;
  int32_t w[kGuidedTerms];
  std::copy_n(rows.weights, kGuidedTerms, w);
  const int32_t constant = rows.constant + (1 << (rows.bits + 12));
  for (size_t x = 0; x < n; ++x)
    sums[x] = constant + w[1] * up[x] + w[2] * up[x - 1] + w[3] * up[x + 1] + w[4] * g0[x - 1] + w[5] * g0[x] +
              w[6] * g0[x + 1] + w[7] * g1[x - 1] + w[8] * g1[x] + w[9] * g1[x + 1] + w[10] * g2[x - 1] +
              w[11] * g2[x] + w[12] * g2[x + 1];
  if (other == nullptr) return;
  for (size_t x = 0; x < n; ++x) sums[x] += w[kOtherResidual] * other[x];
}

VECTORS void guided_residuals(const GuidedRows& rows, const int32_t* RESTRICT sums, size_t n, uint32_t* RESTRICT z) {
  const int16_t* RESTRICT own = rows.own;
  const int bits = rows.bits, shift = bits + 13;
  const int32_t left = rows.weights[0], most = rows.most;
  const int cut = rows.wraps ? 24 : 0;
  for (size_t x = 0; x < n; ++x) {
    const int32_t off = (own[x] >> bits) - std::clamp((sums[x] + left * own[x - 1]) >> shift, 0, most);
    z[x] = fold(static_cast<int32_t>(static_cast<uint32_t>(off) << cut) >> cut);
  }
}

VECTORS void median_residuals(const GuidedRows& rows, size_t n, uint32_t* RESTRICT z) {
  const int16_t *RESTRICT own = rows.own, *RESTRICT above = rows.above;
  const int bits = rows.bits, cut = rows.wraps ? 24 : 0;
  for (size_t x = 0; x < n; ++x) {
    const int32_t off = (own[x] - median_of(own[x - 1], above[x], above[x - 1])) >> bits;
    z[x] = fold(static_cast<int32_t>(static_cast<uint32_t>(off) << cut) >> cut);
  }
}

// Slopes of the reciprocal depth at a pixel, and its value extrapolated to the tile's centre, are linear in the
// surface's normal, for any camera (docs/codec.md). 31-bit integers; the quotient by Newton's method.
VECTORS void geometry(const uint32_t* const depth[3], size_t n, int x0, int y, const GeometryModel& model,
                      int16_t* const guide[2]) {
  int16_t *RESTRICT gx = guide[0], *RESTRICT gy = guide[1];
  const uint32_t *RESTRICT above = depth[0], *RESTRICT here = depth[1], *RESTRICT below = depth[2];
  int32_t a[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) a[i][j] = model.matrix[i][j];
  const int slope_shift = model.slope_shift, height_shift = model.height_shift;
  for (size_t x = 0; x < n; ++x) {
    const int32_t u = within16(static_cast<int32_t>(here[x + 1] - here[x - 1]) >> slope_shift),
                  v = within16(static_cast<int32_t>(below[x] - above[x]) >> slope_shift);
    const uint32_t px = static_cast<uint32_t>(x0 + static_cast<int>(x)), py = static_cast<uint32_t>(y);
    const int32_t height =
        static_cast<int32_t>(static_cast<uint32_t>(static_cast<int32_t>(here[x] << 1) >> slope_shift) -
                             px * static_cast<uint32_t>(u) - py * static_cast<uint32_t>(v));
    const int32_t h = within16(height >> height_shift);
    const int32_t mx = a[0][0] * u + a[0][1] * v + a[0][2] * h, my = a[1][0] * u + a[1][1] * v + a[1][2] * h,
                  mz = a[2][0] * u + a[2][1] * v + a[2][2] * h;
    const int32_t s = std::abs(mx) + std::abs(my) + std::abs(mz);
    const int32_t up = 24 - exponent_of(s >> 6 | 1);
    const int32_t d = static_cast<int32_t>(static_cast<uint32_t>(s) << up >> 16 | 0x4000);
    int32_t r = 46260 - (d * 30840 >> 15);
    r = (r * (32768 - (d * r >> 15))) >> 14;
    r = (r * (32768 - (d * r >> 15))) >> 14;
    const int32_t nx = static_cast<int32_t>(static_cast<uint32_t>(mx) << up) >> 16,
                  ny = static_cast<int32_t>(static_cast<uint32_t>(my) << up) >> 16;
    const int32_t qx = (nx * r >> 15) * 127 >> 8, qy = (ny * r >> 15) * 127 >> 8;
    const int32_t ax = std::abs(qx), ay = std::abs(qy);
    const int32_t fx = qx < 0 ? ay - 8128 : 8128 - ay, fy = qy < 0 ? ax - 8128 : 8128 - ax;
    gx[x] = static_cast<int16_t>((mz < 0 ? fx : qx) + 8128);
    gy[x] = static_cast<int16_t>((mz < 0 ? fy : qy) + 8128);
  }
}

VECTORS void activity(const int16_t* const gx[3], const int16_t* const gy[3], size_t n, uint8_t* RESTRICT tokens) {
  const int16_t *RESTRICT x0 = gx[0], *RESTRICT x1 = gx[1], *RESTRICT x2 = gx[2];
  const int16_t *RESTRICT y0 = gy[0], *RESTRICT y1 = gy[1], *RESTRICT y2 = gy[2];
  for (size_t x = 0; x < n; ++x) {
    const int sum = std::abs(x1[x + 1] - x1[x - 1]) + std::abs(x2[x] - x0[x]) + std::abs(y1[x + 1] - y1[x - 1]) +
                    std::abs(y2[x] - y0[x]);
    tokens[x] = static_cast<uint8_t>(token_of(static_cast<uint32_t>(sum >> 3)));
  }
}

VECTORS void heights(const uint32_t* RESTRICT depth, size_t n, double sum, const HeightScale& by,
                     int16_t* RESTRICT out) {
  const double step = by.step, scale = by.scale, low = by.low;
  for (size_t x = 0; x < n; ++x) {
    const auto code = static_cast<double>(static_cast<int32_t>(depth[x] | (depth[x] == 0)));
    const double height = (sum + step * static_cast<double>(static_cast<int32_t>(x))) * scale / code - low;
    out[x] = static_cast<int16_t>(static_cast<int32_t>(height < 0 ? 0 : height > 16383 ? 16383 : height));
  }
}

VECTORS void values_of_heights(const std::array<int16_t, kKnots>& knots, size_t n, int16_t* RESTRICT row) {
  int32_t of[kKnots];
  std::copy_n(knots.begin(), kKnots, of);
  for (size_t x = 0; x < n; ++x) {
    const int32_t i = row[x] >> 8, a = of[i], b = of[i + 1];
    row[x] = static_cast<int16_t>(a + ((b - a) * (row[x] & 255) >> 8));
  }
}

VECTORS void normal_equations(const float (*features)[kFeatures], const float* weights, size_t n,
                              float (*sums)[kFeatures]) {
  float all[kFeatures * kFeatures] = {};
  for (size_t s = 0; s < n; ++s) {
    const float* RESTRICT const f = features[s];
    for (int i = 0; i < kFeatures; ++i) {
      const float weighted = f[i] * weights[s];
      float* RESTRICT const row = all + i * kFeatures;
      for (int j = 0; j < kFeatures; ++j) row[j] += weighted * f[j];
    }
  }
  std::copy_n(all, kFeatures * kFeatures, sums[0]);
}

}  // namespace telesplat::codec::detail
