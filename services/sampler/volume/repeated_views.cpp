#include "services/sampler/volume/repeated_views.h"

#include <algorithm>

namespace telesplat::sampler {

const RepeatedViews::View* RepeatedViews::find(const wire::SliceLease& lease) {
  const auto found = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.is(lease); });
  if (found == entries_.end() || found->sampled < times_) return nullptr;
  found->used = ++uses_;
  return &found->view;
}

void RepeatedViews::add(const wire::SliceLease& lease, const std::vector<uint8_t>& bytes, uint64_t voxels,
                        double splat_s, double encode_s) {
  if (!enabled()) return;
  auto entry = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.is(lease); });
  if (entry == entries_.end()) {
    if (entries_.size() == kViews)
      entries_.erase(std::min_element(entries_.begin(), entries_.end(),
                                      [](const Entry& a, const Entry& b) { return a.used < b.used; }));
    entry = entries_.insert(entries_.end(), {lease.epoch, lease.begin, lease.end, lease.shear, {}, 0, 0});
  }
  entry->used = ++uses_;
  ++entry->sampled;
  entry->view.bytes = bytes;
  entry->view.voxels = voxels;
  entry->view.splat_s = std::min(entry->view.splat_s, splat_s);
  entry->view.encode_s = std::min(entry->view.encode_s, encode_s);
}

}  // namespace telesplat::sampler
