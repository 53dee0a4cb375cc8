#include "services/sampler/tiles/replay.h"

#include <algorithm>

#include "common/core/log.h"
#include "services/sampler/tiles/masked_image.h"

namespace telesplat::sampler {

ReplayTiles::ReplayTiles(Replay replay, double cost_scale) : replay_(std::move(replay)), cost_before_s_{0} {
  for (const double cost : replay_.row_cost_s) cost_before_s_.push_back(cost_before_s_.back() + cost * cost_scale);
}

Readiness ReplayTiles::readiness(const HeldLease& held, double now_s) {
  using State = Readiness::State;
  const wire::Lease& lease = held.lease;
  if (lease.camera.width != replay_.frame.width || lease.camera.height != replay_.frame.height || lease.step != 1) {
    log::warn("a lease of a frame of {}x{}, step {}, was dropped: the replay is of {}x{}", lease.camera.width,
              lease.camera.height, lease.step, replay_.frame.width, replay_.frame.height);
    return {State::kHopeless};
  }
  if (lease.lease != lease_) {
    lease_ = lease.lease;
    begin_s_ = std::max(end_s_, held.received_s);
    const double whole_rows_s = cost_before_s_[lease.rect.y + lease.rect.height] - cost_before_s_[lease.rect.y];
    const double pixels = double(lease.rect.width) * lease.rect.height;
    const double part = held.mask ? double(held.mask->count()) / pixels : 1.0;
    end_s_ = begin_s_ + whole_rows_s * part * lease.rect.width / lease.camera.width;
  }
  if (now_s >= end_s_) return {};
  return {State::kWaits, end_s_};
}

Sampled ReplayTiles::sample(const HeldLease& held) {
  const geometry::Rect& r = held.lease.rect;
  Sampled out{{r.width, r.height}, begin_s_, end_s_};
  const auto copy = [&](const auto& from, auto& to) {
    for (int y = 0; y < r.height; ++y)
      std::copy_n(from.begin() + size_t(r.y + y) * replay_.frame.width + r.x, r.width,
                  to.begin() + size_t(y) * r.width);
  };
  copy(replay_.frame.depth, out.image.depth);
  copy(replay_.frame.colour, out.image.colour);
  copy(replay_.frame.normal, out.image.normal);
  if (held.mask) keep_only(*held.mask, out.image);
  return out;
}

}  // namespace telesplat::sampler
