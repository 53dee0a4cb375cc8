#include "services/master/tiles/plan_check.h"

#include <fmt/format.h>

#include "common/codec/mask_stream.h"

namespace telesplat::master {

Status check_answer(const wire::PlanRequest& asked, const wire::Plan& plan) {
  if (plan.full) return ok_status();
  if (!asked.extra && plan.camera != asked.camera)
    return Error{fmt::format("the plan of frame {} is not of the camera that was asked for", plan.frame.value)};
  const std::span<const uint32_t> masks(plan.masks);
  size_t begin = 0;
  uint64_t pixels = 0;
  for (size_t i = 0; i < plan.tiles.size(); i += wire::kPlanNumbers) {
    const uint32_t *n = &plan.tiles[i], rays = n[4], words = n[5];
    if (words == 0) continue;
    if (pixels += uint64_t(n[2]) * n[3]; pixels > kMaxMaskedPixels)
      return Error{fmt::format("the plan of frame {}: masks of {} pixels, limit {}", plan.frame.value, pixels,
                               kMaxMaskedPixels)};
    const auto mask = codec::decode_mask(masks.subspan(begin, words), int(n[2]), int(n[3]));
    begin += words;
    const auto where = [&] {
      return fmt::format("the plan of frame {}, tile {}", plan.frame.value, i / wire::kPlanNumbers);
    };
    if (!mask) return Error{fmt::format("{}: {}", where(), mask.error().text)};
    if (mask->count() != rays) return Error{fmt::format("{}: {} rays, its mask has {}", where(), rays, mask->count())};
  }
  return ok_status();
}

}  // namespace telesplat::master
