#include "services/master/peers.h"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "common/core/utf8.h"

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
