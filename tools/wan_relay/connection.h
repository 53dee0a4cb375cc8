// One connection through the link, which delays each side's bytes, and its end of stream, on the way to the other.
#pragma once

#include <boost/asio/ip/tcp.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/wan_relay/way.h"

namespace telesplat::wan_relay {

using Tcp = boost::asio::ip::tcp;

/// One direction of a connection.
class Flow : public Sender, public std::enable_shared_from_this<Flow> {
 public:
  /// window: most bytes on their way, from the reading to the writing end; a full window stops reading, so that the
  /// sender feels it. ended: called when all bytes and the end have passed, or the receiving side is gone.
  Flow(Context& context, Tcp::socket& from, Tcp::socket& to, Way& way, size_t window, std::function<void()> ended);

  void start() { read(); }
  void stop();
  void send_piece() override;

 private:
  struct Piece {
    double due_s;
    std::string bytes;  // empty: the end of the stream
  };
  void read();
  void put(std::string bytes);
  void write();
  void written(const boost::system::error_code& error, size_t bytes);
  void finish();

  Tcp::socket& from_;
  Tcp::socket& to_;
  Way& way_;
  const size_t window_;
  std::function<void()> ended_;
  Timer due_;
  std::deque<Piece> line_;
  std::vector<std::string> writing_;
  size_t held_ = 0;  // bytes read and not written
  bool reading_ = false, timing_ = false, at_end_ = false, over_ = false;
};

/// Both directions, from the side that asked for the connection (near) to its target (far).
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  struct Link {
    Way& to_far;
    Way& to_near;
    const links::Link& link;
  };
  Connection(Context& context, Tcp::socket near, Link link, std::function<void()> gone);
  ~Connection();

  /// Connects to `to`, a round trip after now, and passes bytes on. told: takes the outcome, and returns an answer for
  /// the near side, sent before other bytes; null: no answer.
  void connect(const Tcp::endpoint& to, std::function<std::string(const boost::system::error_code&)> told);
  Tcp::socket& near() { return near_; }
  void close();

 private:
  void connected(const boost::system::error_code& error);
  void begin();

  Context& context_;
  Tcp::socket near_, far_;
  Link link_;
  std::function<void()> gone_;
  std::function<std::string(const boost::system::error_code&)> told_;
  Timer patience_;
  std::shared_ptr<Flow> to_far_, to_near_;
  int open_ = 0;  // number of flows
};

/// A sender fills the buffers of a real network path no further than a few round trips need; those of a loopback device
/// hold megabytes, a second of a slow link. This makes pieces and receive buffers as large as on the network. Call it
/// before a socket listens or connects.
template <class Socket>
void size_as_on_network(Socket& socket, const links::Link& link);

}  // namespace telesplat::wan_relay
