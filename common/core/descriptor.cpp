#include "common/core/descriptor.h"

#include <cerrno>
#include <thread>

namespace telesplat {

bool Descriptor::lock_within(std::chrono::milliseconds patience) const {
  constexpr std::chrono::milliseconds kPause{5};
  const auto until = std::chrono::steady_clock::now() + patience;
  while (valid() && !lock(LOCK_EX | LOCK_NB)) {
    if (errno != EWOULDBLOCK && errno != EINTR) return true;
    if (std::chrono::steady_clock::now() > until) return false;
    std::this_thread::sleep_for(kPause);
  }
  return true;
}

}  // namespace telesplat
