// surfel_contour.h and surfel_splat.h on vectors of points, and what feeds them a tile's points.
// Included once a target, by surfel_kernels.cpp.
#if defined(TELESPLAT_SPLAT_SURFEL_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_SURFEL_INL_H_
#undef TELESPLAT_SPLAT_SURFEL_INL_H_
#else
#define TELESPLAT_SPLAT_SURFEL_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>

#include "common/splat/projection-inl.h"
#include "common/splat/surfel/kernels.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

using VF = hn::Vec<F32>;
using VI = hn::Vec<I32>;
using VU = hn::Vec<U32>;

HWY_INLINE VF Const(float v) { return hn::Set(F32(), v); }
HWY_INLINE VF Clamp(VF v, VF lo, VF hi) { return hn::Max(hn::Min(v, hi), lo); }

// SurfelSource of each lane.
struct Sources {
  VF radius, x, y, z;
};

// A vector of points: what surfel_contour takes and gives.
struct Surfels {
  VF x, y, w;  // projected centre, depth
  VF rho;      // radius over depth, limited
  VF offset_x, offset_y, xx, xy, yy, slope_x, slope_y;
  VF normal_x, normal_y, normal_z;
  VU normal_code, albedo;
};

HWY_INLINE VF Dot(const std::array<float, 3>& a, VF x, VF y, VF z) {
  return hn::Add(hn::Add(hn::Mul(Const(a[0]), x), hn::Mul(Const(a[1]), y)), hn::Mul(Const(a[2]), z));
}
HWY_INLINE VF Dot(VF ax, VF ay, VF az, VF x, VF y, VF z) {
  return hn::Add(hn::Add(hn::Mul(ax, x), hn::Mul(ay, y)), hn::Mul(az, z));
}

// surfel_normal, in room space.
HWY_INLINE void DecodeNormals(VU code, VF& x, VF& y, VF& z) {
  const F32 d;
  const I32 di;
  const auto at = [&](VU c) HWY_ATTR {
    return hn::Min(hn::Sub(hn::ConvertTo(d, hn::BitCast(di, c)), Const(127.0f)), Const(127.0f));
  };
  x = at(hn::And(code, hn::Set(U32(), 255u)));
  y = at(hn::ShiftRight<8>(code));
  z = hn::Sub(hn::Sub(Const(127.0f), hn::Abs(x)), hn::Abs(y));
  const auto fold = hn::Max(hn::Neg(z), hn::Zero(d));
  x = hn::Sub(x, hn::CopySign(fold, x));
  y = hn::Sub(y, hn::CopySign(fold, y));
}

