#include "common/parallel/in_parallel.h"

#ifdef TELESPLAT_THREAD_SANITIZER
#include <algorithm>
#include <atomic>
#include <exception>
#include <latch>
#include <mutex>
#include <thread>

namespace telesplat::detail {
namespace {

thread_local int t_thread = 0;
thread_local bool t_in_loop = false;

}  // namespace

int thread_in_run() { return t_thread; }

void run_turns(size_t count, const std::function<void(size_t)>& turn) {
  constexpr int kMostThreads = 4;
  const int threads =
      t_in_loop
          ? 1
          : static_cast<int>(std::min<size_t>(
                count, static_cast<size_t>(std::clamp(tbb::this_task_arena::max_concurrency(), 1, kMostThreads))));
  if (threads <= 1) {
    for (size_t n = 0; n < count; ++n) turn(n);
    return;
  }
  std::atomic<size_t> next{0};
  std::exception_ptr thrown;
  std::mutex mutex;           // guards `thrown`
  std::latch begun(threads);  // else a short loop would end before another thread takes a turn
  const auto work = [&](int thread) {
    t_thread = thread, t_in_loop = true;
    begun.arrive_and_wait();
    try {
      for (size_t n; (n = next.fetch_add(1, std::memory_order_relaxed)) < count;) turn(n);
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!thrown) thrown = std::current_exception();
    }
    t_thread = 0, t_in_loop = false;
  };
  std::vector<std::thread> others;
  for (int thread = 1; thread < threads; ++thread) others.emplace_back(work, thread);
  work(0);
  for (std::thread& other : others) other.join();
  if (thrown) std::rethrow_exception(thrown);
}

}  // namespace telesplat::detail
#endif
