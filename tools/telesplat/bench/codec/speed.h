// How fast something is on each instruction set that was compiled and that this machine has.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

namespace telesplat::launcher {

/// Million pixels a second, of one core.
struct TargetSpeed {
  std::string target;  ///< "AVX2", as Highway calls it
  double encode = 0, decode = 0;
};

/// Repeats each for `seconds` of processor time on each instruction set, at least three times, and takes the median:
/// other programs count little. pixels: of one call. Other threads must not use the codecs meanwhile.
std::vector<TargetSpeed> measure_speeds(size_t pixels, double seconds, const std::function<void()>& encode,
                                        const std::function<void()>& decode);

}  // namespace telesplat::launcher
