// Threads of one owner that sleep between its loops, for loops that must begin at once beside busy processes.
//
// TBB's threads look for work for a while before they sleep, and yield the processor meanwhile. On Linux 6.18 each
// yield costs a thread the rest of its slice, so that processes of lower priority run first: beside packer and samplers
// on two cores, the display drew on one. A thread that wakes up is scheduled by its priority.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace telesplat {

class Crew {
 public:
  /// threads: number with the caller of run(), at least 1.
  explicit Crew(int threads);
  ~Crew();
  Crew(const Crew&) = delete;
  Crew& operator=(const Crew&) = delete;

  int threads() const { return static_cast<int>(helpers_.size()) + 1; }

  /// Calls turn(n, thread) for each n below `count`, in about this order; thread: index of the running thread, 0 for
  /// the caller. Returns when all are done. Precondition: one call at a time; turns do not throw and do not call run().
  void run(size_t count, const std::function<void(size_t, int)>& turn);

 private:
  struct Loop;
  void help(int thread);

  std::mutex mutex_;
  std::condition_variable wake_, done_;
  Loop* loop_ = nullptr;  // loop that helpers may join
  uint64_t loops_ = 0;
  int helping_ = 0;
  bool stop_ = false;
  std::vector<std::thread> helpers_;
};

}  // namespace telesplat
