// Tells ThreadSanitizer what it cannot see: that ZeroMQ and TBB, which are built without it, hand memory from thread to
// thread, and order what they do with it. Nothing without ThreadSanitizer.
#pragma once

#ifdef __has_feature
#if __has_feature(thread_sanitizer)
#define TELESPLAT_THREAD_SANITIZER 1
#include <sanitizer/tsan_interface.h>
#endif
#endif

namespace telesplat {

/// What this thread did until now comes before what others do after was_handed_over(memory).
inline void hand_over([[maybe_unused]] void* memory) {
#ifdef TELESPLAT_THREAD_SANITIZER
  __tsan_release(memory);
#endif
}
inline void was_handed_over([[maybe_unused]] void* memory) {
#ifdef TELESPLAT_THREAD_SANITIZER
  __tsan_acquire(memory);
#endif
}

}  // namespace telesplat
