#include "common/parallel/crew.h"

#include <atomic>

namespace telesplat {

struct Crew::Loop {
  size_t count;
  const std::function<void(size_t, int)>& turn;
  std::atomic<size_t> next{0};

  void work(int thread) {
    for (size_t n; (n = next.fetch_add(1, std::memory_order_relaxed)) < count;) turn(n, thread);
  }
};

Crew::Crew(int threads) {
  for (int i = 1; i < threads; ++i) helpers_.emplace_back([this, i] { help(i); });
}

Crew::~Crew() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

// Does not wait for helpers that wake up after the loop is over.
void Crew::run(size_t count, const std::function<void(size_t, int)>& turn) {
  Loop loop{count, turn};
  {
    const std::lock_guard lock(mutex_);
    loop_ = &loop;
    ++loops_;
  }
  if (count > helpers_.size())
    wake_.notify_all();
  else
    for (size_t n = 1; n < count; ++n) wake_.notify_one();
  loop.work(0);
  std::unique_lock lock(mutex_);
  loop_ = nullptr;
  done_.wait(lock, [this] { return helping_ == 0; });
}

void Crew::help(int thread) {
  uint64_t seen = 0;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [&] { return stop_ || (loop_ && loops_ != seen); });
    if (stop_) return;
    seen = loops_;
    Loop& loop = *loop_;
    ++helping_;
    lock.unlock();
    loop.work(thread);
    lock.lock();
    if (--helping_ == 0) done_.notify_one();
  }
}

}  // namespace telesplat
