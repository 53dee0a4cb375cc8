#include "tools/telesplat/bench/codec/speed.h"

#include <algorithm>

#include "common/core/clock.h"
#include "common/net/service.h"

namespace telesplat::launcher {
namespace {

double megapixels_a_second(size_t pixels, double seconds, const std::function<void()>& work) {
  constexpr size_t kLeast = 3;
  work();  // memory and tables
  std::vector<double> took_s;
  for (double total_s = 0; (total_s < seconds || took_s.size() < kLeast) && !net::stop_requested();) {
    const double begin_s = thread_cpu_s();
    work();
    took_s.push_back(std::max(thread_cpu_s() - begin_s, 1e-9));
    total_s += took_s.back();
  }
  if (took_s.empty()) return 0;
  std::nth_element(took_s.begin(), took_s.begin() + ptrdiff_t(took_s.size() / 2), took_s.end());
  return double(pixels) * 1e-6 / took_s[took_s.size() / 2];
}

}  // namespace

std::vector<TargetSpeed> measure_speeds(size_t pixels, double seconds, const std::function<void()>& encode,
                                        const std::function<void()>& decode) {
  return {{"this machine", megapixels_a_second(pixels, seconds, encode), megapixels_a_second(pixels, seconds, decode)}};
}

}  // namespace telesplat::launcher
