#include "client/viewer/coupling/view_requester.h"

#include <algorithm>
#include <cmath>
#include <tuple>

#include "client/viewer/coupling/frame_budget.h"
#include "common/core/check.h"
#include "common/wire/short_camera.h"

namespace telesplat::viewer {
namespace {

constexpr size_t kMaxOpen = 256;
constexpr double kMotionOfRest = 0.002;  // radians, or metres / 0.6, until a view would be displayed
constexpr double kWholePart = 4;         // a view with samples in more than 1 of 4 pixels counts as sampled whole

// Returns the side of a sampled image: a multiple of 8, in range.
int whole_side(double v) { return std::clamp(int(std::lround(v / 8)) * 8, 16, geometry::kMaxImageSide); }

}  // namespace

std::pair<int, int> sampling_size(const RequestOptions& o, int width, int height) {
  if (!o.follow_display || width <= 0 || height <= 0) return {o.sampling_width, o.sampling_height};
  const double side = std::sqrt(double(o.sampling_width) * o.sampling_height);
  const double stretch = std::sqrt(double(width) / height);
  return {whole_side(side * stretch), whole_side(side / stretch)};
}

void ViewRequester::on_pose(double t_s, const geometry::Camera& display) {
  head_.on_pose(t_s, display.pose);
  if (display_ != display) posed_s_ = t_s;
  display_ = display;
}

void ViewRequester::on_ask(double now_s, uint64_t ask, const geometry::Camera& camera) {
  asked_ = Ask{ask, camera};
  asked_s_ = now_s;
}

double ViewRequester::horizon_s() const {
  if (displayed_latency_s_ > 0) return displayed_latency_s_;
  return latency_s_ > 0 ? latency_s_ : options_.initial_latency_s;
}

// True if content kNearest_m away looks alike from both poses.
bool ViewRequester::rests_at(const geometry::Pose& there, const geometry::Pose& here) const {
  return screen_movement(there, here, kNearest_m, display_->focal_x()) < kDeadBand_px;
}

geometry::Camera ViewRequester::wanted(double now_s, bool& still, const geometry::Camera* asked) {
  return wire::shortened(exactly_wanted(now_s, still, asked));  // each update carries its camera in this short form
}

geometry::Camera ViewRequester::exactly_wanted(double now_s, bool& still, const geometry::Camera* asked) {
  const double horizon_s = this->horizon_s();
  geometry::Camera camera = asked ? *asked : *display_;
  if (options_.pictures) {
    if (!options_.adaptive)
      std::tie(camera.width, camera.height) = sampling_size(options_, display_->width, display_->height);
    return camera;
  }
  if (!asked) camera.pose = head_.predict(now_s, display_->pose, now_s + horizon_s);
  // The faster the head, the wider the sampled view; a still head gets exactly what it looks at. Steered views of known
  // space come at once; the next one takes longer if something unseen comes into sight.
  const double ahead_s = steered_ ? std::max(horizon_s, options_.target_latency_s) : horizon_s;
  const double motion = head_.motion(ahead_s);
  const double margin = motion < kMotionOfRest ? 0.0 : std::min(options_.max_margin, 0.02 + 0.6 * motion);
  // The first view must come soon rather than be sharp, and so must each view of an epoch that may not last.
  change_.look(now_s);
  still = margin == 0 && latency_s_ > 0 && !change_.changing();
  if (options_.adaptive) {
    // A wider view keeps the sampling density; a still head gets a sample for each pixel.
    const double per_pixel = scale_.of(*display_, min_scale()) * (1 + margin);
    camera.width = still ? display_->width : whole_side(display_->width * per_pixel);
    camera.height = still ? display_->height : whole_side(display_->height * per_pixel);
  } else {
    std::tie(camera.width, camera.height) = sampling_size(options_, display_->width, display_->height);
  }
  const double du = (camera.right - camera.left) * margin / 2, dv = (camera.top - camera.bottom) * margin / 2;
  camera.left -= du, camera.right += du, camera.bottom -= dv, camera.top += dv;
  if (margin > 0) return camera;
  const geometry::Pose& here = asked ? asked->pose : display_->pose;
  if (sent_ && rests_at(sent_->camera.pose, here))
    camera.pose = sent_->camera.pose;
  else if (rests_at(camera.pose, here))
    camera.pose = here;
  return camera;
}

// True if this camera sees nothing new, as far as is known.
bool ViewRequester::quiet(const geometry::Camera& camera) const {
  const bool seen = quiet_ == camera, on_its_way = answer_open() && sent_->camera == camera;
  return steered_ && !change_.changing() && (seen || on_its_way);
}

bool ViewRequester::waits_for_answer(double now_s) const {
  return steered_ && answer_open() && now_s - sent_->requested_s < kPatience_s;
}

void ViewRequester::set_sampling(const SamplingWish& wish) {
  options_.adaptive = wish.adaptive;
  if (wish.adaptive) {
    set_min_scale(wish.least_sampling);
  } else if (wish.width > 0 && wish.height > 0) {
    options_.sampling_width = wish.width;
    options_.sampling_height = wish.height;
  }
  scale_.reset();
  quiet_.reset();  // a head that rests must see the new sampling, too
}

void ViewRequester::on_epoch(double now_s) {
  change_.on_epoch(now_s);
  quiet_.reset();
}

void ViewRequester::set_buffers(uint64_t buffers) {
  if (options_.buffers == 0) std::erase_if(open_, [&](const auto& o) { return o.first != sent_->request; });
  // The latency until an update is displayed differs in the new mode.
  if ((options_.buffers == 0) != (buffers == 0)) displayed_latency_s_ = 0;
  options_.buffers = buffers;
  if (sent_) due_s_ = std::min(due_s_, sent_->requested_s + 1.0 / options_.max_rate_hz);  // credits ignored this rate
}

// A head that moves gets its newest view. A head that rests asks for the same view once more, and samplers draw it
// finer. In another epoch the same view counts as a new one.
bool ViewRequester::picture_due(double now_s) {
  bool still = false;
  if (!sent_ || sent_->camera != wanted(now_s, still) || change_.epoch_s() > sent_->requested_s) {
    settled_ = false;
    return true;
  }
  if (settled_ || answer_open() || now_s - sent_->requested_s < kSettles_s) return false;
  return settled_ = true;
}

std::optional<wire::ViewRequest> ViewRequester::next(double now_s) {
  const bool paced = options_.buffers == 0;
  if (!display_) return std::nullopt;
  if (options_.pictures && (now_s < due_s_ || !picture_due(now_s))) return std::nullopt;
  const bool together = paced && now_s - asked_s_ < kAskPatience_s;
  if (together ? !asked_ : paced && (now_s < due_s_ || waits_for_answer(now_s))) return std::nullopt;
  const Ask ask = together ? *std::exchange(asked_, std::nullopt) : Ask{};
  bool still = false;
  const geometry::Camera camera = wanted(now_s, still, together ? &ask.camera : nullptr);
  if (paced && !together && quiet(camera) && now_s - sent_->requested_s < kQuietPeriod_s) return std::nullopt;
  const double period_s = 1.0 / (options_.pictures ? options_.picture_rate_hz : options_.max_rate_hz);
  due_s_ = now_s - due_s_ < period_s ? due_s_ + period_s : now_s + period_s;
  const RequestId id = next_;
  next_ = next_.next();
  const uint64_t ahead = paced ? 0 : std::min<uint64_t>(open_.size(), options_.buffers - 1);
  sent_ = Update{
      .request = id, .ahead = ahead, .requested_s = now_s, .posed_s = posed_s_, .camera = camera, .still = still};
  open_[id] = *sent_;
  while (open_.size() > kMaxOpen) open_.erase(open_.begin());
  return request(id, camera, now_s, options_.buffers, ask.number);
}

wire::ViewRequest ViewRequester::request(RequestId id, const geometry::Camera& camera, double now_s, uint64_t buffers,
                                         uint64_t ask) const {
  return {.viewer = viewer_,
          .request = id,
          .camera = camera,
          .moments = {.requested_s = now_s},
          .buffers = buffers,
          .footprint = 1 / display_->focal_x(),
          .wall = options_.wall,
          .wall_viewers = options_.wall_viewers,
          .ask = ask};
}

std::vector<wire::ViewRequest> ViewRequester::again(std::span<const RequestId> requests, double now_s) {
  std::vector<wire::ViewRequest> out;
  // If buffers became fewer, there may be more requests than buffers: the master must keep them all.
  const uint64_t buffers = std::min(std::max<uint64_t>(options_.buffers, requests.size()), wire::kMaxBuffers);
  for (const RequestId id : requests) {
    const auto it = open_.find(id);
    if (it == open_.end() || !display_) continue;
    it->second.camera = wanted(now_s, it->second.still);
    out.push_back(request(id, it->second.camera, now_s, buffers, 0));
  }
  return out;
}

void ViewRequester::on_displayed(double latency_s) {
  latency_s = std::clamp(latency_s, 1e-3, 10.0);
  displayed_latency_s_ = displayed_latency_s_ == 0 ? latency_s : 0.8 * displayed_latency_s_ + 0.2 * latency_s;
}

std::optional<double> ViewRequester::requested_s(RequestId request) const {
  const auto it = open_.find(request);
  return it == open_.end() ? std::nullopt : std::optional(it->second.requested_s);
}

ViewPart part_of(const wire::Patch& p) {
  return {.viewer = p.viewer,
          .request = p.request,
          .epoch = p.epoch,
          .frame = p.frame,
          .complete = p.frame_complete && p.step <= 1 && !p.extra,
          .extra = p.extra,
          .tiles = 1,
          .points = p.counts.kept,
          .samples = p.counts.samples,
          .bytes = p.image.size(),
          .camera = p.camera,
          .eliminated = p.counts.samples - std::min(p.counts.kept, p.counts.samples),
          .tile = p.tile,
          .left_out = p.left_out,
          .moments = p.moments};
}

void ViewRequester::follow_latency(const Update& u, double latency_s) {
  latency_s_ = latency_s_ == 0 ? latency_s : 0.8 * latency_s_ + 0.2 * latency_s;
  if (!options_.adaptive || u.still) return;
  // Requests that were sent before it took their share of the time.
  const double own_s = latency_s / double(1 + u.ahead), target_s = options_.target_latency_s;
  const bool whole = double(u.samples) * kWholePart > double(u.camera.width) * u.camera.height;
  if (steered_)
    scale_.follow_steered(own_s, target_s, whole, min_scale());
  else
    scale_.follow(own_s, target_s, min_scale());
}

std::optional<ViewRequester::Update> ViewRequester::on_part(const ViewPart& part, double now_s) {
  if (part.viewer != viewer_) return std::nullopt;
  if (part.extra) {
    extra_.points += part.points;
    extra_.bytes += part.bytes;
    return std::nullopt;
  }
  const auto it = open_.find(part.request);
  if (it == open_.end()) return std::nullopt;
  Update& u = it->second;
  if (u.tiles == 0) u.first_s = now_s;
  u.tiles += part.tiles;
  u.points += part.points;
  u.samples += part.samples;
  u.bytes += part.bytes;
  u.eliminated += part.eliminated;
  if (!part.complete) return std::nullopt;
  u.complete_s = now_s;
  change_.on_update(now_s);
  u.extra = std::exchange(extra_, {});
  quiet_ = u.points == 0 && part.left_out == 0 ? std::optional(u.camera) : std::nullopt;
  // A new connection may set back the master's clock as this machine sees it.
  follow_latency(u, std::max(now_s - u.requested_s, 1e-3));
  const Update done = u;
  // Asynchronous requests before this one were replaced at the master and will never be answered; a newer picture makes
  // older ones void, too. With credits, others may still be answered.
  open_.erase(options_.buffers && !options_.pictures ? it : open_.begin(), std::next(it));
  return done;
}

// ---- credits -------------------------------------------------------------------------------------------------------

void Coupling::set_buffers(int buffers) {
  buffers_ = buffers;
  if (waits()) return;
  open_.clear();
  ready_.clear();
}

void Coupling::asked(RequestId request, double now_s) {
  if (!waits()) return;
  CHECK(open_.empty() || open_.back().request < request);
  if (open_.empty()) heard_s_ = now_s;
  open_.push_back({request});
}

bool Coupling::is_open(RequestId request) const {
  return std::any_of(open_.begin(), open_.end(), [&](const Open& o) { return o.request == request && !o.complete; });
}

void Coupling::skip_before(RequestId request) {
  if (is_open(request)) std::erase_if(open_, [&](const Open& o) { return o.request < request && !o.complete; });
}

std::vector<RequestId> Coupling::release() {
  std::vector<RequestId> out;
  for (; !open_.empty() && open_.front().complete; open_.pop_front()) out.push_back(open_.front().request);
  ready_.insert(ready_.end(), out.begin(), out.end());
  return out;
}

std::vector<RequestId> Coupling::completed(RequestId request, double now_s) {
  progress(now_s);
  const auto found = std::ranges::find(open_, request, &Open::request);
  if (found != open_.end()) found->complete = true;
  if (newest_ && found != open_.end()) {
    open_.erase(open_.begin(), found);
    ready_.clear();
  }
  return release();
}

std::vector<RequestId> Coupling::overdue(double now_s, std::vector<RequestId>& released) {
  if (open_.empty() || now_s < heard_s_ + kPatience_s) return {};
  heard_s_ = now_s;
  const auto complete = std::find_if(open_.begin(), open_.end(), [](const Open& o) { return o.complete; });
  if (complete == open_.end()) return open();
  open_.erase(open_.begin(), complete);
  released = release();
  return {};
}

std::vector<RequestId> Coupling::open() const {
  std::vector<RequestId> out;
  for (const Open& o : open_)
    if (!o.complete) out.push_back(o.request);
  return out;
}

std::optional<RequestId> Coupling::take() {
  CHECK(!displaying_);
  if (ready_.empty()) return std::nullopt;
  const RequestId out = ready_.front();
  ready_.pop_front();
  displaying_ = true;
  return out;
}

bool CouplingGate::may_ask() {
  return with([](const Coupling& c) { return c.may_ask(); });
}

bool CouplingGate::asked(RequestId request, double now_s) {
  return with([&](Coupling& c) {
    c.asked(request, now_s);
    return c.waits() && c.may_ask();
  });
}

}  // namespace telesplat::viewer
