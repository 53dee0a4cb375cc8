#include "tools/lab/simulation/network/network.h"

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>

#include "common/core/check.h"
#include "tools/lab/simulation/network/state.h"

namespace telesplat::simulation {

using NetworkState = SimulatedNetwork::State;

namespace {

std::pair<int, int> pair_of(int a, int b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

NetworkState::State(SimulatedNetwork& owner, uint64_t seed) : owner(owner), random_(seed) {}

// SplitMix64: G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
double NetworkState::draw() {
  uint64_t z = random_ += 0x9e3779b97f4a7c15u;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
  z ^= z >> 31;
  return double(z >> 11) * 0x1p-53;
}

const LinkOptions& NetworkState::link(int from, int to) const {
  const auto own = own_links.find({from, to});
  return own != own_links.end() ? own->second : links;
}

bool NetworkState::frozen(const SimulatedSocket& s) {
  const ProcessState& p = processes[s.self->process];
  return p.stopped || p.crashed;
}

void NetworkState::at(double when_s, int process, Action action) {
  events.emplace(std::pair(std::max(when_s, now_s), numbers_++), Event{process, std::move(action)});
}

void NetworkState::run_next() {
  const Event event = std::move(events.begin()->second);
  now_s = events.begin()->first.first;
  events.erase(events.begin());
  if (event.process >= 0) {
    ProcessState& p = processes[event.process];
    if (p.crashed) return;
    if (p.stopped) return p.held.push_back(event.action);
  }
  event.action();
}

bool NetworkState::is_silent(int a, int b) const {
  const auto found = silences_.find(pair_of(a, b));
  return found != silences_.end() && found->second.until_s > now_s;
}

void NetworkState::on_wire(const std::shared_ptr<Wire>& wire, int side, double when_s, Action action) {
  at(when_s, -1, [this, wire, side, action = std::move(action)] {
    const int from = wire->process[1 - side], to = wire->process[side];
    if (!is_silent(from, to)) return action();
    on_wire(wire, side, silences_[pair_of(from, to)].until_s + link(from, to).latency_s, action);
  });
}

void NetworkState::crash(int process) {
  ProcessState& p = processes[process];
  p.crashed = true;
  p.held.clear();
  std::erase_if(bound_, [&](const auto& b) { return b.second->self->process == process; });
  for (const auto& s : sockets) {
    if (s->self->process != process) continue;
    s->dead = true;
    for (const auto& e : s->ends) close_end(*e);
    s->received.clear();
    for (const Parcel& parcel : std::exchange(s->unsent, {})) passed(Passed::What::kDropped, parcel, -1);
  }
}

void NetworkState::go_on(int process) {
  ProcessState& p = processes[process];
  p.stopped = false;
  for (Action& action : std::exchange(p.held, {})) at(now_s, process, std::move(action));
  for (size_t i = 0; i < sockets.size(); ++i) {
    if (sockets[i]->self->process != process) continue;
    for (const auto& e : std::vector(sockets[i]->ends)) {
      take_in(*e);
      go_on_sending(*e);
    }
    read_ahead(*sockets[i]);
  }
}

void NetworkState::break_connections(int a, int b) {
  for (const auto& s : sockets) {
    if (s->self->process != a && s->self->process != b) continue;
    for (const auto& e : std::vector(s->ends)) {
      const auto wire = e->wire;
      if (!wire || e->side != 0 || pair_of(a, b) != pair_of(wire->process[0], wire->process[1])) continue;
      for (Way& way : wire->ways) {
        for (const Parcel& p : std::exchange(way.flying, {})) passed(Passed::What::kDropped, p, -1);
        way.last_s = now_s;
      }
      finish(wire, 0);
      finish(wire, 1);
    }
  }
}

void NetworkState::silence(int a, int b, double for_s) {
  Silence& silence = silences_[pair_of(a, b)];
  if (silence.until_s <= now_s) silence.since_s = now_s;
  silence.until_s = std::max(silence.until_s, now_s + for_s);
  for (const auto& s : sockets) {
    for (const auto& e : s->ends) {
      if (!e->wire || pair_of(a, b) != pair_of(e->wire->process[0], e->wire->process[1])) continue;
      at(silence.since_s + s->options.patience_s, -1,
         [this, wire = e->wire, side = e->side, key = pair_of(a, b), since_s = silence.since_s] {
           const Silence& now = silences_[key];
           if (now.since_s != since_s || now.until_s <= now_s || !wire->ends[side]) return;
           wire->ways[1 - side].finished = true;
           take_in(*wire->ends[side]);
         });
    }
  }
}

void NetworkState::forget_closed() {
  std::erase_if(sockets, [](const auto& s) {
    return s->dead || (s->closing && std::ranges::all_of(s->ends, [](const auto& e) { return e->gone; }));
  });
}

void NetworkState::passed(Passed::What what, const Parcel& p, int to) {
  if (!owner.on_passed) return;
  owner.on_passed({.what = what,
                   .sent_s = p.sent_s,
                   .now_s = now_s,
                   .from = p.from->process,
                   .to = to,
                   .kind = p.from->kind,
                   .socket = p.from->name,
                   .type = p.type,
                   .body = {reinterpret_cast<const std::byte*>(p.body->data()), p.body->size()}});
}

SimulatedNetwork::SimulatedNetwork(uint64_t seed) : state_(std::make_unique<State>(*this, seed)) {}

SimulatedNetwork::~SimulatedNetwork() = default;

void SimulatedNetwork::set_links(const LinkOptions& options) { state_->links = options; }
void SimulatedNetwork::set_link(int from, int to, const LinkOptions& options) {
  state_->own_links[{from, to}] = options;
}

double SimulatedNetwork::now_s() const { return state_->now_s; }

double SimulatedNetwork::next_s() const {
  return state_->events.empty() ? std::numeric_limits<double>::infinity() : state_->events.begin()->first.first;
}

void SimulatedNetwork::advance(double now_s) {
  CHECK(now_s >= state_->now_s);
  while (next_s() <= now_s) state_->run_next();
  state_->now_s = now_s;
  state_->forget_closed();
}

void SimulatedNetwork::crash(int process) { state_->crash(process); }
void SimulatedNetwork::stop(int process) { state_->processes[process].stopped = true; }
void SimulatedNetwork::go_on(int process) { state_->go_on(process); }
void SimulatedNetwork::break_connections(int a, int b) { state_->break_connections(a, b); }
void SimulatedNetwork::silence(int a, int b, double for_s) { state_->silence(a, b, for_s); }
uint64_t SimulatedNetwork::messages() const { return state_->messages; }

}  // namespace telesplat::simulation
