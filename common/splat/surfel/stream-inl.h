// Feeds the points of a tile to the surfel kernels.
// Included once a target, by surfel/kernels.cpp.
#if defined(TELESPLAT_SPLAT_SURFEL_STREAM_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_SURFEL_STREAM_INL_H_
#undef TELESPLAT_SPLAT_SURFEL_STREAM_INL_H_
#else
#define TELESPLAT_SPLAT_SURFEL_STREAM_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "common/splat/surfel/surfel-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

// A tile's points, in the order of the list: projects them, keeps those that may touch the tile, and counts. It does
// not depend on the kernel, so it is compiled once a target; one virtual call serves some hundred points.
class SurfelPoints {
 public:
  SurfelPoints(const TileInput& input, const SurfelInput& surfels, const SurfelReach& reach)
      : input_(input), surfels_(surfels), reach_factor_(reach.growth * surfels.widest), least_reach_(reach.least_px) {}

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

 protected:
  ~SurfelPoints() = default;

  // Projected points that may touch the tile, all from one source or, staged, each with its own.
  struct Points {
    static constexpr size_t kCapacity = 384;
    HWY_ALIGN float x[kCapacity + kMaxLanes] = {}, y[kCapacity + kMaxLanes] = {}, w[kCapacity + kMaxLanes] = {};
    HWY_ALIGN float radius[kCapacity + kMaxLanes] = {}, eye_x[kCapacity + kMaxLanes] = {},
                                       eye_y[kCapacity + kMaxLanes] = {}, eye_z[kCapacity + kMaxLanes] = {};
    HWY_ALIGN uint32_t normal[kCapacity + kMaxLanes] = {}, colour[kCapacity + kMaxLanes] = {};
    size_t count = 0;
  };

  // Draws points_ and empties it. source: of all points, unless they are staged.
  virtual void draw_points(bool staged, const SurfelSource& source) = 0;

  const TileInput& input_;
  const SurfelInput& surfels_;
  Points points_;

 private:
  // Stages a level smaller than a vector, each point with its own source.
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

  // Projects a level's points and draws those that may touch the tile.
  template <bool kStaged, bool kMayFaceAway>
  HWY_NOINLINE void add(const LeafTransform& transform_reference, const glm::vec3& facing_reference,
                        const points::Mosaic::Level& level_reference, const SurfelSource& source) {
    const F32 d;
    const U32 du;
    // Local copies, which no store can change: the compiler need not read them again.
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
    const auto least_reach = Const(least_reach_);

    ForVectors(0, level.count, [&](size_t offset, size_t skip, size_t valid) HWY_ATTR {
      if (points_.count + kMaxLanes > Points::kCapacity) draw_points(kStaged, source);
      const Lanes p = LoadLanes(level, offset);
      const auto w = Row(transform.w, p);
      const auto inverse = hn::Div(Const(1.0f), hn::Max(w, near_m));
      const auto x = hn::Mul(Row(transform.x, p), inverse), y = hn::Mul(Row(transform.y, p), inverse);
      const auto radius = kStaged ? hn::LoadU(d, radius_ + offset) : Const(source.radius_m);
      const auto reach =
          hn::Min(hn::Add(hn::Mul(hn::Mul(radius, inverse), Const(reach_factor)), least_reach), Const(kMaxSplatSide));
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
    draw_points(kStaged, source);
  }

  static constexpr size_t kRoom = 128 + kMaxLanes;
  const float reach_factor_, least_reach_;
  TileCounts counts_;
  Stage stage_;
  HWY_ALIGN float radius_[kRoom] = {};
  HWY_ALIGN float x_[kRoom] = {}, y_[kRoom] = {}, z_[kRoom] = {};
};

// Calls sink.add(surfels, keep) for vectors of a tile's points.
template <class Sink>
class SurfelStream final : public SurfelPoints {
 public:
  SurfelStream(const TileInput& input, const SurfelInput& surfels, Sink& sink)
      : SurfelPoints(input, surfels, Sink::kReach), sink_(sink) {}

 private:
  void draw_points(bool staged, const SurfelSource& source) override {
    if (staged)
      draw<true>(source);
    else
      draw<false>(source);
  }

  template <bool kStaged>
  HWY_NOINLINE void draw(const SurfelSource& source) {
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
      // Lanes beyond the last point hold older points, or zeros: their results are not kept.
      const size_t left = points_.count - i;
      s.w = hn::Max(s.w, Const(input_.near_m));
      ContourOf(camera, sources, s);
      sink_.add(s, hn::FirstN(di, left));
    }
    points_.count = 0;
  }

  Sink& sink_;
};

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
