// Where the worker and the display thread meet: Coupling behind a lock, with a condition that the display waits on.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "client/viewer/coupling/coupling.h"

namespace telesplat::viewer {

class CouplingGate {
 public:
  explicit CouplingGate(int buffers) : coupling_(buffers) {}
  int buffers() const { return coupling_.buffers(); }
  bool waits() const { return coupling_.waits(); }

  /// Worker: runs f(Coupling&) alone; wakes the display if an update is there for it afterwards.
  template <class F>
  auto with(F&& f) {
    struct Wake {
      CouplingGate& gate;
      std::unique_lock<std::mutex> lock;
      ~Wake() {
        const bool there = gate.coupling_.filled() > 0;
        lock.unlock();
        if (there) gate.changed_.notify_one();
      }
    } wake{*this, std::unique_lock(mutex_)};
    return f(coupling_);
  }

  /// Display: the next complete update, waited for at most `timeout_s`.
  std::optional<RequestId> take(double timeout_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout_s), [&] { return coupling_.filled() > 0; });
    return coupling_.take();
  }
  void displayed() {
    const std::lock_guard lock(mutex_);
    coupling_.displayed();
  }
  int filled() const {
    const std::lock_guard lock(mutex_);
    return coupling_.filled();
  }

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Coupling coupling_;
};

}  // namespace telesplat::viewer