// surfel_contour. s: x, y, w, normal_code set. Comments and names are there.
HWY_INLINE void ContourOf(const SurfelCamera& c, const Sources& e, Surfels& s) {
  const auto one = Const(1.0f);
  VF nx, ny, nz;
  DecodeNormals(s.normal_code, nx, ny, nz);
  const auto mx = Dot(c.right, nx, ny, nz), my = Dot(c.down, nx, ny, nz), mz = Dot(c.forward, nx, ny, nz);
  const auto u = hn::Mul(hn::Sub(s.x, Const(c.centre_x)), Const(c.step_x));
  const auto v = hn::Mul(hn::Sub(s.y, Const(c.centre_y)), Const(c.step_y));

  const auto sx = hn::Sub(mx, hn::Mul(u, mz)), sy = hn::Sub(my, hn::Mul(v, mz));
  const auto i = hn::Div(one, hn::Add(hn::Add(hn::Mul(mx, mx), hn::Mul(my, my)), hn::Mul(mz, mz)));
  const auto em = Dot(mx, my, mz, e.x, e.y, e.z), em_i = hn::Mul(em, i);
  const auto kappa = hn::Div(one, hn::Max(hn::Mul(em, em_i), Const(kMinSampledCosine * kMinSampledCosine)));
  const auto tx = hn::Sub(hn::Sub(e.x, hn::Mul(u, e.z)), hn::Mul(em_i, sx));
  const auto ty = hn::Sub(hn::Sub(e.y, hn::Mul(v, e.z)), hn::Mul(em_i, sy));
  const auto tz = hn::Sub(e.z, hn::Mul(em_i, mz));

  const auto isx = hn::Mul(i, sx), isy = hn::Mul(i, sy), isz = hn::Mul(i, mz);
  const auto ktx = hn::Mul(kappa, tx), kty = hn::Mul(kappa, ty), ktz = hn::Mul(kappa, tz);
  const auto gxx = hn::Add(hn::Sub(hn::Add(one, hn::Mul(u, u)), hn::Mul(isx, sx)), hn::Mul(ktx, tx));
  const auto gyy = hn::Add(hn::Sub(hn::Add(one, hn::Mul(v, v)), hn::Mul(isy, sy)), hn::Mul(kty, ty));
  const auto gxy = hn::Add(hn::Sub(hn::Mul(u, v), hn::Mul(isx, sy)), hn::Mul(ktx, ty));
  const auto gxz = hn::Sub(hn::Sub(hn::Mul(ktx, tz), hn::Mul(isx, mz)), u);
  const auto gyz = hn::Sub(hn::Sub(hn::Mul(kty, tz), hn::Mul(isy, mz)), v);
  const auto gzz = hn::Add(hn::Sub(one, hn::Mul(isz, mz)), hn::Mul(ktz, tz));

  const auto rho = hn::Min(hn::Div(e.radius, s.w), Const(kMaxRadiusOverDepth)), rho2 = hn::Mul(rho, rho);
  const auto k = hn::Sub(one, hn::Mul(rho2, gzz));
  const auto parallel = hn::Lt(k, Const(0.25f));
  const auto a = hn::Div(rho2, hn::IfThenElse(parallel, one, k)), shift = hn::IfThenZeroElse(parallel, a);
  const auto fx = Const(c.focal_x), fy = Const(c.focal_y);
  const auto ax = hn::Mul(a, fx), ay = hn::Mul(a, fy);
  s.rho = rho;
  s.offset_x = hn::Neg(hn::Mul(hn::Mul(shift, fx), gxz));
  s.offset_y = hn::Neg(hn::Mul(hn::Mul(shift, fy), gyz));
  s.xx = hn::Add(hn::Mul(hn::Mul(ax, fx), gxx), hn::Mul(s.offset_x, s.offset_x));
  s.xy = hn::Add(hn::Mul(hn::Mul(ax, fy), gxy), hn::Mul(s.offset_x, s.offset_y));
  s.yy = hn::Add(hn::Mul(hn::Mul(ay, fy), gyy), hn::Mul(s.offset_y, s.offset_y));

  const auto along = hn::Add(hn::Add(hn::Mul(mx, u), hn::Mul(my, v)), mz);
  const auto inverse = hn::Div(one, hn::CopySign(hn::Max(hn::Abs(along), Const(1e-3f)), along));
  const auto limit_x = Const(kSteepest * c.step_x), limit_y = Const(kSteepest * c.step_y);
  s.slope_x = Clamp(hn::Mul(hn::Mul(mx, inverse), Const(c.step_x)), hn::Neg(limit_x), limit_x);
  s.slope_y = Clamp(hn::Mul(hn::Mul(my, inverse), Const(c.step_y)), hn::Neg(limit_y), limit_y);
  s.normal_x = mx, s.normal_y = my, s.normal_z = mz;
}

