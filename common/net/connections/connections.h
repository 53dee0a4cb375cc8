// The connections of a socket that binds: those that came, ended or stayed silent, and the limit of their number.
// Private to this library.
#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/log.h"
#include "common/net/connections/monitor.h"

namespace telesplat::net {

/// A connection that has not identified itself after this time is dropped.
inline constexpr double kHandshake_s = 5;

/// Any thread may make all calls except judge() and begin_reading().
class Connections {
 public:
  struct Options {
    std::string name;                     ///< name of the socket, for the log
    size_t most = 1024;                   ///< open at a time; further ones are hung up on
    uint64_t most_unread = ~uint64_t(0);  ///< unread bytes of one connection; one with more is hung up on
    bool guarded = false;                 ///< a failed handshake means that the peer has no key that fits
    bool publishes = false;
    double quiet_s = 1e30;  ///< a connection that stays silent for longer is no stranger: it had nothing to send
  };
  struct Counts {
    size_t open = 0;
    uint64_t refused = 0;       ///< connections beyond `most` or most_unread, or hung up on for a message
    uint64_t keys_refused = 0;  ///< failed handshakes
    uint64_t silent = 0;        ///< connections that ended without one whole message, and were judged
  };

  /// To be made before `socket` binds. `socket` must outlive it.
  Connections(zmq::context_t& context, zmq::socket_t& socket, Options options);
  ~Connections();

  /// Takes ZeroMQ's events, and hangs up on connections beyond Options::most. A peer that comes back later, as ZeroMQ's
  /// do, is let in when there is room.
  void look();
  /// Becomes readable when look() has something to do.
  int descriptor();
  /// Notes that a message of this connection was read, `bytes` long. From then on a publisher's connection gets all
  /// that is published. user: owner of its key; empty: the socket has no keys.
  void spoke(int fd, uint64_t bytes, std::string_view user = {});
  /// Hangs up on TCP connections with more unread bytes than Options::most_unread: many large messages that wait, or
  /// parts of an endless one, which ZeroMQ keeps without limit. To be called often, since bytes come meanwhile. Returns
  /// true if any connection is open.
  bool hang_up_on_unread();
  /// Hangs up on this one, if it is still there.
  void hang_up_on(int fd);
  /// Hangs up on connections whose key is not in `users`. To ZeroMQ's thread it looks as if the other side had ended
  /// them. Returns their users.
  std::vector<std::string> keep_only(const std::set<std::string>& users);
  /// Adds `bytes` to the bytes published for all connections that spoke.
  void published(uint64_t bytes);
  /// Hangs up on TCP connections with more than `bytes` published but not acknowledged by their machines. Looks at most
  /// every 100 ms. Returns the number of them.
  size_t hang_up_on_late(uint64_t bytes);
  Counts counts();

  /// Calls look(); to be called before a loop that reads all messages.
  void begin_reading();
  /// To be called when no message is left: all messages of connections that had ended by begin_reading() were read.
  /// Returns how many of these connections brought no message.
  uint64_t judge();

 private:
  struct Connection {
    int fd = -1;
    uint64_t number = 0;  // in the order of their acceptance
    double accepted_s = 0;
    bool has_spoken = false, refused = false;
    uint64_t published = 0,
             taken = 0;  // bytes published, and acknowledged by its machine, when it spoke first
    uint64_t read = 0;   // bytes of it that were read
    std::string user;    // spoke()
  };
  enum class End { kReadsOn, kAtOnce };   // its bytes on the way are read; are not read
  using Name = std::pair<int, uint64_t>;  // file descriptor, and number: descriptors are used again
  void drain();
  void take(const Monitor::Event& event, double now_s);
  void ended(int fd);
  bool is_open(const Name& name) const;
  bool may_shake_hands(const Name& name, double now_s) const;
  void keep_to_limit();
  void hang_up_on_one();
  void hang_up(const Name& name);
  bool shut_down(const Name& name, End end = End::kReadsOn);
  void refuse(const Name& name, const std::string& why, End end);
  bool looks_at(int fd);
  void look_away();
  uint64_t silent_among(const std::vector<Connection>& gone);

  const Options options_;
  Monitor monitor_;
  const int blank_, spare_;  // descriptors: an empty one; one that duplicates others, even when no more can be opened
  std::mutex mutex_;         // guards all members below
  std::unordered_map<int, Connection> open_;  // by file descriptor
  std::deque<Name> young_;                    // connections that may still be shaking hands
  std::vector<Connection> ended_, to_judge_;  // since begin_reading(); before it
  size_t refused_open_ = 0;                   // connections in open_ that were hung up on, but have not ended yet
  size_t failed_unseen_ = 0;                  // failed handshakes whose connection's end was not reported yet
  bool broke_off_ = false;                    // the last event reported a handshake that broke off
  uint64_t accepted_ = 0, published_ = 0;
  double looked_for_late_s_ = -1e300;
  Counts counts_;
  log::RateLimiter limiter_;
};

// A thread that watches the connections of all binding sockets of a context, even when their owners are busy.
// Private to this library.

class Lookout {
 public:
  /// Starts the thread.
  Lookout();
  ~Lookout();

  /// From now on calls connections.look() after each event, and hang_up_on_unread() often.
  void add(Connections& connections);
  /// When this returns, the thread does not call `connections` any more.
  void remove(Connections& connections);

 private:
  void loop();
  void wake() const;

  const int woken_;
  std::mutex mutex_;                               // guards all members below
  std::unordered_map<Connections*, int> watched_;  // with their descriptors to poll
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace telesplat::net
