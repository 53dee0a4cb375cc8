#include "common/net/socket.h"

#include <utility>

#include "common/core/check.h"
#include "common/core/machine.h"
#include "common/net/carrier.h"

namespace telesplat::net {

Context::Context(Access access) : network_(make_zeromq(std::move(access))) {}
Context::Context(std::unique_ptr<Network> network) : network_(std::move(network)) {}
Context::~Context() = default;

Socket::Socket(Context& context, Kind kind, std::string name, const SocketOptions& options)
    : carrier_(context.network().open(kind, std::move(name), options)) {}
Socket::~Socket() = default;
Socket::Socket(Socket&&) noexcept = default;
Socket& Socket::operator=(Socket&&) noexcept = default;

Result<std::string> Socket::bind(const std::string& endpoint, bool insecure) {
  return carrier_->bind(endpoint, insecure);
}
Status Socket::connect(const std::string& endpoint) { return carrier_->connect(endpoint); }

bool Socket::send_frames(std::string_view peer, std::string_view type, std::string body) {
  return carrier_->send(peer, type, body.size(), [&] { return std::move(body); });
}
bool Socket::send_made(std::string_view peer, std::string_view type, uint64_t bytes,
                       const std::function<std::string()>& encoded) {
  CHECK(!carrier_->reads_ahead());
  return carrier_->send(peer, type, bytes, encoded);
}

void Socket::set_due(Due due) { carrier_->set_due(std::move(due)); }
std::optional<Message> Socket::receive() { return carrier_->receive(); }
void Socket::reject(const Message& message, const std::string& why) { carrier_->reject(message, why); }

uint64_t Socket::rejected() const { return carrier_->rejected(); }
uint64_t Socket::failed_connections() const { return carrier_->failed_connections(); }
uint64_t Socket::keys_refused() const { return carrier_->keys_refused(); }
uint64_t Socket::connections_refused() const { return carrier_->connections_refused(); }
uint64_t Socket::queued_bytes(std::string_view peer) const { return carrier_->queued_bytes(peer); }
uint64_t Socket::queue_refused() const { return carrier_->queue_refused(); }
Socket::Refusal Socket::refusal() const { return carrier_->refusal(); }
bool Socket::in_touch() const { return carrier_->in_touch(); }
bool Socket::tunnelled() const { return carrier_->tunnelled(); }
const std::string& Socket::name() const { return carrier_->name(); }

InstanceId make_instance_id() {
  // 53 bits, so that ids survive tools that read numbers as doubles.
  return {(random_bits() & ((uint64_t{1} << 53) - 1)) | 1};
}

}  // namespace telesplat::net
