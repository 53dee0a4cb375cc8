// A thread that only receives and sends a socket's messages: so a busy process knows when a message came, not only when
// it found time for it. Private to this library.
#pragma once

#include <deque>
#include <exception>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "common/net/socket.h"

namespace telesplat::net {

class ReadAhead {
 public:
  struct Outgoing {
    std::string type, body;
  };
  /// Operations on the socket. From the constructor to the destructor only the thread calls them.
  struct Ends {
    std::function<std::optional<Message>()> receive;           ///< without waiting
    std::function<bool(Outgoing&)> send;                       ///< without waiting; false: not now, nothing changed
    std::function<void(int descriptor, int timeout_ms)> wait;  ///< for a message, or until `descriptor` is readable
    /// Messages that are due by time alone, even if the owner is busy; asked at least every 100 ms. May be empty.
    std::function<std::optional<Outgoing>()> due = {};
  };
  /// Limits of received messages not taken yet, and of the bytes of their bodies: above, the thread stops reading and
  /// senders have to wait. unsent: messages that could not be sent yet; above, send() refuses.
  struct Limits {
    size_t messages = 1024;
    size_t bytes = 64u << 20;
    size_t unsent = 1000;
  };

  /// Starts the thread.
  ReadAhead(Ends ends, const Limits& limits);
  /// Sends the remaining messages, as far as the socket takes them at once; ends the thread.
  ~ReadAhead();

  /// The next message, without waiting. Throws the exception that ended the thread, if there was one.
  std::optional<Message> receive();
  /// False: dropped, because too many wait already.
  bool send(Outgoing message);
  /// A file descriptor that is readable while receive() has a message.
  int descriptor() const { return there_; }

 private:
  void run();
  void loop();
  bool send_waiting();
  bool full() const;

  Ends ends_;
  const Limits limits_;
  const int there_, woken_;  // eventfds: one wakes the owner, one the thread
  std::mutex mutex_;         // guards all members below
  std::deque<Message> received_;
  std::deque<Outgoing> unsent_;
  size_t bytes_ = 0;  // bytes of the bodies in received_
  bool stalled_ = false, stop_ = false;
  std::exception_ptr failed_;
  std::thread thread_;
};

}  // namespace telesplat::net
