// The connections of a socket that binds: who came and went, who never said anything, and how many there may be.
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

/// A connection that has not said who it is by then is dropped.
inline constexpr double kHandshake_s = 5;

/// All calls but judge() and begin_reading() may come from any thread.
class Connections {
 public:
  struct Options {
    std::string name;                     ///< of the socket, for the log
    size_t most = 1024;                   ///< open at a time; further ones are hung up on
    uint64_t most_unread = ~uint64_t(0);  ///< bytes of one that came and were not read; one with more is hung up on
    bool guarded = false;                 ///< handshakes that fail are of those who show no key that fits
    bool publishes = false;
    double quiet_s = 1e30;  ///< who came longer ago and said nothing is no stranger: there was nothing to say
  };
  struct Counts {
    size_t open = 0;
    uint64_t refused = 0;       ///< beyond `most`, most_unread, or because of what they said
    uint64_t keys_refused = 0;  ///< failed handshakes
    uint64_t silent = 0;        ///< ended without having brought one whole message, and were judged
  };

  /// To be made before `socket` binds, which must outlive it.
  Connections(zmq::context_t& context, zmq::socket_t& socket, Options options);
  ~Connections();

  /// Learns what has happened, and hangs up on those who are too many. A peer that comes back later, as ZeroMQ's do, is
  /// let in when there is room.
  void look();
  /// Becomes readable when look() has something to do.
  int descriptor();
  /// A message of this connection was read, which took `bytes` of it. Of a publisher: from now on it gets what is
  /// published. user: whose key it came by; empty: there are no keys.
  void spoke(int fd, uint64_t bytes, std::string_view user = {});
  /// Hangs up on one of whom more came than Options::most_unread allows and was not read yet: many large messages that
  /// nobody has read, or parts of one that does not end, which ZeroMQ keeps without limit. Over TCP. To be called often
  /// against what comes meanwhile. Returns whether anybody is there to be looked at.
  bool hang_up_on_unread();
  /// Hangs up on this one, if it is still there.
  void hang_up_on(int fd);
  /// Hangs up on those who came by other keys. ZeroMQ's thread hears of it as if the other side had ended them. Returns
  /// whose they were.
  std::vector<std::string> keep_only(const std::set<std::string>& users);
  /// So many bytes more go to all who spoke.
  void published(uint64_t bytes);
  /// Hangs up on those who have not taken more than `bytes` of what was published for them, as their machines tell us,
  /// over TCP. At most every 100 ms. Returns on how many.
  size_t hang_up_on_late(uint64_t bytes);
  Counts counts();

  /// look(); to be called before messages are read until there is none.
  void begin_reading();
  /// There was none any more: those that had ended by begin_reading() have brought whatever they brought. How many of
  /// them brought nothing.
  uint64_t judge();

 private:
  struct Connection {
    int fd = -1;
    uint64_t number = 0;  // in the order in which they came
    double accepted_s = 0;
    bool has_spoken = false, refused = false;
    uint64_t published = 0,
             taken = 0;  // bytes that were published, and that its machine had taken, when it spoke first
    uint64_t read = 0;   // bytes of it that were read
    std::string user;    // spoke()
  };
  enum class End { kReadsOn, kAtOnce };   // what it has sent is read; is not
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
  const int blank_, spare_;  // descriptors: of nothing; one to look at others with, however few are left
  std::mutex mutex_;         // guards what follows
  std::unordered_map<int, Connection> open_;  // by file descriptor
  std::deque<Name> young_;                    // that may not have shaken hands yet
  std::vector<Connection> ended_, to_judge_;  // since begin_reading(); before
  size_t refused_open_ = 0;                   // of open_: hung up on, but not gone yet
  size_t failed_unseen_ = 0;                  // handshakes whose connection's end was not heard of yet
  bool broke_off_ = false;                    // the event before was of a handshake that broke off
  uint64_t accepted_ = 0, published_ = 0;
  double looked_for_late_s_ = -1e300;
  Counts counts_;
  log::RateLimiter limiter_;
};

// A thread that looks after the connections of all sockets of a context that bind, however busy their owners are.
// Private to this library.

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
