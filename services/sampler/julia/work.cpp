#include "services/sampler/julia/work.h"

#include "common/core/log.h"

namespace telesplat::sampler {
namespace {

Result<JuliaScene> make_scene(const wire::Welcome& session) {
  const auto parameters = julia::from_map(session.parameters);
  if (!parameters) return parameters.error();
  if (const Status s = julia::validate(*parameters); !s) return s.error();
  const auto placement = julia::placement_from_map(session.parameters, session.box_room);
  if (!placement) return placement.error();
  return JuliaScene(*parameters, *placement);
}

}  // namespace

void JuliaWork::on_welcome(const wire::Welcome& session) {
  if (session.master != master_) epochs_.clear();
  master_ = session.master;
  const auto known = epochs_.find(session.epoch);
  if (known != epochs_.end() && known->second.parameters == session.parameters &&
      known->second.box_room == session.box_room)
    return;
  Epoch epoch{session.parameters, session.box_room, std::nullopt};
  if (auto scene = make_scene(session))
    epoch.scene = std::move(*scene);
  else
    log::error("epoch {} cannot be sampled: {}", session.epoch.value, scene.error().text);
  epochs_.insert_or_assign(session.epoch, std::move(epoch));
  while (epochs_.size() > kEpochs) epochs_.erase(epochs_.begin());
}

Readiness JuliaWork::readiness(const HeldLease& held, double now_s) {
  using State = Readiness::State;
  const auto epoch = epochs_.find(held.lease.epoch);
  if (epoch != epochs_.end()) return {epoch->second.scene ? State::kReady : State::kHopeless};
  const double until_s = held.received_s + kUnknownEpoch_s;
  if (now_s < until_s) return {State::kWaits, until_s};
  log::warn("a lease of epoch {} was dropped: no welcome told its parameters", held.lease.epoch.value);
  return {State::kHopeless};
}

Sampled JuliaWork::sample(const HeldLease& held) {
  const wire::Lease& lease = held.lease;
  return timed(
      [&] { return sampler_.sample(*epochs_.at(lease.epoch).scene, lease.camera, lease.rect, int(lease.step)); });
}

}  // namespace telesplat::sampler
