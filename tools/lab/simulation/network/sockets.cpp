// Sockets of a simulated network: what each kind does with a message, and net::ReadAhead's part.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "common/core/check.h"
#include "common/core/log.h"
#include "common/net/keys/roles.h"
#include "tools/lab/simulation/network/state.h"

namespace telesplat::simulation {

using NetworkState = SimulatedNetwork::State;

namespace {

constexpr size_t kMaxTypeBytes = 64;   // as in common/net/zeromq.cpp
constexpr double kDuePeriod_s = 0.1;   // as in common/net/read_ahead.cpp
constexpr double kLatePeriod_s = 0.1;  // as in common/net/connections/connections.cpp
constexpr int kBrokenOff = 3;          // as in common/net/zeromq.cpp
constexpr net::ReadAhead::Limits kAhead;

bool is_full(const SimulatedSocket& s) {
  return s.received.size() >= kAhead.messages || s.received_bytes >= kAhead.bytes;
}

}  // namespace

std::shared_ptr<SimulatedSocket> NetworkState::shared(const SimulatedSocket& s) const {
  return *std::ranges::find(sockets, &s, &std::shared_ptr<SimulatedSocket>::get);
}

Parcel NetworkState::made(SimulatedSocket& s, std::string_view type, std::string body) {
  Parcel out{.from = s.self,
             .type = std::string(type),
             .body = std::make_shared<const std::string>(std::move(body)),
             .sent_s = now_s + (owner.ahead_s ? owner.ahead_s() : 0)};
  ++messages;
  passed(Passed::What::kSent, out, -1);
  return out;
}

void NetworkState::refuse(const SimulatedSocket& s, std::string_view type) {
  if (!owner.on_passed) return;
  passed(Passed::What::kDropped,
         {.from = s.self, .type = std::string(type), .body = std::make_shared<const std::string>(), .sent_s = now_s},
         -1);
}

bool NetworkState::send(SimulatedSocket& s, std::string_view peer, std::string_view type, uint64_t bytes,
                        const std::function<std::string()>& make) {
  if (s.dead || s.closing) return false;
  const auto parcel = [&] { return made(s, type, make()); };
  bool sent = false;
  if (s.options.read_ahead) {
    start_reading(s);
    sent = s.unsent.size() < size_t(s.options.high_water_mark);
    if (sent) s.unsent.push_back(parcel()), send_unsent(s);
    sent = sent && !s.dead;
  } else if (s.self->kind == net::Kind::kPub) {
    sent = publish(s, type, bytes, parcel);
  } else if (s.self->kind == net::Kind::kRouter) {
    sent = route(s, peer, type, bytes, parcel);
  } else {
    sent = offer(s, parcel);
  }
  if (!sent) refuse(s, type);
  return sent;
}

// Gives the message to the next connection that has room.
bool NetworkState::offer(SimulatedSocket& s, const std::function<Parcel()>& make) {
  for (size_t n = 0; n < s.ends.size(); ++n) {
    const size_t i = (s.next_out + n) % s.ends.size();
    End& e = *s.ends[i];
    if (e.gone || e.out.full()) continue;
    Parcel p = make();
    if (s.dead) return false;  // on_passed killed it
    e.out.push(std::move(p));
    s.next_out = i + 1;
    push_out(e);
    return true;
  }
  return false;
}

bool NetworkState::route(SimulatedSocket& s, std::string_view peer, std::string_view type, uint64_t bytes,
                         const std::function<Parcel()>& make) {
  if (!s.queued.has_room(peer, bytes)) {
    ++s.queue_refused;
    if (s.limiter.allow(now_s))
      log::warn("{}: dropped message '{}': {} bytes wait for its peer already", s.self->name, type, s.queued.of(peer));
    return false;
  }
  const auto found = std::ranges::find_if(s.ends, [&](const auto& e) { return !e->gone && e->peer == peer; });
  if (found == s.ends.end() || (*found)->out.full()) return false;
  Parcel p = make();
  if (s.dead) return false;
  p.ticket = std::make_shared<net::QueuedBytes::Ticket>(s.queued.add(peer, p.body->size()));
  (*found)->out.push(std::move(p));
  push_out(**found);
  return true;
}

bool NetworkState::publish(SimulatedSocket& s, std::string_view type, uint64_t bytes,
                           const std::function<Parcel()>& make) {
  for (const auto& e : s.ends)
    if (e->up) e->published += type.size() + bytes + 4;
  if (!s.queued.has_room({}, bytes) && now_s - s.looked_for_late_s >= kLatePeriod_s) {
    s.looked_for_late_s = now_s;
    for (const auto& e : s.ends) {
      if (!e->up || e->published <= e->taken + s.options.most_queued_bytes / 2) continue;
      ++s.queue_refused;
      lost(*e);
    }
  }
  Parcel p = make();
  if (s.dead) return false;
  p.ticket = std::make_shared<net::QueuedBytes::Ticket>(s.queued.add({}, p.body->size()));
  for (const auto& e : s.ends) {
    if (!e->up) continue;
    if (e->out.full()) {
      passed(Passed::What::kDropped, p, e->wire->process[0]);
    } else {
      e->out.push(p);
      push_out(*e);
    }
  }
  return true;
}

void NetworkState::send_unsent(SimulatedSocket& s) {
  while (!s.unsent.empty() && !frozen(s) && offer(s, [&] { return std::exchange(s.unsent.front(), {}); }))
    s.unsent.pop_front();
}

std::optional<net::Message> NetworkState::receive(SimulatedSocket& s) {
  if (s.dead || s.closing || s.self->kind == net::Kind::kPub) return std::nullopt;
  if (!s.options.read_ahead) return take(s);
  start_reading(s);
  if (s.received.empty()) return std::nullopt;
  net::Message out = std::move(s.received.front());
  s.received.pop_front();
  s.received_bytes -= out.body.size();
  read_ahead(s);
  return out;
}

bool NetworkState::readable(SimulatedSocket& s) {
  if (s.dead || s.closing || s.self->kind == net::Kind::kPub) return false;
  if (s.options.read_ahead) {
    start_reading(s);
    return !s.received.empty();
  }
  return std::ranges::any_of(s.ends, [](const auto& e) { return !e->in.empty(); });
}

// Takes one message of each connection in turn.
std::optional<net::Message> NetworkState::take(SimulatedSocket& s) {
  for (size_t n = 0; n < s.ends.size();) {
    const size_t i = (s.next_in + n) % s.ends.size();
    const auto e = s.ends[i];
    if (e->in.empty()) {
      ++n;
      continue;
    }
    s.next_in = i + 1, n = 0;
    const Parcel p = e->in.pop();
    e->spoken = true;
    const auto& clock = processes[s.self->process].options.clock;
    net::Message out{.peer = e->peer,
                     .type = p.type.substr(0, kMaxTypeBytes),
                     .body = {reinterpret_cast<const std::byte*>(p.body->data()), p.body->size()},
                     .owner = p.body,
                     .arrived_s = clock ? clock(now_s) : now_s};
    if (s.self->kind != net::Kind::kRouter) out.peer.clear();
    if (e->key) out.user = e->key->user, out.role = e->key->role;
    take_in(*e);
    if (e->key && !net::may_send(e->key->role, s.serves, out.type))
      reject(s, out, fmt::format("not allowed: the key {} is {}'s", out.user, net::described(e->key->role)));
    else if (p.body->size() > s.options.max_message_bytes)
      reject(s, out, fmt::format("{} bytes, limit {}", p.body->size(), s.options.max_message_bytes));
    else
      return out;
  }
  return std::nullopt;
}

void NetworkState::reject(SimulatedSocket& s, const net::Message& message, const std::string& why) {
  ++s.rejected;
  if (owner.on_rejected) owner.on_rejected(s.self->process, s.self->name, message, why);
  if (s.limiter.allow(now_s)) log::warn("{}: dropped message '{}': {}", s.self->name, message.type, why);
}

void NetworkState::read_ahead(SimulatedSocket& s) {
  if (!s.reads || frozen(s) || std::exchange(s.reading_ahead, true)) return;
  while (!is_full(s)) {
    auto message = take(s);
    if (!message) break;
    s.received_bytes += message->body.size();
    s.received.push_back(std::move(*message));
  }
  s.reading_ahead = false;
}

void NetworkState::start_reading(SimulatedSocket& s) {
  if (std::exchange(s.reads, true)) return;
  read_ahead(s);
  if (s.due) at(now_s, s.self->process, [this, socket = std::weak_ptr(shared(s))] { ask_due(socket); });
}

void NetworkState::ask_due(const std::weak_ptr<SimulatedSocket>& socket) {
  const auto s = socket.lock();
  if (!s || s->closing) return;
  const auto ask = [&] {
    if (auto due = s->due()) send(*s, {}, due->first, due->second.size(), [&] { return std::move(due->second); });
  };
  const auto& run = processes[s->self->process].options.run;
  run ? run(ask) : ask();
  at(now_s + kDuePeriod_s, s->self->process, [this, socket] { ask_due(socket); });
}

namespace {

class SimulatedCarrier final : public net::Carrier {
 public:
  SimulatedCarrier(NetworkState& state, std::shared_ptr<SimulatedSocket> socket)
      : state_(state), s_(std::move(socket)) {
    state_.sockets.push_back(s_);
  }
  ~SimulatedCarrier() override { state_.close(*s_); }

