#include "client/viewer/worker/coupling_follower.h"

namespace telesplat::viewer {

void CouplingFollower::follow(const wire::SessionSettings& session, double now_s) {
  const auto told = coupling_told(session.coupling, session.buffers);
  if (!told || told == wished_) return;
  wished_ = *told != gate_.state() ? told : std::nullopt;
  wished_since_s_ = now_s;
}

std::optional<CouplingState> CouplingFollower::next(bool answer_open, double now_s) {
  if (!wished_) return std::nullopt;
  const bool begins_to_wait = !gate_.state().waits() && wished_->waits();
  if (begins_to_wait && answer_open && now_s < wished_since_s_ + Coupling::kPatience_s) return std::nullopt;
  return std::exchange(wished_, std::nullopt);
}

std::optional<CouplingState> CouplingFollower::follow_pictures(bool pictures) const {
  if (pictures == (gate_.state().mode == CouplingMode::kImages)) return std::nullopt;
  return pictures ? coupling_state(CouplingMode::kImages, 0) : CouplingState{};
}

std::optional<CouplingState> CouplingFollower::answered(const metrics::StagesMs& stages, uint64_t ahead) {
  CouplingState state = gate_.state();
  if (state.mode != CouplingMode::kImages) return std::nullopt;
  depth_.answered({.latency_ms = metrics::sum_ms(stages, ""),
                   .queued_ms = metrics::sum_ms(stages, "queue_ms"),
                   .network_ms = metrics::sum_ms(stages, "network_ms"),
                   .ahead = int(ahead)});
  if (state.buffers == depth_.depth()) return std::nullopt;
  state.buffers = depth_.depth();
  return state;
}

}  // namespace telesplat::viewer
