// Whether a plan can be leased.
#pragma once

#include "common/core/result.h"
#include "common/wire/tile_messages.h"

namespace telesplat::master {

/// More than any plan has. Hostile masks of as many pixels take up to 0.4 s to decode.
inline constexpr uint64_t kMaxMaskedPixels = uint64_t{1} << 24;

/// Error: the plan of a view is of another camera than was asked for; a tile's mask is none of its size, or has another
/// number of rays than the plan says; all masks together have more than kMaxMaskedPixels. What wire::check(plan)
/// refuses need not be looked for.
/// Cost: that of decoding the masks; those of plans take 0.1 to 0.6 ms a million pixels.
Status check_answer(const wire::PlanRequest& asked, const wire::Plan& plan);

}  // namespace telesplat::master
