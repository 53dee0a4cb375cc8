// The steered part of FrameSchedule: asks for plans, and makes frames of them.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "common/codec/mask_stream.h"
#include "common/core/check.h"
#include "services/master/tiles/frame_schedule.h"

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

// Refining rays get this part of a link's update: edges may have four times as many rays, and new places any number.
constexpr uint64_t kRefiningPart = 3;

uint64_t within(uint64_t rays, uint64_t link_rays) {
  return link_rays == 0 ? rays : std::max<uint64_t>(1, std::min(rays, link_rays));
}

// Rays of a tile and of an extra frame while the cost of a ray is unknown.
constexpr uint64_t kFirstTileRays = 8192, kFirstExtraRays = 65536;
// With fewer rays than kLeastTileRays a lease costs more than its rays.
constexpr double kLeastTileRays = 1024, kMostRays = 1 << 24;
// Sides of a plan's tiles, in tile sizes; long ones for the same reason: with 256 pixels a view of 1280x800 had 24
// tiles of 260 rays, and samplers waited for leases two thirds of the time. With few samplers a view of few rays is one
// tile: packer and viewers pay for each tile in every cluster to which it adds points, and links pay for the
// overhead of its image. With 1024 pixels that view had a second tile with a fifth of its rays.
constexpr int kPlannedSide = 2, kPlannedSideOfFew = 8;
constexpr double kTargetsOfFew = 3;  // with few samplers a tile takes this many lease targets
constexpr size_t kFewSamplers = 2;
constexpr uint64_t kUnknownTileRays = 16384;  // rays of an extra frame's tile while no link is known
constexpr double kMuchUnseen = 0.25;          // share of a view's pixels
constexpr uint64_t kTilesPerUpdate = 4;       // tiles that a link carries in LinkGate::kUpdate_s

double figure_of(const wire::Plan& plan, const char* name) {
  const auto found = plan.figures.find(name);
  return found == plan.figures.end() ? 0.0 : found->second;
}

// Notes that the view's wait for its plan is over.
PlannedView planned(PlannedView view, double now_s) {
  view.view.moments.planned_s = now_s;
  return view;
}

// More than any plan has. Hostile masks of this many pixels take up to 0.4 s to decode.
constexpr uint64_t kMaxMaskedPixels = uint64_t{1} << 24;