  Result<std::string> bind(const std::string& endpoint, bool) override { return state_.bind(*s_, endpoint); }
  Status connect(const std::string& endpoint) override {
    state_.connect(*s_, endpoint);
    return ok_status();
  }
  bool send(std::string_view peer, std::string_view type, uint64_t bytes,
            const std::function<std::string()>& make) override {
    return state_.send(*s_, peer, type, bytes, make);
  }
  void set_due(net::Socket::Due due) override {
    CHECK(s_->options.read_ahead && !s_->reads);
    s_->due = std::move(due);
  }
  std::optional<net::Message> receive() override { return state_.receive(*s_); }
  std::optional<bool> readable() override { return state_.readable(*s_); }
  void reject(const net::Message& message, const std::string& why) override { state_.reject(*s_, message, why); }

  uint64_t rejected() override { return s_->rejected; }
  uint64_t failed_connections() override { return s_->options.watch_connecting ? s_->failed_connections : 0; }
  uint64_t keys_refused() override { return s_->keys_refused; }
  uint64_t connections_refused() override { return s_->connections_refused; }
  uint64_t queued_bytes(std::string_view peer) override { return s_->queued.of(peer); }
  uint64_t queue_refused() override { return s_->queue_refused; }
  net::Socket::Refusal refusal() override {
    if (!s_->options.watch_connecting) return {};
    if (!s_->refused.empty()) return {.text = s_->refused};
    if (s_->broken_off < kBrokenOff) return {};
    return {.text = "it breaks off connections, as one that has as many as it takes (--max-connections)",
            .may_pass = true};
  }
  bool in_touch() override { return s_->options.watch_connecting && s_->in_touch; }
  /// Says yes, because otherwise MasterLink starts a thread that looks for the host (net::HostSearch).
  bool tunnelled() override { return true; }
  const std::string& name() const override { return s_->self->name; }
  bool reads_ahead() const override { return s_->options.read_ahead; }

 private:
  NetworkState& state_;
  const std::shared_ptr<SimulatedSocket> s_;
};

struct ProcessNetwork final : net::Network {
  ProcessNetwork(NetworkState& state, int process) : state(state), process(process) {}
  std::unique_ptr<net::Carrier> open(net::Kind kind, std::string name, const net::SocketOptions& options) override {
    auto self = std::make_shared<const Sender>(Sender{process, kind, std::move(name)});
    return std::make_unique<SimulatedCarrier>(
        state, std::shared_ptr<SimulatedSocket>(new SimulatedSocket{
                   .self = std::move(self), .options = options, .serves = std::string(options.serves)}));
  }
  NetworkState& state;
  const int process;
};

}  // namespace

std::unique_ptr<net::Network> SimulatedNetwork::attach(int process, ProcessOptions options) {
  state_->processes[process].options = std::move(options);
  return std::make_unique<ProcessNetwork>(*state_, process);
}

}  // namespace telesplat::simulation
