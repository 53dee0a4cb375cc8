#include "services/master/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/net/keys/roles.h"

namespace telesplat::master {

wire::ViewRequest Gate::admit(const wire::ViewRequest& view) {
  const auto pixels = [](const geometry::Camera& c) { return uint64_t(c.width) * uint64_t(c.height); };
  const uint64_t most = std::max<uint64_t>(limits_.max_sampling_pixels, 1);
  if (pixels(view.camera) <= most) return view;
  ++hit_.views_coarser;
  wire::ViewRequest out = view;
  int step = std::max(2, int(std::sqrt(double(pixels(view.camera)) / double(most))));
  do out.camera = geometry::subsample(view.camera, step++);
  while (pixels(out.camera) > most);
  return out;
}

Status Senders::admit(const net::Message& from, const wire::Hello& m) {
  if (from.role && !net::may_be(*from.role, m.role))
    return Error{fmt::format("the key {} is {}'s: its owner cannot be a {}", from.user, net::described(*from.role),
                             net::as_word(m.role))};
  if (Status s = is_same_user(from, m.instance); !s)
    return Error{fmt::format("{}: {}", wire::kInstanceTaken, s.error().text)};
  if (const auto owner = owners_.find(m.instance); owner == owners_.end()) {
    auto& instances = of_user_[from.user];
    owners_[m.instance] = {from.peer, from.user, instances.insert(instances.end(), m.instance)};
  } else if (owner->second.peer != from.peer) {
    // The process came back over another connection; its old connection does not speak for it any more.
    instances_.erase(std::exchange(owner->second.peer, from.peer));
  }
  // Forget the process for which this connection spoke before.
  const auto before = instances_.find(from.peer);
  if (before != instances_.end() && before->second != m.instance) forget(before->second);
  instances_[from.peer] = m.instance;
  if (owners_.size() > kMost) {
    const auto most = std::max_element(of_user_.begin(), of_user_.end(),
                                       [](const auto& a, const auto& b) { return a.second.size() < b.second.size(); });
    forget(most->second.front());
  }
  return ok_status();
}

void Senders::forget(InstanceId instance) {
  const auto owner = owners_.find(instance);
  const auto user = of_user_.find(owner->second.user);
  user->second.erase(owner->second.place);
  if (user->second.empty()) of_user_.erase(user);
  instances_.erase(owner->second.peer);
  owners_.erase(owner);
}

// A process whose own connection is busy says goodbye over another.
Status Senders::admit(const net::Message& from, const wire::Goodbye& m) { return speaks_for(from, m.instance); }

// Viewers of walls send this over a second connection.
Status Senders::admit(const net::Message& from, const wire::SwapReady& m) { return is_same_user(from, m.viewer); }

Status Senders::admit(const net::Message& from, const wire::Control& m) {
  if (!from.role || net::may_command(*from.role, m.command)) return ok_status();
  return Error{net::refused_command(*from.role, from.user, m.command)};
}

Status Senders::speaks_for(const net::Message& from, InstanceId instance) const {
  const auto said = instances_.find(from.peer);
  if (said == instances_.end()) return is_same_user(from, instance);  // over a second connection
  if (said->second == instance) return ok_status();
  return Error{"it speaks in the name of another process"};
}

Status Senders::is_same_user(const net::Message& from, InstanceId instance) const {
  const auto owner = owners_.find(instance);
  if (owner == owners_.end() || owner->second.user == from.user) return ok_status();
  return Error{fmt::format("the key {} speaks in the name of a process of {}", from.user, owner->second.user)};
}

}  // namespace telesplat::master
