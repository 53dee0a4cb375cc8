// What must hold between the fields of a message, beyond each field's own limits. Private to this library.
#pragma once

#include <optional>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::wire {

/// Most messages have nothing to check.
template <class M>
std::optional<Error> check(const M&) {
  return std::nullopt;
}

std::optional<Error> check(const Welcome& m);
std::optional<Error> check(const Lease& m);
std::optional<Error> check(const PlanRequest& m);
std::optional<Error> check(const Plan& m);
std::optional<Error> check(const DepthTile& m);
std::optional<Error> check(const Patch& m);
std::optional<Error> check(const PictureTile& m);
std::optional<Error> check(const Picture& m);
std::optional<Error> check(const Forget& m);
std::optional<Error> check(const AccessReport& m);
std::optional<Error> check(const ViewRequest& m);
std::optional<Error> check(const SliceAck& m);
std::optional<Error> check(const SliceWeights& m);
std::optional<Error> check(const SlabAssignment& m);
std::optional<Error> check(const SliceLease& m);
std::optional<Error> check(const SliceImages& m);
std::optional<Error> check(const VoxelRequest& m);
std::optional<Error> check(const VoxelData& m);
std::optional<Error> check(const SwapReady& m);

}  // namespace telesplat::wire
