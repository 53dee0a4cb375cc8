#include "services/sampler/julia/tiles.h"

#include <algorithm>

#include "common/core/log.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::sampler {
namespace {

Result<JuliaScene> make_scene(const wire::Welcome& session) {
  const auto parameters = julia::from_map(session.parameters);
  if (!parameters) return parameters.error();
  if (const Status s = julia::validate(*parameters); !s) return s.error();
  const auto placement = julia::placement_from_map(session.parameters, session.box_room);
  if (!placement) return placement.error();
  const auto clip = geometry::clip_from_text(scene::SessionView(session).fact(scene::kClipFact));
  if (!clip) return clip.error();
  return JuliaScene(*parameters, *placement, *clip);
}

// Returns the size of a pixel of the view in pixels of the lease's camera, within limits for any lease.
double footprint_px(const wire::Lease& lease) {
  if (lease.footprint <= 0) return 1.0 / double(lease.step);
  return std::clamp(lease.footprint * lease.camera.focal_x(), 1.0 / 64, 64.0);
}

}  // namespace

void JuliaTiles::on_welcome(const wire::Welcome& session) {
  epochs_.follow(session.master);
  const Epoch* known = epochs_.find(session.epoch);
  const std::string clip = scene::SessionView(session).fact(scene::kClipFact);
  if (known && known->parameters == session.parameters && known->box_room == session.box_room && known->clip == clip)
    return;
  Epoch epoch{session.parameters, session.box_room, clip, std::nullopt};
  if (auto scene = make_scene(session))
    epoch.scene = std::move(*scene);
  else
    log::error("epoch {} cannot be sampled: {}", session.epoch.value, scene.error().text);
  epochs_.put(session.epoch, std::move(epoch));
}

Readiness JuliaTiles::readiness(const HeldLease& held, double now_s) {
  using State = Readiness::State;
  const Epoch* epoch = epochs_.find(held.lease.epoch);
  if (!epoch) return epochs_.wait_for_welcome(held.lease.epoch, held.received_s, now_s);
  return {epoch->scene ? State::kReady : State::kHopeless};
}

Sampled JuliaTiles::sample(const HeldLease& held) {
  const wire::Lease& lease = held.lease;
  return timed([&] {
    return sampler_.sample(*epochs_.find(lease.epoch)->scene, lease.camera, lease.rect, footprint_px(lease),
                           held.pixels());
  });
}

}  // namespace telesplat::sampler
