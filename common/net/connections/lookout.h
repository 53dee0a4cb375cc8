// A thread that looks after the connections of all sockets of a context that bind, however busy their owners are.
// Private to this library.
#pragma once

#include <mutex>
#include <thread>
#include <unordered_map>

#include "common/net/connections/connections.h"

namespace telesplat::net {

class Lookout {
 public:
  /// Starts the thread.
  Lookout();
  ~Lookout();

  /// From now on connections.look() is called whenever something has happened, and hang_up_on_unread() often.
  void add(Connections& connections);
  /// It is not called any more when this returns.
  void remove(Connections& connections);

 private:
  void loop();
  void wake() const;

  const int woken_;
  std::mutex mutex_;                               // guards what follows
  std::unordered_map<Connections*, int> watched_;  // with their descriptors
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace telesplat::net
