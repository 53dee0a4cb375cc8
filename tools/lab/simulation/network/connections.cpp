// Connections of a simulated network: how they come to be and end, and how messages get from one end to the other.
#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "common/core/check.h"
#include "common/net/keys/roles.h"
#include "tools/lab/simulation/network/state.h"

namespace telesplat::simulation {

using NetworkState = SimulatedNetwork::State;

namespace {

constexpr double kMostReconnect_s = 0.5;  // ZMQ_RECONNECT_IVL_MAX
constexpr double kSynAgain_s = 1;         // TCP asks for a connection again, where nothing answers
constexpr double kStoppedAgain_s = 0.05;
constexpr uint64_t kOversizedBytes = 16u << 20;                  // as in common/net/zeromq.cpp
constexpr uint64_t kUnreadBytes = (8u << 20) + kOversizedBytes;  // likewise, beside one message
constexpr double kQuietPusher_s = 1;                             // likewise

// Addresses of one port are one: all is on one machine.
std::string place_of(const std::string& endpoint) {
  return endpoint.starts_with("tcp://") ? endpoint.substr(endpoint.rfind(':')) : endpoint;
}

}  // namespace

Result<std::string> NetworkState::bind(SimulatedSocket& s, const std::string& endpoint) {
  CHECK(s.self->kind != net::Kind::kSub);
  std::string out = endpoint;
  if (out.starts_with("tcp://") && out.ends_with(":*")) out.replace(out.size() - 1, 1, std::to_string(ports_++));
  if (!bound_.try_emplace(place_of(out), &s).second)
    return Error{fmt::format("{}: cannot bind to {}: Address already in use", s.self->name, endpoint)};
  return out;
}

void NetworkState::connect(SimulatedSocket& s, const std::string& endpoint) {
  CHECK(s.self->kind != net::Kind::kPub);
  const Pipe pipe(s.options.high_water_mark);
  s.ends.push_back(std::make_shared<End>(End{.socket = s, .side = 0, .out = pipe, .in = pipe, .endpoint = endpoint}));
  at(now_s, s.self->process, [this, end = std::weak_ptr(s.ends.back())] { attempt(end); });
}

// ZeroMQ and TCP greet each other in three round trips; the side that accepts may send half of one before the other.
void NetworkState::attempt(const std::weak_ptr<End>& end) {
  const auto e = end.lock();
  if (!e || e->gone) return;
  const int from = e->socket.self->process;
  const auto found = bound_.find(place_of(e->endpoint));
  if (found == bound_.end())
    return at(now_s + 2 * links.latency_s, from, [this, end] {
      if (const auto e = end.lock()) retry(*e, false);
    });
  const int to = found->second->self->process;
  if (is_silent(from, to)) return at(now_s + kSynAgain_s, from, [this, end] { attempt(end); });
  at(now_s + 3 * link(from, to).latency_s + 2 * link(to, from).latency_s, -1, [this, end] { accept(end); });
}

// was_refused: a server is there and did not let it in.
void NetworkState::retry(End& e, bool was_refused) {
  SimulatedSocket& s = e.socket;
  if (e.gone || (s.closing && e.out.empty())) return close_end(e);
  s.in_touch = false;
  if (!was_refused) ++s.failed_connections;
  const double wait_s = e.reconnect_s + 0.05 * draw();
  e.reconnect_s = std::min(2 * e.reconnect_s, kMostReconnect_s);
  const auto found = std::ranges::find(s.ends, &e, &std::shared_ptr<End>::get);
  at(now_s + wait_s, s.self->process, [this, end = std::weak_ptr(*found)] { attempt(end); });
}

void NetworkState::accept(const std::weak_ptr<End>& end) {
  const auto e = end.lock();
  if (!e || e->gone || e->socket.dead) return;
  const int from = e->socket.self->process;
  const auto found = bound_.find(place_of(e->endpoint));
  if (found == bound_.end())
    return at(now_s, from, [this, end] {
      if (const auto e = end.lock()) retry(*e, false);
    });
  SimulatedSocket& bound = *found->second;
  const int to = bound.self->process;
  if (is_silent(from, to)) return at(now_s + kSynAgain_s, -1, [this, end] { accept(end); });
  if (frozen(bound)) return at(now_s + kStoppedAgain_s, -1, [this, end] { accept(end); });
  std::erase_if(bound.ends, [](const auto& b) { return b->gone && b->in.empty(); });
  const std::string refused = refusal(e->socket, bound);
  const uint64_t open = uint64_t(std::ranges::count(bound.ends, false, [](const auto& b) { return b->gone; }));
  const bool too_many = refused.empty() && open >= bound.options.most_connections;
  if (refused.empty() && !too_many) return shake_hands(e, bound);
  if (too_many && draw() < 0.5) {  // a server hangs up after the handshake, or before its end
    shake_hands(e, bound);
    return hang_up(*bound.ends.back());
  }
  bound.connections_refused += too_many;
  at(now_s + link(to, from).latency_s, from, [this, end, refused] {
    const auto e = end.lock();
    if (!e) return;
    ++e->socket.broken_off;
    if (!refused.empty()) e->socket.refused = refused;
    retry(*e, true);
  });
}

// Returns why the bound socket does not let it in; empty: it does.
std::string NetworkState::refusal(const SimulatedSocket& connects, SimulatedSocket& bound) {
  const auto& key = processes[connects.self->process].options.key;
  if (!processes[bound.self->process].options.key) {
    if (!key) return {};
    ++bound.rejected;
    return "it does not take this key: it has others, or none";
  }
  if (key && net::may_connect(key->role, bound.serves)) return {};
  ++bound.keys_refused;
  return key ? fmt::format("the key {} is not let in there", key->user) : "it wants a key (--keys DIR)";
}

void NetworkState::shake_hands(const std::shared_ptr<End>& end, SimulatedSocket& bound) {
  const int from = end->socket.self->process, to = bound.self->process;
  const Pipe pipe(bound.options.high_water_mark);
  const uint32_t number = ++peers_;
  std::string peer(1, '\0');
  for (int shift = 24; shift >= 0; shift -= 8) peer += char(number >> shift);
  const bool publishes = bound.self->kind == net::Kind::kPub;
  auto accepted = std::make_shared<End>(End{.socket = bound,
                                            .side = 1,
                                            .out = pipe,
                                            .in = pipe,
                                            .peer = std::move(peer),
                                            .key = processes[from].options.key,
                                            .up = !publishes,
                                            .since_s = now_s});
  const auto wire = std::make_shared<Wire>(Wire{{from, to}, {end.get(), accepted.get()}});
  end->wire = accepted->wire = wire;
  bound.ends.push_back(std::move(accepted));
  on_wire(wire, 0, now_s + link(to, from).latency_s, [this, wire, from, to, publishes] {
    at(now_s, from, [this, wire, from, to, publishes] {
      End* e = wire->ends[0];
      if (!e) return;
      e->up = true;
      e->reconnect_s = 0.05;
      e->socket.in_touch = true;
      e->socket.broken_off = 0;
      go_on_sending(*e);
      if (!publishes) return;
      on_wire(wire, 1, now_s + link(from, to).latency_s, [wire] {  // the subscription
        if (wire->ends[1]) wire->ends[1]->up = wire->ends[1]->spoken = true;
      });
    });
  });
}

void NetworkState::push_out(End& e) {
  if (!e.wire || !e.up || frozen(e.socket)) return;
  const auto wire = e.wire;
  Way& way = wire->ways[e.side];
  const int side = 1 - e.side;
  const LinkOptions& over = link(wire->process[e.side], wire->process[side]);
  while (!e.out.empty() && way.bytes < over.buffer_bytes) {
    Parcel p = e.out.pop();
    p.ticket.reset();
    way.bytes += p.bytes();
    way.free_s = std::max({now_s, p.sent_s, way.free_s}) + (over.bytes_s > 0 ? double(p.bytes()) / over.bytes_s : 0);
    way.last_s = std::max(way.last_s, way.free_s + over.latency_s + over.jitter_s * draw());
    way.flying.push_back(std::move(p));
    on_wire(wire, side, way.last_s, [this, wire, side] { arrive(*wire, side); });
  }
}

void NetworkState::go_on_sending(End& e) {
  push_out(e);
  send_unsent(e.socket);
  if (e.socket.closing && e.out.empty()) close_end(e);
}

void NetworkState::arrive(Wire& wire, int side) {
  Way& way = wire.ways[1 - side];
  if (way.flying.empty()) return;  // the connection was reset
  Parcel p = std::move(way.flying.front());
  way.flying.pop_front();
  if (End* sender = wire.ends[1 - side]) sender->taken += p.bytes();
  End* e = wire.ends[side];
  if (!e || way.finished) return passed(Passed::What::kDropped, p, wire.process[side]);
  way.arrived.push_back(std::move(p));
  take_in(*e);
}

void NetworkState::take_in(End& e) {
  const auto wire = e.wire;
  if (!wire || frozen(e.socket)) return;
  SimulatedSocket& s = e.socket;
  Way& way = wire->ways[1 - e.side];
  bool readable = false;
  while (!way.arrived.empty() && (s.closing || !e.in.full())) {
    Parcel p = std::move(way.arrived.front());
    way.arrived.pop_front();
    way.bytes -= p.bytes();
    const bool too_large = p.body->size() > s.options.max_message_bytes + kOversizedBytes;
    passed(s.closing || too_large ? Passed::What::kDropped : Passed::What::kDelivered, p, s.self->process);
    if (too_large) return lost(e);
    if (!s.closing) e.in.push(std::move(p)), readable = true;
    if (End* sender = wire->ends[1 - e.side]) go_on_sending(*sender);
  }
  if (readable) {
    read_ahead(s);
    if (owner.on_ready) owner.on_ready(s.self->process);
  }
  const uint64_t most =
      s.options.most_unread_bytes ? s.options.most_unread_bytes : s.options.max_message_bytes + kUnreadBytes;
  if (e.side == 1 && e.wire && e.in.bytes() + way.bytes > most) return hang_up(e);
  if (way.arrived.empty() && way.finished) lost(e);
}

void NetworkState::hang_up(End& e) {
  ++e.socket.connections_refused;
  e.spoken = true;  // rejected() does not count it again
  lost(e);
}

// Tells ends[side] that the other end has closed, after all that was sent.
void NetworkState::finish(const std::shared_ptr<Wire>& wire, int side) {
  if (!wire->ends[side]) return;
  const double latency_s = link(wire->process[1 - side], wire->process[side]).latency_s;
  on_wire(wire, side, std::max(wire->ways[1 - side].last_s, now_s + latency_s), [this, wire, side] {
    wire->ways[1 - side].finished = true;
    if (wire->ends[side]) take_in(*wire->ends[side]);
  });
}

void NetworkState::lost(End& e) {
  const auto wire = std::exchange(e.wire, nullptr);
  if (!wire) return;
  e.up = false;
  wire->ends[e.side] = nullptr;
  for (const Parcel& p : std::exchange(wire->ways[1 - e.side].arrived, {}))
    passed(Passed::What::kDropped, p, wire->process[e.side]);
  finish(wire, 1 - e.side);
  if (e.side == 0) return retry(e, false);
  e.gone = true;
  drop_all(e);
  const net::Kind kind = e.socket.self->kind;
  if (!e.spoken && !(kind == net::Kind::kPull && now_s - e.since_s > kQuietPusher_s)) ++e.socket.rejected;
}

void NetworkState::drop_all(End& e) {
  while (!e.out.empty()) passed(Passed::What::kDropped, e.out.pop(), e.wire ? e.wire->process[1 - e.side] : -1);
}

void NetworkState::close_end(End& e) {
  if (e.gone) return;
  e.gone = true;
  e.up = false;
  drop_all(e);
  const auto wire = std::exchange(e.wire, nullptr);
  if (!wire) return;
  wire->ends[e.side] = nullptr;
  for (const Parcel& p : std::exchange(wire->ways[1 - e.side].arrived, {}))
    passed(Passed::What::kDropped, p, wire->process[e.side]);
  finish(wire, 1 - e.side);
}

void NetworkState::close(SimulatedSocket& s) {
  std::erase_if(bound_, [&](const auto& b) { return b.second == &s; });
  if (s.dead) return;
  send_unsent(s);
  s.closing = true;
  for (const Parcel& p : std::exchange(s.unsent, {})) passed(Passed::What::kDropped, p, -1);
  s.received.clear();
  for (const auto& e : s.ends)
    if (e->out.empty() || s.options.linger_ms == 0) close_end(*e);
  at(now_s + s.options.linger_ms * 1e-3, s.self->process, [this, socket = std::weak_ptr(shared(s))] {
    const auto s = socket.lock();
    for (size_t i = 0; s && i < s->ends.size(); ++i) close_end(*s->ends[i]);
  });
}

}  // namespace telesplat::simulation
