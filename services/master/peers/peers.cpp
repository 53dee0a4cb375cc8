#include "services/master/peers/peers.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cstdlib>

#include "common/core/utf8.h"
#include "common/scene/session.h"
#include "services/master/peers/idle.h"

namespace telesplat::master {

void Namesakes::replaced(InstanceId instance, double now_s) {
  std::erase_if(replaced_, [&](const auto& r) { return now_s - r.second > kMemory_s; });
  if (replaced_.size() >= kMostKept)
    replaced_.erase(std::min_element(replaced_.begin(), replaced_.end(),
                                     [](const auto& a, const auto& b) { return a.second < b.second; }));
  replaced_[instance] = now_s;
}

bool Namesakes::lives_on(InstanceId instance, double now_s) {
  const auto found = replaced_.find(instance);
  if (found == replaced_.end()) return false;
  const bool recent = now_s - found->second <= kMemory_s;
  replaced_.erase(found);
  return recent;
}

Peer* Peers::find(const std::string& id) {
  const auto known = known_.find(id);
  return known == known_.end() ? nullptr : &known->second;
}

Peers::Known::value_type* Peers::find(InstanceId instance) {
  const auto by = instances_.find(instance);
  const auto known = by == instances_.end() ? known_.end() : known_.find(by->second);
  return known == known_.end() ? nullptr : &*known;
}

const Peer* Peers::here(const std::string& id) const {
  const auto known = known_.find(id);
  return known == known_.end() || known->second.gone ? nullptr : &known->second;
}

bool Peers::speaks_for(const std::string& id, InstanceId instance) const {
  const auto by = instances_.find(instance);
  return by != instances_.end() && by->second == id;
}

Peer& Peers::enter(const std::string& id, const wire::Hello& m, double now_s) {
  Peer& p = known_[id];
  const bool another = p.hello.instance != m.instance || p.hello.role != m.role;
  if (another) p.coupling.reset();
  if (another || p.gone) p.joined = ++joined_, p.process.replaced = false;
  if (speaks_for(id, p.hello.instance)) instances_.erase(p.hello.instance);
  instances_[m.instance] = id;
  p.hello = m;
  p.process.role = m.role;
  p.process.name = m.name;
  p.process.pid = m.pid;
  p.process.facts = m.facts;
  const std::string at_once = scene::value_or(m.facts, "leases", std::string());
  if (!at_once.empty()) p.leases_at_once = std::clamp(std::atoi(at_once.c_str()), 0, kMaxWaitingLeases);
  if (p.gone) p.reports.clear();
  p.seen_s = now_s;
  p.gone = p.refused = p.process.lost = false;
  return p;
}

bool Peers::make_room(const std::string& id, size_t most) {
  const auto before = known_.find(id);
  if (before != known_.end() && !before->second.gone) return true;
  const auto here = size_t(std::count_if(known_.begin(), known_.end(), [](const auto& p) { return !p.second.gone; }));
  if (here >= most) return false;
  if (before != known_.end() || known_.size() < here + kMostGone) return true;
  const auto departed = std::find_if(known_.begin(), known_.end(), [](const auto& p) { return p.second.gone; });
  if (departed == known_.end()) return true;
  forget(departed->second, departed->first);
  known_.erase(departed);
  return true;
}

void Peers::forget(const Peer& p, const std::string& id) {
  if (speaks_for(id, p.hello.instance)) instances_.erase(p.hello.instance);
  if (p.hello.role != "ctl") departed_.add(p.process);
}

void Peers::forget_departed(double now_s) {
  std::erase_if(known_, [&](const auto& entry) {
    const auto& [id, p] = entry;
    if (!p.gone || (p.hello.role != "ctl" && now_s - p.seen_s < Departed::kAfter_s)) return false;
    forget(p, id);
    return true;
  });
}

std::string Peers::packer() const {
  auto longest = known_.end();
  for (auto p = known_.begin(); p != known_.end(); ++p)
    if (p->second.serves_as("packer") && (longest == known_.end() || p->second.joined < longest->second.joined))
      longest = p;
  return longest == known_.end() ? std::string() : longest->first;
}

bool Peers::follow_packer() {
  const std::string now = packer();
  if (now.empty() || now == leading_packer_) return false;
  leading_packer_ = now;
  return true;
}

std::string Peers::lacks() const {
  std::vector<std::string> out;
  for (const char* role : {"data", "packer", "sampler"})
    if (std::none_of(known_.begin(), known_.end(),
                     [&](const auto& p) { return p.second.serves_as(role) && !p.second.refused; }))
      out.emplace_back(role);
  return fmt::format("{}", fmt::join(out, ","));
}

std::vector<metrics::Process> Peers::processes() const {
  std::vector<metrics::Process> out(departed_.kept().begin(), departed_.kept().end());
  for (const auto& [id, p] : known_)
    if (p.hello.role != "ctl") out.push_back(p.process);
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.name < b.name; });
  return out;
}

namespace {

constexpr std::string_view kRoles[] = {"data", "sampler", "packer", "viewer", "ctl"};

}  // namespace

Status check_hello(const wire::Hello& m) {
  const auto limited = [](const char* what, size_t count, size_t most) -> Status {
    if (count <= most) return ok_status();
    return Error{fmt::format("{} {}, limit {}", count, what, most)};
  };
  if (std::find(std::begin(kRoles), std::end(kRoles), m.role) == std::end(kRoles))
    return Error{fmt::format("role \"{}\" is not one of data, sampler, packer, viewer, ctl", printable(m.role, 64))};
  if (m.name.size() > kMaxNameBytes || (m.name.empty() && m.role != "ctl"))
    return Error{fmt::format("a name of {} bytes; limits are 1 and {}", m.name.size(), kMaxNameBytes)};
  if (printable(m.name) != m.name) return Error{fmt::format("name \"{}\" has control characters", printable(m.name))};
  if (m.instance.value == 0 || m.instance.value >> 53 != 0)
    return Error{fmt::format("instance {}, limits 1 and 2^53 - 1", m.instance.value)};
  size_t bytes = 0;
  for (const auto& [key, value] : m.facts) bytes += key.size() + value.size();
  for (const Status& s :
       {limited("endpoints", m.endpoints.size(), kMaxEndpoints), limited("facts", m.facts.size(), kMaxFacts),
        limited("bytes of facts", bytes, kMaxFactsBytes), limited("parameters", m.parameters.size(), kMaxParameters)})
    if (!s) return s;
  return ok_status();
}

}  // namespace telesplat::master
