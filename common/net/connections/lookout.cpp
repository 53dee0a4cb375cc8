#include "common/net/connections/lookout.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <vector>

namespace telesplat::net {
namespace {

constexpr int kUnread_ms = 50;  // what a fast network brings meanwhile is read into memory, whoever sends it

}  // namespace

// Signals are for the threads that wait for them.
Lookout::Lookout() : woken_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
  sigset_t all, before;
  sigfillset(&all);
  pthread_sigmask(SIG_SETMASK, &all, &before);
  thread_ = std::thread([this] { loop(); });
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
}

Lookout::~Lookout() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake();
  thread_.join();
  ::close(woken_);
}

void Lookout::add(Connections& connections) {
  {
    const std::lock_guard lock(mutex_);
    watched_[&connections] = connections.descriptor();
  }
  wake();
}

void Lookout::remove(Connections& connections) {
  {
    const std::lock_guard lock(mutex_);
    watched_.erase(&connections);
  }
  wake();
}

void Lookout::wake() const {
  const uint64_t one = 1;
  [[maybe_unused]] const ssize_t written = ::write(woken_, &one, sizeof one);
}

void Lookout::loop() {
  std::vector<pollfd> items;
  for (;;) {
    bool anybody = false;
    {
      const std::lock_guard lock(mutex_);
      if (stop_) return;
      for (const auto& [connections, descriptor] : watched_) {
        connections->look();
        anybody |= connections->hang_up_on_unread();
      }
      items.assign(1, {woken_, POLLIN, 0});
      for (const auto& [connections, descriptor] : watched_) items.push_back({descriptor, POLLIN, 0});
    }
    ::poll(items.data(), items.size(), anybody ? kUnread_ms : -1);
    uint64_t count = 0;
    [[maybe_unused]] const ssize_t read = ::read(woken_, &count, sizeof count);
  }
}

}  // namespace telesplat::net
