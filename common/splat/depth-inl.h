// Depth alone, one pixel a point: the reference depth map.
// Included once a target, by splat_kernels.cpp.
#if defined(TELESPLAT_SPLAT_DEPTH_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef TELESPLAT_SPLAT_DEPTH_INL_H_
#undef TELESPLAT_SPLAT_DEPTH_INL_H_
#else
#define TELESPLAT_SPLAT_DEPTH_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>

#include "common/splat/projection-inl.h"

HWY_BEFORE_NAMESPACE();
namespace telesplat::splat::HWY_NAMESPACE {

template <bool kWhole, bool kMayFaceAway>
HWY_NOINLINE void DepthLevel(const LeafTransform& transform_reference, const glm::vec3& facing,
                             const points::Mosaic::Level& level_reference, const geometry::Rect& rect, float near_m,
                             uint32_t* depth_bits) {
  const I32 di;
  const U32 du;
  const LeafTransform transform = transform_reference;
  const points::Mosaic::Level level = level_reference;
  const auto x0 = hn::Set(di, rect.x), y0 = hn::Set(di, rect.y);
  const auto width = hn::Set(di, rect.width), height = hn::Set(di, rect.height), minus_one = hn::Set(di, -1);
  HWY_ALIGN uint32_t place[kMaxLanes];
  HWY_ALIGN uint32_t bits[kMaxLanes];
  // A point that is drawn twice changes nothing, so lanes that overlap are not left out.
  ForVectors(0, level.count, [&](size_t offset, size_t, size_t valid) HWY_ATTR {
    const Projected p = Project(transform, LoadLanes(level, offset), near_m, 1 << kReferenceSubBits, 0.0f);
    const auto px = hn::Sub(hn::ShiftRight<kReferenceSubBits>(p.x), x0),
               py = hn::Sub(hn::ShiftRight<kReferenceSubBits>(p.y), y0);
    const auto at = hn::BitCast(du, hn::Add(hn::Mul(py, width), px));
    const auto sub_mask = hn::Set(di, (1 << kReferenceSubBits) - 1);
    const auto sub = hn::Or(hn::ShiftLeft<kReferenceSubBits>(hn::And(p.y, sub_mask)), hn::And(p.x, sub_mask));
    const auto depth = hn::Or(hn::AndNot(hn::Set(du, kReferencePlaceMask), hn::BitCast(du, p.w)), hn::BitCast(du, sub));
    size_t n = valid;
    if (kWhole && !kMayFaceAway) {
      hn::Store(at, du, place);
      hn::Store(depth, du, bits);
    } else {
      const auto in_x = hn::And(hn::Gt(px, minus_one), hn::Lt(px, width));
      const auto in_y = hn::And(hn::Gt(py, minus_one), hn::Lt(py, height));
      const auto beyond_near = hn::RebindMask(di, hn::Ge(p.w, hn::Set(F32(), near_m)));
      auto keep = hn::And(hn::FirstN(di, valid), hn::And(hn::And(in_x, in_y), beyond_near));
      if (kMayFaceAway) {
        const auto normal = hn::PromoteTo(du, hn::LoadU(U16(), level.normal + offset));
        keep = hn::AndNot(hn::RebindMask(di, FacesAway(normal, facing)), keep);
      }
      if (hn::AllFalse(di, keep)) return;
      const Compressor compress(hn::RebindMask(du, keep));
      hn::Store(compress(at), du, place);
      hn::Store(compress(depth), du, bits);
      n = compress.count();
    }
    for (size_t j = 0; j < n; ++j) depth_bits[place[j]] = std::min(depth_bits[place[j]], bits[j]);
  });
}

void DepthTile(const TileInput& input, uint32_t* depth_bits) {
  const size_t lanes = hn::Lanes(F32());
  Stage stage;
  for (const TileBinning::Entry& entry : input.entries) {
    const auto draw = [&](const points::Mosaic::Level& level, bool may_face_away) {
      const auto of = entry.whole ? (may_face_away ? DepthLevel<true, true> : DepthLevel<true, false>)
                                  : (may_face_away ? DepthLevel<false, true> : DepthLevel<false, false>);
      of(input.transforms[entry.box], input.facing[entry.box], level, input.rect, input.near_m, depth_bits);
    };
    const auto drain = [&] {
      draw(stage.level(), stage.may_face_away());
      stage.clear();
    };
    const ItemRun run = input.runs[entry.box];
    PrefetchRun(input, &entry + 1);
    for (uint32_t i = run.first; i < run.last; ++i) {
      if (i + kItemsAhead < run.last) PrefetchLevel(input.items[i + kItemsAhead].level);
      const DrawItem& item = input.items[i];
      if (item.level.count >= lanes) {
        draw(item.level, item.may_face_away);
      } else {
        if (!stage.has_room(item.level.count)) drain();
        stage.append(item);
      }
    }
    drain();
  }
}

}  // namespace telesplat::splat::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
