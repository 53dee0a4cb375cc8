// Reports to ThreadSanitizer that ZeroMQ and TBB, which are built without it, pass memory from thread to thread in
// order. Does nothing without ThreadSanitizer.
#pragma once

#ifdef __has_feature
#if __has_feature(thread_sanitizer)
#define TELESPLAT_THREAD_SANITIZER 1
#include <sanitizer/tsan_interface.h>
#endif
#endif

namespace telesplat {

/// Orders this thread's work so far before other threads' work after was_handed_over(memory).
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
