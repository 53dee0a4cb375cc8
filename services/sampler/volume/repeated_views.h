// Views of a volume that were sampled so often that what they cost is known: they are sent again, after as long as that, instead of being
// sampled. So many more samplers than there are processors can be studied (telesplat bench volume). Everything else is as ever.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "common/wire/messages.h"

namespace telesplat::sampler {

class RepeatedViews {
 public:
  /// So many different views are remembered; then the one that was not used for longest is sampled anew.
  static constexpr size_t kViews = 64;

  struct View {
    std::vector<uint8_t> bytes;  ///< encoded slice images
    uint64_t voxels = 0;
    double splat_s = 1e9, encode_s = 1e9;  ///< CPU time of the sampling thread, the least of all times
    double cost_s() const { return splat_s + encode_s; }
  };

  /// times: that a view is sampled in earnest. 0: nothing is repeated.
  explicit RepeatedViews(int times) : times_(times) {}
  bool enabled() const { return times_ > 0; }

  /// The view of a lease, if it was sampled so often: of the same slab, epoch and shear, whoever asked. Valid until add().
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

/// CPU time of this thread, seconds.
double thread_cpu_s();

}  // namespace telesplat::sampler
