// A thread that does nothing but take messages from a socket and give it others: so that a process that works knows
// when a message came, not only when it found time for it. Private to this library.
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
  /// What can be done with the socket. From the constructor to the destructor nobody but the thread does it.
  struct Ends {
    std::function<std::optional<Message>()> receive;           ///< without waiting
    std::function<bool(Outgoing&)> send;                       ///< without waiting; false: not now, nothing changed
    std::function<void(int descriptor, int timeout_ms)> wait;  ///< for a message, or until `descriptor` is readable
    /// What is to be said by time alone, however busy the owner is; asked at least every 100 ms. May be empty.
    std::function<std::optional<Outgoing>()> due = {};
  };
  /// Messages that were not taken yet, at most, and the bytes of their bodies: then nothing more is read, and whoever
  /// sends has to wait. Messages that could not be sent yet: then send() refuses.
  struct Limits {
    size_t messages = 1024;
    size_t bytes = 64u << 20;
    size_t unsent = 1000;
  };

  /// Starts the thread.
  ReadAhead(Ends ends, const Limits& limits);
  /// Gives the socket what is left to send, as far as it takes it at once; ends the thread.
  ~ReadAhead();

  /// The next message, without waiting. Throws what ended the thread, if something did.
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
  const int there_, woken_;  // eventfds: for the owner, for the thread
  std::mutex mutex_;         // guards what follows
  std::deque<Message> received_;
  std::deque<Outgoing> unsent_;
  size_t bytes_ = 0;  // of received_
  bool stalled_ = false, stop_ = false;
  std::exception_ptr failed_;
  std::thread thread_;
};

}  // namespace telesplat::net