// Error: a view's plan has another camera than was asked for; a tile's mask is not of its size, or has another
// number of rays than the plan says; all masks together have more than kMaxMaskedPixels. Relies on wire::check(plan)
// for the rest. Cost: that of decoding the masks; masks of plans take 0.1 to 0.6 ms a million pixels.
Status check_answer(const wire::PlanRequest& asked, const wire::Plan& plan) {
  if (plan.full) return ok_status();
  if (!asked.extra && plan.camera != asked.camera)
    return Error{fmt::format("the plan of frame {} is not of the camera that was asked for", plan.frame.value)};
  const std::span<const uint32_t> masks(plan.masks);
  size_t begin = 0;
  uint64_t pixels = 0;
  for (size_t i = 0; i < plan.tiles.size(); i += wire::kPlanNumbers) {
    const uint32_t *n = &plan.tiles[i], rays = n[4], words = n[5];
    if (words == 0) continue;
    if (pixels += uint64_t(n[2]) * n[3]; pixels > kMaxMaskedPixels)
      return Error{fmt::format("the plan of frame {}: masks of {} pixels, limit {}", plan.frame.value, pixels,
                               kMaxMaskedPixels)};
    const auto mask = codec::decode_mask(masks.subspan(begin, words), int(n[2]), int(n[3]));
    begin += words;
    const auto where = [&] {
      return fmt::format("the plan of frame {}, tile {}", plan.frame.value, i / wire::kPlanNumbers);
    };
    if (!mask) return Error{fmt::format("{}: {}", where(), mask.error().text)};
    if (mask->count() != rays) return Error{fmt::format("{}: {} rays, its mask has {}", where(), rays, mask->count())};
  }
  return ok_status();
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

// Ends extra questions for the view that `extra` was about; a newer view may want more.
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

PlanLimits FrameSchedule::limits(std::optional<InstanceId> viewer, double now_s) const {
  const double ray_s = costs_.pixel_s({});
  const bool few = workers() <= kFewSamplers;
  const int side = few ? kPlannedSideOfFew : kPlannedSide;
  PlanLimits out{.tile_size = side * options().tile_size, .tile_rays = kFirstTileRays, .most_rays = kFirstExtraRays};
  const size_t samplers = std::max<size_t>(workers(), 1);
  out.refining_rays = refining_.most(samplers);
  out.link_rays = viewer ? gate_.update_rays(*viewer) : gate_.least_update_rays(now_s);
  // Tiles are leased at the pace of a link: each has at most 1 / kTilesPerUpdate of an update's rays.
  const auto of_link = [&](uint64_t rays) {
    if (out.link_rays == 0) return !viewer && !gate_.known() ? std::min(rays, kUnknownTileRays) : rays;
    return std::min(rays, std::max(uint64_t(kLeastTileRays), out.link_rays / kTilesPerUpdate));
  };
  out.tile_rays = of_link(out.tile_rays);
  if (!(ray_s > 0)) return out;
  out.tile_rays =
      of_link(uint64_t(std::clamp((few ? kTargetsOfFew : 1) * target_s() / ray_s, kLeastTileRays, kMostRays)));
  out.most_rays = uint64_t(std::clamp(kExtraFrame_s * double(samplers) / ray_s, kLeastTileRays, kMostRays));
  return out;
}

// A view that can be sampled whole in time has no need to put rays off.
PlanLimits FrameSchedule::limits(const wire::ViewRequest& view, double now_s) const {
  PlanLimits out = limits(view.viewer, now_s);
  const double whole = whole_s(view.camera);
  if (out.link_rays == 0 && whole > 0 && whole <= kWhole_s) out.refining_rays = 0;
  return out;
}

void FrameSchedule::note(const PlanQuestions::Asked& asked, const wire::Plan& plan, double now_s) {
  plan_rows_.push_back(metrics::row_of(asked.request, asked.asked_s, plan, now_s));
}

Status FrameSchedule::take_plan(const wire::Plan& plan, double now_s) {
  const auto asked = plans_.waiting_for(plan);
  if (!asked) return ok_status();
  Status fits = check_answer(*asked, plan);
  if (fits)
    take_answer(plan, now_s);
  else  // extra rays are not asked for again until there is another view
    take_answer({.frame = plan.frame, .epoch = plan.epoch, .camera = asked->camera, .full = true}, now_s);
  return fits;
}

void FrameSchedule::take_answer(const wire::Plan& plan, double now_s) {
  const auto asked = plans_.answered(plan, now_s);
  CHECK(asked);
  note(*asked, plan, now_s);
  if (asked->request.extra) {
    if (!plan.full && !plan.tiles.empty()) begin_planned(*asked, plan, now_s);
    return;
  }
  if (left(asked->view.frame)) return complete(asked->view.frame, false);
  if (plan.full) return begin_whole(planned(asked->view, now_s), coarser(*asked, plan));
  plans_.known(asked->view);
  if (plan.tiles.empty())
    view_complete(asked->view);
  else
    begin_planned(*asked, plan, now_s);
}

int FrameSchedule::coarser(const PlanQuestions::Asked& asked, const wire::Plan& plan) const {
  const geometry::Camera& camera = asked.view.view.camera;
  double unseen = 0;
  for (const char* name : {"rays.nothing", "rays.unproven", "rays.stale"}) unseen += figure_of(plan, name);
  if (asked.request.still || unseen < kMuchUnseen * camera.width * camera.height) return 1;
  int times = 1;
  while (times < kCoarseStep && whole_s(camera) > kWhole_s * times * times) times *= 2;
  return times;
}

void FrameSchedule::begin_planned(const PlanQuestions::Asked& asked, const wire::Plan& plan, double now_s) {
  const bool learns = !asked.request.still;
  insert(
      {.id = plan.frame,
       .epoch = plan.epoch,
       .request = planned(asked.view, now_s).view,
       .camera = plan.camera,
       .tiles = FrameTiles::of_plan(plan),
       .planned = true,
       .extra = asked.request.extra,
       .begun_s = now_s,
       .refining =
           learns ? std::max(figure_of(plan, "rays.sparse"), figure_of(plan, "rays.edge") / RefiningRays::kEdges) : 0,
       .put_off = learns ? figure_of(plan, "rays.put_off") : 0});
}

void FrameSchedule::give_up_plans(double now_s) {
  for (const PlanQuestions::Asked& asked : plans_.give_up(now_s)) {
    plan_rows_.push_back({.asked = asked.request, .asked_s = asked.asked_s, .planned_s = now_s});
    if (asked.request.extra) continue;
    if (left(asked.view.frame))
      complete(asked.view.frame, false);
    else
      begin_whole(planned(asked.view, now_s));
  }
}

void FrameSchedule::view_complete(const PlannedView& view, bool whole) {
  complete(view.frame, whole);
  plans_.known(view);
}

// One extra frame at a time, so that the packer knows its samples before it plans the next. While views wait for each
// other, samplers do its tiles in between; it is planned while they are busy with a view and the packer is not.
void FrameSchedule::begin_extra(EpochId epoch, double now_s) {
  const bool extra_out = std::any_of(frames_.begin(), frames_.end(), [](const Frame& f) { return f.extra; });
  if (!plans_.on(now_s) || plans_.extra_open() || extra_out || !gate_.idle(now_s)) return;
  const bool nothing_else = !view_waiting() && views_in_flight() == 0;
  const auto which = nothing_else ? PlanQuestions::Extra::kAny : PlanQuestions::Extra::kDue;
  if (!plans_.extra_wanted(epoch, which)) return;
  questions_.push_back(plans_.ask_extra(next_frame(), epoch, which, limits(std::nullopt, now_s), now_s));
}

// Closes extra frames beyond older views, but not those beyond this view: a head that rests asks for it every second.
void FrameSchedule::close_extras(const wire::ViewRequest& view, double now_s) {
  for (Frame& f : frames_) {
    const bool same = f.request.viewer == view.viewer && f.request.camera == view.camera;
    if (f.extra && !same && now_s - f.begun_s > kExtraPatience_s) f.tiles.close();
  }
  end_closed();
}

void FrameSchedule::end_closed() {
  for (auto f = frames_.begin(); f != frames_.end();)
    f = f->tiles.closed() && f->tiles.complete() ? end_frame(f) : std::next(f);
}

// Tiles of the viewer's frames that are out may still come; the others are not sampled.
void FrameSchedule::forget_viewer(InstanceId viewer) {
  Views::forget_viewer(viewer);
  for (Frame& f : frames_)
    if (!f.extra && f.request.viewer == viewer) f.tiles.close();
  for (size_t before = frames_.size() + 1; frames_.size() < before;) {
    before = frames_.size();
    end_closed();
  }
  plans_.forget_viewer(viewer);
  gate_.forget(viewer);
}

}  // namespace telesplat::master
