#include "services/master/tiles/plan_questions.h"

#include <algorithm>
#include <utility>

#include "common/core/check.h"

namespace telesplat::master {
namespace {

wire::PlanRequest request_of(const PlannedView& view, const PlanLimits& limits) {
  return {.frame = view.frame,
          .epoch = view.epoch,
          .viewer = view.view.viewer,
          .request = view.view.request,
          .camera = view.view.camera,
          .tile_size = uint64_t(std::clamp(limits.tile_size, 32, wire::kMaxTileSide)),
          .tile_rays = limits.tile_rays,
          .moments = view.view.moments};
}

auto answered_by(const wire::Plan& plan) {
  return [&](const auto& asked) { return asked.request.frame == plan.frame && asked.request.epoch == plan.epoch; };
}

// Refining rays of a view: edges may have four times as many, and what is new has no limit.
constexpr uint64_t kRefiningPart = 3;

uint64_t within(uint64_t rays, uint64_t link_rays) {
  return link_rays == 0 ? rays : std::max<uint64_t>(1, std::min(rays, link_rays));
}

}  // namespace

PlanQuestions::Seen& PlanQuestions::see(const PlannedView& view) {
  Seen& seen = viewers_[view.view.viewer];
  const bool still = seen.view.epoch == view.epoch && seen.view.view.camera == view.view.camera;
  seen = {.view = view, .still = still, .round = seen.round, .since_extra = seen.since_extra + 1};
  return seen;
}

wire::PlanRequest PlanQuestions::ask(const PlannedView& view, const PlanLimits& limits, double now_s) {
  const Seen& seen = see(view);
  wire::PlanRequest request = request_of(view, limits);
  request.still = seen.still;
  request.most_rays = within(limits.refining_rays * (seen.still ? kStillViews : 1), limits.link_rays / kRefiningPart);
  open_.push_back({view, request, now_s});
  return request;
}

double PlanQuestions::patience_s() const {
  return std::clamp(kUsualAnswers * answer_s_.value(), kLeastPatience_s, kLongestPatience_s);
}

void PlanQuestions::known(const PlannedView& view) {
  const auto seen = viewers_.find(view.view.viewer);
  if (seen != viewers_.end() && seen->second.view.frame == view.frame) seen->second.known = true;
}

bool PlanQuestions::extra_wanted(EpochId epoch, Extra which) const {
  return std::any_of(viewers_.begin(), viewers_.end(), [&](const auto& v) { return v.second.wants(epoch, which); });
}

wire::PlanRequest PlanQuestions::ask_extra(FrameId frame, EpochId epoch, Extra which, const PlanLimits& limits,
                                           double now_s) {
  const auto wants = [&](const auto& v) { return v.second.wants(epoch, which); };
  auto next = std::find_if(viewers_.upper_bound(last_), viewers_.end(), wants);
  if (next == viewers_.end()) next = std::find_if(viewers_.begin(), viewers_.end(), wants);
  CHECK(next != viewers_.end());
  last_ = next->first;
  Seen& seen = next->second;
  seen.since_extra = 0;
  PlannedView view = seen.view;
  view.frame = frame;
  wire::PlanRequest request = request_of(view, limits);
  request.extra = true;
  request.round = seen.round++;
  request.still = seen.still;
  request.most_rays = within(limits.most_rays * (seen.still ? kStillExtras : 1), limits.link_rays);
  open_.push_back({view, request, now_s});
  return request;
}

std::optional<wire::PlanRequest> PlanQuestions::waiting_for(const wire::Plan& plan) const {
  const auto asked = std::find_if(open_.begin(), open_.end(), answered_by(plan));
  return asked == open_.end() ? std::nullopt : std::optional(asked->request);
}

std::optional<PlanQuestions::Asked> PlanQuestions::answered(const wire::Plan& plan, double now_s) {
  const auto asked = std::find_if(open_.begin(), open_.end(), answered_by(plan));
  if (asked == open_.end()) return std::nullopt;
  Asked out = std::move(*asked);
  open_.erase(asked);
  in_vain_ = 0, rest_s_ = 0;
  if (!out.request.extra) answer_s_.add(now_s - out.asked_s);
  if (out.request.extra && (plan.full || plan.tiles.empty())) exhaust(out.request);
  return out;
}

std::vector<PlanQuestions::Asked> PlanQuestions::give_up(double now_s) {
  std::vector<Asked> out;
  std::erase_if(open_, [&](Asked& a) {
    if (now_s - a.asked_s <= (a.request.extra ? kExtraAnswer_s : patience_s())) return false;
    out.push_back(std::move(a));
    return true;
  });
  for (const Asked& a : out) {
    if (a.request.extra) exhaust(a.request);
    if (a.request.extra || ++in_vain_ < 2) continue;
    rest_s_ = rest_s_ == 0 ? kFirstRest_s : std::min(2 * rest_s_, kLongestRest_s);
    rests_until_s_ = now_s + rest_s_;
  }
  return out;
}

bool PlanQuestions::extra_open() const {
  return std::any_of(open_.begin(), open_.end(), [](const Asked& a) { return a.request.extra; });
}

// Of the view that it was about; a newer one may want more.
void PlanQuestions::exhaust(const wire::PlanRequest& extra) {
  const auto seen = viewers_.find(extra.viewer);
  if (seen != viewers_.end() && seen->second.view.view.request == extra.request) seen->second.exhausted = true;
}

void PlanQuestions::forget_viewer(InstanceId viewer) {
  viewers_.erase(viewer);
  std::erase_if(open_, [&](const Asked& a) { return a.request.extra && a.request.viewer == viewer; });
}

void PlanQuestions::clear() {
  open_.clear();
  for (auto& [viewer, seen] : viewers_) seen.known = false;
}

}  // namespace telesplat::master
