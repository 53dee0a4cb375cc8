// Views of a volume that were sampled often enough to know what they cost. They are sent again, after as long as that,
// instead of being sampled, so that more samplers than processors can be studied (telesplat bench volume).
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::sampler {

class RepeatedViews {
 public:
  /// Different views that are remembered. With one more, the one that was not used for longest is forgotten.
  static constexpr size_t kViews = 64;

  struct View {
    std::vector<uint8_t> bytes;  ///< encoded slice images
    uint64_t voxels = 0;
    double splat_s = 1e9, encode_s = 1e9;  ///< CPU time of the sampling thread, the least of all times
    double cost_s() const { return splat_s + encode_s; }
  };

  /// times: how often a view is really sampled. 0: nothing is repeated.
  explicit RepeatedViews(int times) : times_(times) {}
  bool enabled() const { return times_ > 0; }

  /// The view of a lease (same slab, epoch and shear, of any viewer) if it was sampled often enough; else null. Valid
  /// until add().
  const View* find(const wire::SliceLease& lease);
  void add(const wire::SliceLease& lease, const std::vector<uint8_t>& bytes, uint64_t voxels, double splat_s,
           double encode_s);

 private:
  struct Entry {
    EpochId epoch;
    uint64_t begin = 0, end = 0;
    volume::ShearFrame shear;
    View view;
    int sampled = 0;
    uint64_t used = 0;
    bool is(const wire::SliceLease& lease) const {
      return epoch == lease.epoch && begin == lease.begin && end == lease.end && shear == lease.shear;
    }
  };
  int times_;
  uint64_t uses_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace telesplat::sampler
