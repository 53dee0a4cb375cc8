// Loops on several threads of TBB. All go through here, so that ThreadSanitizer can watch them: it does not see how
// TBB's threads wait for each other, since Debian's library is built without it. Under ThreadSanitizer each loop has
// threads of its own.
#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_invoke.h>
#include <tbb/parallel_reduce.h>
#include <tbb/task_arena.h>

#include <functional>
#include <type_traits>
#include <vector>

#include "common/parallel/handed_over.h"

namespace telesplat {

#ifdef TELESPLAT_THREAD_SANITIZER
namespace detail {
/// Calls turn(n) for each n below `count`, on as many threads as the caller's arena has, at most four; inside such a
/// loop only on the caller's. An exception of a turn ends the loop and is thrown again.
void run_turns(size_t count, const std::function<void(size_t)>& turn);
int thread_in_run();

/// Parts of a range in order, at most 2^halvings.
template <class Range>
std::vector<Range> parts_of(Range range, int halvings) {
  if (range.empty()) return {};
  if (!range.is_divisible() || halvings == 0) return {range};
  Range upper(range, tbb::split());
  auto parts = parts_of(range, halvings - 1);
  const auto more = parts_of(upper, halvings - 1);
  parts.insert(parts.end(), more.begin(), more.end());
  return parts;
}
}  // namespace detail
#endif

/// Calls turn(part) for parts of a range (tbb::blocked_range); a partitioner of TBB chooses their sizes.
template <class Range, class Turn, class... Partitioner>
requires std::is_class_v<Range>
void in_parallel(const Range& range, const Turn& turn, const Partitioner&... partitioner) {
#ifdef TELESPLAT_THREAD_SANITIZER
  const auto parts = detail::parts_of(range, 6);
  detail::run_turns(parts.size(), [&](size_t n) { turn(parts[n]); });
  (void)sizeof...(partitioner);
#else
  tbb::parallel_for(range, turn, partitioner...);
#endif
}

/// Calls turn(i) for each i in [first, last).
template <class Index, class Turn>
requires std::is_integral_v<Index>
void in_parallel(Index first, Index last, const Turn& turn) {
  in_parallel(tbb::blocked_range<Index>(first, last), [&](const tbb::blocked_range<Index>& part) {
    for (Index i = part.begin(); i < part.end(); ++i) turn(i);
  });
}

template <class A, class B>
void both_in_parallel(const A& a, const B& b) {
#ifdef TELESPLAT_THREAD_SANITIZER
  detail::run_turns(2, [&](size_t n) { n == 0 ? a() : b(); });
#else
  tbb::parallel_invoke(a, b);
#endif
}

/// Sums of turn(part, sum so far), starting from `none`, joined in the same order for any number of threads.
template <class Range, class Sum, class Turn, class Join>
Sum sum_in_parallel(const Range& range, const Sum& none, const Turn& turn, const Join& join) {
#ifdef TELESPLAT_THREAD_SANITIZER
  const auto parts = detail::parts_of(range, 64);  // as small as TBB's parts, so that sums are the same
  std::vector<Sum> sums(parts.size(), none);
  detail::run_turns(parts.size(), [&](size_t n) { sums[n] = turn(parts[n], none); });
  // Joins halves of halves, as ranges are divided.
  const auto joined = [&](const auto& self, size_t begin, size_t end) -> Sum {
    if (end - begin == 1) return sums[begin];
    const size_t middle = begin + (end - begin) / 2;
    return join(self(self, begin, middle), self(self, middle, end));
  };
  return sums.empty() ? none : joined(joined, 0, sums.size());
#else
  return tbb::parallel_deterministic_reduce(range, none, turn, join);
#endif
}

/// Inside a loop: index of this thread among those that run it at the same time, below the arena's concurrency.
inline int thread_in_loop() {
#ifdef TELESPLAT_THREAD_SANITIZER
  return detail::thread_in_run();
#else
  return tbb::this_task_arena::current_thread_index();
#endif
}

}  // namespace telesplat
