#include "common/net/read_ahead.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "common/core/check.h"

namespace telesplat::net {
namespace {

constexpr int kIdle_ms = 100;     // the socket's bookkeeping is done at least this often
constexpr int kSendAgain_ms = 5;  // after this the socket is tried again

int make_eventfd() {
  const int descriptor = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  CHECK(descriptor >= 0);
  return descriptor;
}

void wait_for(int descriptor, int timeout_ms) {
  pollfd item{descriptor, POLLIN, 0};
  poll(&item, 1, timeout_ms);
}

void raise(int descriptor) { eventfd_write(descriptor, 1); }
void lower(int descriptor) {
  eventfd_t count = 0;
  eventfd_read(descriptor, &count);
}

}  // namespace

ReadAhead::ReadAhead(Ends ends, const Limits& limits)
    : ends_(std::move(ends)), limits_(limits), there_(make_eventfd()), woken_(make_eventfd()), thread_([this] {
        run();
      }) {}

ReadAhead::~ReadAhead() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  raise(woken_);
  thread_.join();
  close(there_);
  close(woken_);
}

bool ReadAhead::full() const { return received_.size() >= limits_.messages || bytes_ >= limits_.bytes; }

// Sends in order. False: the socket takes no more now.
bool ReadAhead::send_waiting() {
  for (;;) {
    Outgoing next;
    {
      const std::lock_guard lock(mutex_);
      if (unsent_.empty()) return true;
      next = std::move(unsent_.front());
      unsent_.pop_front();
    }
    if (ends_.send(next)) continue;
    const std::lock_guard lock(mutex_);
    unsent_.push_front(std::move(next));
    return false;
  }
}

// Runs loop(). An exception goes to the owner, through receive().
void ReadAhead::run() {
  try {
    loop();
  } catch (...) {
    const std::lock_guard lock(mutex_);
    failed_ = std::current_exception();
    raise(there_);
  }
}

void ReadAhead::loop() {
  for (bool stop = false; !stop;) {
    if (auto due = ends_.due ? ends_.due() : std::nullopt) send(std::move(*due));
    const bool sent = send_waiting();
    bool stalled = false;
    for (;;) {
      {
        const std::lock_guard lock(mutex_);
        stop = stop_;
        stalled = stalled_ = full();
      }
      if (stop || stalled) break;
      auto message = ends_.receive();
      if (!message) break;
      const std::lock_guard lock(mutex_);
      bytes_ += message->body.size();
      received_.push_back(std::move(*message));
      if (received_.size() == 1) raise(there_);
    }
    if (stop) break;
    const int timeout_ms = sent ? kIdle_ms : kSendAgain_ms;
    if (stalled)
      wait_for(woken_, timeout_ms);
    else
      ends_.wait(woken_, timeout_ms);
    lower(woken_);
  }
  send_waiting();
}

std::optional<Message> ReadAhead::receive() {
  bool go_on = false;
  std::optional<Message> out;
  {
    const std::lock_guard lock(mutex_);
    if (received_.empty() && failed_) std::rethrow_exception(failed_);
    if (received_.empty()) return std::nullopt;
    out = std::move(received_.front());
    received_.pop_front();
    bytes_ -= out->body.size();
    if (received_.empty() && !failed_) lower(there_);
    go_on = stalled_ && !full();
  }
  if (go_on) raise(woken_);
  return out;
}

bool ReadAhead::send(Outgoing message) {
  {
    const std::lock_guard lock(mutex_);
    if (unsent_.size() >= limits_.unsent) return false;
    unsent_.push_back(std::move(message));
  }
  raise(woken_);
  return true;
}

}  // namespace telesplat::net
