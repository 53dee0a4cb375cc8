#include "client/viewer/coupling/coupling.h"

#include <fmt/format.h>

#include <utility>

#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {

std::optional<CouplingMode> coupling_named(std::string_view name) {
  for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose, CouplingMode::kImages})
    if (name == coupling_name(mode)) return mode;
  return std::nullopt;
}

const char* coupling_name(CouplingMode mode) {
  constexpr const char* kNames[] = {"async", "sync", "loose", "images"};
  return kNames[size_t(mode)];
}

int buffers_of(CouplingMode mode, int loose) {
  if (mode == CouplingMode::kImages) return PipelineDepth::kFirst;
  return mode == CouplingMode::kAsync ? 0 : mode == CouplingMode::kSync ? 1 : loose;
}

CouplingState coupling_state(CouplingMode mode, int loose) { return {mode, buffers_of(mode, loose)}; }

std::string coupling_text(const CouplingState& s) {
  if (s.mode != CouplingMode::kLoose) return coupling_name(s.mode);
  return fmt::format("loose, {} buffer{}", s.buffers, s.buffers == 1 ? "" : "s");
}

std::optional<CouplingState> coupling_told(wire::CouplingOrder order, uint64_t buffers) {
  switch (order) {
    case wire::CouplingOrder::kOwn:
      return std::nullopt;
    case wire::CouplingOrder::kAsync:
      return coupling_state(CouplingMode::kAsync, 0);
    case wire::CouplingOrder::kSync:
      return coupling_state(CouplingMode::kSync, 0);
    case wire::CouplingOrder::kLoose:
      break;
  }
  return coupling_state(CouplingMode::kLoose, int(buffers));
}

bool StallWatch::waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling) {
  if (!since_s_) since_s_ = begin_s;
  if (!told_ && now_s - *since_s_ >= kLong_s) {
    told_ = true;
    news_ = fmt::format(
        "no view update for {:.1f} s ({}): the picture stays; requests are sent again every {:.0f} s, and {:.0f} s "
        "after the last sign of an answer frames are drawn from what is there",
        now_s - *since_s_, coupling_text(coupling), Coupling::kPatience_s, most_s_);
  }
  if (!draws_ && now_s - std::max(*since_s_, last_sign_s) >= most_s_) {
    draws_ = true;
    news_ = fmt::format("no view update for {:.1f} s: frames are drawn from what is there until one comes",
                        now_s - *since_s_);
  }
  return draws_;
}

void StallWatch::over(double now_s) {
  if (told_) news_ = fmt::format("the display goes on, after {:.1f} s without a view update", now_s - *since_s_);
  since_s_.reset();
  told_ = draws_ = false;
}

std::optional<std::string> StallWatch::take_news() { return std::exchange(news_, std::nullopt); }

}  // namespace telesplat::viewer