// surfel_conic, its box cut to the rectangle too.
struct Conics {
  VF centre_x, centre_y, xx, xy, yy, determinant;
  VI x0, y0, x1, y1;    // the box
  VI pixel_x, pixel_y;  // that holds the centre
  hn::Mask<I32> cut;    // the box was cut to kMaxSplatSide
};
HWY_INLINE Conics ConicOf(const Surfels& s, VF grow, float add, const geometry::Rect& rect) {
  const I32 di;
  Conics c;
  constexpr int kHalf = kMaxSplatSide / 2;
  const auto farthest = Const(kHalf - 1);
  c.centre_x = hn::Add(s.x, Clamp(s.offset_x, hn::Neg(farthest), farthest));
  c.centre_y = hn::Add(s.y, Clamp(s.offset_y, hn::Neg(farthest), farthest));
  const auto xx = hn::Add(hn::Mul(grow, s.xx), Const(add)), xy = hn::Mul(grow, s.xy),
             yy = hn::Add(hn::Mul(grow, s.yy), Const(add));
  c.determinant = hn::Sub(hn::Mul(xx, yy), hn::Mul(xy, xy));
  const auto inverse = hn::Div(Const(1.0f), c.determinant);
  c.xx = hn::Mul(yy, inverse), c.xy = hn::Mul(hn::Mul(xy, Const(-2.0f)), inverse), c.yy = hn::Mul(xx, inverse);
  const auto bounds = [&](VF centre, VF variance, int low, int size, VI& pixel, VI& first, VI& last) HWY_ATTR {
    const auto reach =
        hn::Min(hn::Sqrt(variance), Const(64.0f));  // far beyond the cut; no number is too large to convert
    const auto from = hn::Sub(centre, Const(0.5f));
    pixel = hn::ConvertTo(di, hn::Floor(centre));
    first = hn::ConvertTo(di, hn::Ceil(hn::Sub(from, reach)));
    last = hn::Add(hn::ConvertTo(di, hn::Floor(hn::Add(from, reach))), hn::Set(di, 1));
    const auto least = hn::Sub(pixel, hn::Set(di, kHalf - 1)), most = hn::Add(pixel, hn::Set(di, kHalf + 1));
    const auto cut = hn::Or(hn::Lt(first, least), hn::Gt(last, most));
    first = hn::Max(hn::Max(first, least), hn::Set(di, low));
    last = hn::Min(hn::Min(last, most), hn::Set(di, low + size));
    return cut;
  };
  const auto cut_x = bounds(c.centre_x, xx, rect.x, rect.width, c.pixel_x, c.x0, c.x1);
  const auto cut_y = bounds(c.centre_y, yy, rect.y, rect.height, c.pixel_y, c.y0, c.y1);
  c.cut = hn::Or(cut_x, cut_y);
  return c;
}

// Lanes whose centre's pixel lies in the rectangle.
HWY_INLINE hn::Mask<I32> CentreIn(const Conics& c, const geometry::Rect& r) {
  const I32 di;
  return hn::And(hn::And(hn::Gt(c.pixel_x, hn::Set(di, r.x - 1)), hn::Lt(c.pixel_x, hn::Set(di, r.x + r.width))),
                 hn::And(hn::Gt(c.pixel_y, hn::Set(di, r.y - 1)), hn::Lt(c.pixel_y, hn::Set(di, r.y + r.height))));
}

// SurfelConic::at.
template <class V>
HWY_INLINE V At(V xx, V xy, V yy, V dx, V dy) {
  return hn::Add(hn::Mul(dx, hn::Add(hn::Mul(xx, dx), hn::Mul(xy, dy))), hn::Mul(hn::Mul(yy, dy), dy));
}

HWY_INLINE VF CodesPerDepth(VF w) {
  const U32 du;
  return hn::BitCast(F32(), hn::Or(hn::And(hn::BitCast(du, w), hn::Set(du, 0x007fffffu)), hn::Set(du, 0x46800000u)));
}

// surfel_depth.
struct Depths {
  VF centre, x, y;
};
HWY_INLINE Depths DepthsOf(const Surfels& s, float near_m) {
  const U32 du;
  const auto scale = hn::Neg(CodesPerDepth(s.w));
  const auto bits = hn::Sub(hn::BitCast(du, s.w), hn::Set(du, std::bit_cast<uint32_t>(near_m)));
  const auto code = hn::Mul(hn::ConvertTo(F32(), hn::BitCast(I32(), bits)), Const(1.0f / (1 << kDepthCodeShift)));
  const auto x = hn::Mul(scale, s.slope_x), y = hn::Mul(scale, s.slope_y);
  return {hn::Add(hn::Add(code, hn::Mul(x, s.offset_x)), hn::Mul(y, s.offset_y)), x, y};
}

// surfel_share.
HWY_INLINE VF ShareOf(const Surfels& s, float factor, float least, float most) {
  return hn::Mul(CodesPerDepth(s.w), Clamp(hn::Mul(Const(factor), s.rho), Const(least), Const(most)));
}

HWY_INLINE VF DeterminantOf(const Surfels& s) { return hn::Sub(hn::Mul(s.xx, s.yy), hn::Mul(s.xy, s.xy)); }

// A tile's points, in the order of the list: calls sink.add(surfels, keep) for vectors of them, and counts.
template <class Sink>
class SurfelStream {
 public:
  SurfelStream(const TileInput& input, const SurfelInput& surfels, Sink& sink)
      : input_(input), surfels_(surfels), sink_(sink), reach_factor_(Sink::kReach.growth * surfels.widest) {}

