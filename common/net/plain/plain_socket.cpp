#include "common/net/plain/plain_socket.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <vector>
#include <zmq.hpp>

#include "common/net/connections/monitor.h"
#include "common/net/local_endpoint.h"

namespace telesplat::net {
namespace {

constexpr int64_t kListenerBytes = 4096;  // largest frame a publisher reads; handshakes fit

void set_common(zmq::socket_t& socket, const PlainLimits& limits, int64_t most_bytes) {
  socket.set(zmq::sockopt::sndhwm, limits.queued);
  socket.set(zmq::sockopt::rcvhwm, limits.queued);
  socket.set(zmq::sockopt::maxmsgsize, most_bytes);
  socket.set(zmq::sockopt::linger, 0);
  socket.set(zmq::sockopt::reconnect_ivl, 50);
  socket.set(zmq::sockopt::reconnect_ivl_max, 500);
  look_after(socket, 10);
}

}  // namespace

struct PlainSubscriber::Impl {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::sub};
  std::string endpoint;
};

PlainSubscriber::PlainSubscriber(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PlainSubscriber::~PlainSubscriber() = default;

Result<std::unique_ptr<PlainSubscriber>> PlainSubscriber::connect(const std::string& endpoint,
                                                                  const PlainLimits& limits) {
  auto impl = std::make_unique<Impl>();
  try {
    set_common(impl->socket, limits, limits.most_bytes);
    impl->socket.set(zmq::sockopt::subscribe, "");
    if (is_ipv6(endpoint)) impl->socket.set(zmq::sockopt::ipv6, 1);
    impl->socket.connect(endpoint);
    impl->endpoint = endpoint;
  } catch (const zmq::error_t& e) {
    return Error{fmt::format("cannot connect to {}: {}", endpoint, e.what())};
  }
  return std::unique_ptr<PlainSubscriber>(new PlainSubscriber(std::move(impl)));
}

bool PlainSubscriber::wait(int timeout_ms) {
  std::vector<zmq::pollitem_t> items{{impl_->socket.handle(), 0, ZMQ_POLLIN, 0}};
  try {
    return zmq::poll(items, std::chrono::milliseconds(timeout_ms)) > 0;
  } catch (const zmq::error_t&) {  // EINTR: a signal; the caller looks at its stop flag
    return false;
  }
}

void PlainSubscriber::connect_again() {
  try {
    impl_->socket.disconnect(impl_->endpoint);
  } catch (const zmq::error_t&) {  // ENOENT: the connection is gone already
  }
  try {
    impl_->socket.connect(impl_->endpoint);
  } catch (const zmq::error_t&) {  // EINTR, or no more sockets: tried again at the next call
  }
}

std::optional<std::string> PlainSubscriber::receive() {
  try {
    zmq::message_t frame;
    do {
      if (!impl_->socket.recv(frame, zmq::recv_flags::dontwait)) return std::nullopt;
    } while (frame.more());
    return frame.to_string();
  } catch (const zmq::error_t&) {  // EINTR
    return std::nullopt;
  }
}

struct PlainPublisher::Impl {
  zmq::context_t context{1};
  zmq::socket_t socket{context, zmq::socket_type::xpub};  // shows subscriptions
  std::string endpoint;
  int subscriptions = 0;
};

PlainPublisher::PlainPublisher(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
PlainPublisher::~PlainPublisher() = default;

Result<std::unique_ptr<PlainPublisher>> PlainPublisher::bind(const std::string& endpoint, bool insecure,
                                                             const PlainLimits& limits) {
  if (!insecure && !is_local(endpoint))
    return Error{fmt::format("{} is not a loopback or ipc address; others need --insecure", endpoint)};
  auto impl = std::make_unique<Impl>();
  try {
    set_common(impl->socket, limits, kListenerBytes);
    impl->socket.set(zmq::sockopt::xpub_verboser, 1);
    if (is_ipv6(endpoint)) impl->socket.set(zmq::sockopt::ipv6, 1);
    impl->socket.bind(numeric_host(endpoint));
    impl->endpoint = impl->socket.get(zmq::sockopt::last_endpoint);
  } catch (const zmq::error_t& e) {
    return Error{fmt::format("cannot bind to {}: {}", endpoint, e.what())};
  }
  return std::unique_ptr<PlainPublisher>(new PlainPublisher(std::move(impl)));
}

const std::string& PlainPublisher::endpoint() const { return impl_->endpoint; }

bool PlainPublisher::heard() {
  try {
    // Reads a limited number, so that a flood of subscriptions does not hold up the publisher.
    zmq::message_t message;
    for (int i = 0; i < 100 && impl_->socket.recv(message, zmq::recv_flags::dontwait); ++i)
      if (message.size() > 0) impl_->subscriptions += *static_cast<const char*>(message.data()) == 1 ? 1 : -1;
  } catch (const zmq::error_t&) {  // EINTR
  }
  impl_->subscriptions = std::max(impl_->subscriptions, 0);
  return impl_->subscriptions > 0;
}

void PlainPublisher::send(const std::string& body) {
  try {
    static_cast<void>(impl_->socket.send(zmq::buffer(body), zmq::send_flags::dontwait));
  } catch (const zmq::error_t&) {  // EINTR: counts as lost
  }
}

}  // namespace telesplat::net
