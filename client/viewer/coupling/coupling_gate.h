// Where the worker and the display thread meet: Coupling behind a lock, with a condition that the display waits on.
#pragma once

#include <chrono>
#include <condition_variable>
#include <mutex>

#include "client/viewer/coupling/coupling.h"

namespace telesplat::viewer {

class CouplingGate {
 public:
  explicit CouplingGate(const CouplingState& state)
      : state_(state), coupling_(state.buffers, state.mode == CouplingMode::kImages) {}
  /// What has so many buffers: 0 async, 1 sync, else loose.
  explicit CouplingGate(int buffers)
      : CouplingGate({buffers == 0   ? CouplingMode::kAsync
                      : buffers == 1 ? CouplingMode::kSync
                                     : CouplingMode::kLoose,
                      buffers}) {}

  // ---- any thread ----
  CouplingState state() const {
    const std::lock_guard lock(mutex_);
    return state_;
  }
  int buffers() const { return state().buffers; }
  bool waits() const { return state().waits(); }

  // ---- worker ----
  /// Another coupling from now on (Coupling::set_buffers). A display that waits is woken.
  void change(const CouplingState& state) {
    {
      const std::lock_guard lock(mutex_);
      state_ = state;
      coupling_.set_newest(state.mode == CouplingMode::kImages);
      coupling_.set_buffers(state.buffers);
    }
    changed_.notify_one();
  }

  /// Runs f(Coupling&) alone; wakes the display if an update is there for it afterwards.
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

  // ---- display ----
  struct Taken {
    CouplingState coupling;            ///< in force when the wait ended
    std::optional<RequestId> request;  ///< the next complete update; none: there was none in time
    double last_sign_s = 0;            ///< Coupling::last_sign_s()
    bool asked = false;                ///< some request waits for its answer
  };
  /// The next complete update, waited for at most `timeout_s`; not at all where the coupling is asynchronous, also if
  /// that is changed meanwhile.
  Taken take(double timeout_s) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::duration<double>(timeout_s),
                      [&] { return coupling_.filled() > 0 || !state_.waits(); });
    const auto next = coupling_.take();
    return {state_, next, coupling_.last_sign_s(), !coupling_.open().empty()};
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
  CouplingState state_;
  Coupling coupling_;
};

}  // namespace telesplat::viewer