  TileCounts run() {
    const size_t lanes = hn::Lanes(F32());
    for (const TileBinning::Entry& entry : input_.entries) {
      const ItemRun run = input_.runs[entry.box];
      const LeafTransform& transform = input_.transforms[entry.box];
      const glm::vec3& facing = input_.facing[entry.box];
      PrefetchRun(input_, &entry + 1);
      for (uint32_t i = run.first; i < run.last; ++i) {
        if (i + kItemsAhead < run.last) PrefetchLevel(input_.items[i + kItemsAhead].level);
        const points::Mosaic::Level& level = input_.items[i].level;
        if (level.count >= lanes) {
          drain(transform, facing);
          if (input_.items[i].may_face_away)
            add<false, true>(transform, facing, level, surfels_.sources[i]);
          else
            add<false, false>(transform, facing, level, surfels_.sources[i]);
        } else {
          if (!stage_.has_room(level.count)) drain(transform, facing);
          stage(input_.items[i], surfels_.sources[i]);
        }
      }
      drain(transform, facing);
    }
    return counts_;
  }

 private:
  // Levels of less than a vector wait here, each point with its own source.
  void stage(const DrawItem& item, const SurfelSource& s) {
    const size_t at = stage_.level().count;
    stage_.append(item);
    for (size_t i = at; i < at + item.level.count; ++i) {
      radius_[i] = s.radius_m;
      x_[i] = s.to_eye[0], y_[i] = s.to_eye[1], z_[i] = s.to_eye[2];
    }
  }
  void drain(const LeafTransform& transform, const glm::vec3& facing) {
    const points::Mosaic::Level level = stage_.level();
    if (level.count > 0 && stage_.may_face_away())
      add<true, true>(transform, facing, level, {});
    else if (level.count > 0)
      add<true, false>(transform, facing, level, {});
    stage_.clear();
  }

  // Projects a level's points, keeps those that may touch the tile, and gives them to the sink by whole vectors.
  template <bool kStaged, bool kMayFaceAway>
  HWY_NOINLINE void add(const LeafTransform& transform_reference, const glm::vec3& facing_reference,
                        const points::Mosaic::Level& level_reference, const SurfelSource& source) {
    const F32 d;
    const U32 du;
    // Copies, which no store can change: the compiler need not read them again.
    const LeafTransform transform = transform_reference;
    const points::Mosaic::Level level = level_reference;
    const glm::vec3 facing = facing_reference;
    const auto near_m = Const(input_.near_m);
    const geometry::Rect own = input_.own;
    const auto x0 = Const(static_cast<float>(input_.rect.x)), y0 = Const(static_cast<float>(input_.rect.y)),
               x1 = Const(static_cast<float>(input_.rect.x + input_.rect.width)),
               y1 = Const(static_cast<float>(input_.rect.y + input_.rect.height));
    const auto own_x0 = Const(static_cast<float>(own.x)), own_y0 = Const(static_cast<float>(own.y)),
               own_x1 = Const(static_cast<float>(own.x + own.width)),
               own_y1 = Const(static_cast<float>(own.y + own.height));
    counts_.projected += level.count;
    uint64_t drawn = 0;
    const float reach_factor = reach_factor_;

    ForVectors(0, level.count, [&](size_t offset, size_t skip, size_t valid) HWY_ATTR {
      if (points_.count + kMaxLanes > Points::kCapacity) drain_points<kStaged>(source);
      const Lanes p = LoadLanes(level, offset);
      const auto w = Row(transform.w, p);
      const auto inverse = hn::Div(Const(1.0f), hn::Max(w, near_m));
      const auto x = hn::Mul(Row(transform.x, p), inverse), y = hn::Mul(Row(transform.y, p), inverse);
      const auto radius = kStaged ? hn::LoadU(d, radius_ + offset) : Const(source.radius_m);
      const auto reach =
          hn::Min(hn::Add(hn::Mul(hn::Mul(radius, inverse), Const(reach_factor)), Const(Sink::kReach.least_px)),
                  Const(kMaxSplatSide));
      const auto in_rect = hn::And(hn::And(hn::Ge(x, hn::Sub(x0, reach)), hn::Lt(x, hn::Add(x1, reach))),
                                   hn::And(hn::Ge(y, hn::Sub(y0, reach)), hn::Lt(y, hn::Add(y1, reach))));
      auto keep = hn::And(hn::Ge(w, near_m), in_rect);
      const auto normal = hn::PromoteTo(du, hn::LoadU(U16(), level.normal + offset));
      if (kMayFaceAway) keep = hn::AndNot(FacesAway(normal, facing), keep);
      if (valid - skip < hn::Lanes(d)) keep = hn::And(keep, hn::AndNot(hn::FirstN(d, skip), hn::FirstN(d, valid)));
      if (hn::AllFalse(d, keep)) return;
      drawn += hn::CountTrue(d, hn::And(keep, hn::And(hn::And(hn::Ge(x, own_x0), hn::Lt(x, own_x1)),
                                                      hn::And(hn::Ge(y, own_y0), hn::Lt(y, own_y1)))));
      const Compressor compress(hn::RebindMask(du, keep));
      const auto put = [&](float* to, VF v) HWY_ATTR {
        hn::StoreU(hn::BitCast(d, compress(hn::BitCast(du, v))), d, to + points_.count);
      };
      put(points_.x, x), put(points_.y, y), put(points_.w, w);
      hn::StoreU(compress(normal), du, points_.normal + points_.count);
      hn::StoreU(compress(hn::LoadU(du, level.colour + offset)), du, points_.colour + points_.count);
      if (kStaged) {
        put(points_.radius, radius);
        put(points_.eye_x, hn::LoadU(d, x_ + offset)), put(points_.eye_y, hn::LoadU(d, y_ + offset));
        put(points_.eye_z, hn::LoadU(d, z_ + offset));
      }
      points_.count += compress.count();
    });
    counts_.drawn += drawn;
    drain_points<kStaged>(source);
  }

