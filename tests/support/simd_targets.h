// Runs a scope of a test on one instruction set.
#pragma once

#include <hwy/targets.h>

#include <vector>

namespace telesplat::testing {

class OnTarget {
 public:
  // If no code exists for `target`, uses that of the next slower one.
  explicit OnTarget(int64_t target) { use(hwy::SupportedTargets() & ~(target - 1)); }
  ~OnTarget() { use(0); }
  OnTarget(const OnTarget&) = delete;
  OnTarget& operator=(const OnTarget&) = delete;

 private:
  static void use(int64_t targets) {
    hwy::SetSupportedTargetsForTest(targets);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
};

/// Least number of targets: sanitized programs are compiled for one.
#if defined(HWY_COMPILE_ONLY_STATIC)
inline constexpr size_t kLeastTargets = 1;
#else
inline constexpr size_t kLeastTargets = 2;
#endif

/// Returns every compiled instruction set that this machine has.
inline std::vector<int64_t> simd_targets() { return hwy::SupportedAndGeneratedTargets(); }

}  // namespace telesplat::testing