  template <bool kStaged>
  HWY_NOINLINE void drain_points(const SurfelSource& source) {
    const F32 d;
    const I32 di;
    const U32 du;
    const SurfelCamera camera = surfels_.camera;
    Sources sources{Const(source.radius_m), Const(source.to_eye[0]), Const(source.to_eye[1]), Const(source.to_eye[2])};
    for (size_t i = 0; i < points_.count; i += hn::Lanes(d)) {
      Surfels s;
      s.x = hn::LoadU(d, points_.x + i), s.y = hn::LoadU(d, points_.y + i), s.w = hn::LoadU(d, points_.w + i);
      s.normal_code = hn::LoadU(du, points_.normal + i);
      s.albedo = hn::And(hn::LoadU(du, points_.colour + i), hn::Set(du, 0x00ffffffu));
      if (kStaged)
        sources = {hn::LoadU(d, points_.radius + i), hn::LoadU(d, points_.eye_x + i), hn::LoadU(d, points_.eye_y + i),
                   hn::LoadU(d, points_.eye_z + i)};
      // Lanes beyond the last point hold older points, or zeros: whatever they give is not kept.
      const size_t left = points_.count - i;
      s.w = hn::Max(s.w, Const(input_.near_m));
      ContourOf(camera, sources, s);
      sink_.add(s, hn::FirstN(di, left));
    }
    points_.count = 0;
  }

  // Projected points that may touch the tile, all of one source or, staged, each with its own.
  struct Points {
    static constexpr size_t kCapacity = 384;
    HWY_ALIGN float x[kCapacity + kMaxLanes] = {}, y[kCapacity + kMaxLanes] = {}, w[kCapacity + kMaxLanes] = {};
    HWY_ALIGN float radius[kCapacity + kMaxLanes] = {}, eye_x[kCapacity + kMaxLanes] = {},
                                       eye_y[kCapacity + kMaxLanes] = {}, eye_z[kCapacity + kMaxLanes] = {};
    HWY_ALIGN uint32_t normal[kCapacity + kMaxLanes] = {}, colour[kCapacity + kMaxLanes] = {};
    size_t count = 0;
  };

  static constexpr size_t kRoom = 128 + kMaxLanes;
  const TileInput& input_;
  const SurfelInput& surfels_;
  Sink& sink_;
  float reach_factor_;
  TileCounts counts_;
  Stage stage_;
  Points points_;
  HWY_ALIGN float radius_[kRoom] = {};
  HWY_ALIGN float x_[kRoom] = {}, y_[kRoom] = {}, z_[kRoom] = {};
};

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
