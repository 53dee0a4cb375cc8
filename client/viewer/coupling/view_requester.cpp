#include "client/viewer/coupling/view_requester.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace telesplat::viewer {
namespace {

constexpr double kVelocityWindow_s = 0.15, kMaxMove_m = 0.3, kMaxTurn_rad = 0.6;
constexpr size_t kMaxOpen = 256;
constexpr double kEpochSettles_s = 1.0;      // without a new epoch the scene counts as unchanging again
constexpr double kFirstPixels = 1280 * 800;  // what adaptive sampling begins with

// Side of a sampled image: a multiple of 8 in range.
int whole_side(double v) { return std::clamp(int(std::lround(v / 8)) * 8, 16, geometry::kMaxImageSide); }

// Rotation vector of a unit quaternion.
glm::dvec3 rotation_vector(glm::dquat q) {
  if (q.w < 0) q = -q;
  const glm::dvec3 v(q.x, q.y, q.z);
  const double s = glm::length(v);
  return s < 1e-9 ? 2.0 * v : v / s * 2.0 * std::atan2(s, q.w);
}

glm::dquat rotation(const glm::dvec3& v) {
  const double angle = glm::length(v);
  return angle < 1e-9 ? glm::dquat(1, 0, 0, 0) : glm::angleAxis(angle, v / angle);
}

glm::dvec3 clamp_length(const glm::dvec3& v, double limit) {
  const double length = glm::length(v);
  return length > limit ? v * (limit / length) : v;
}

}  // namespace

std::pair<int, int> sampling_size(const RequestOptions& o, int width, int height) {
  if (!o.follow_display || width <= 0 || height <= 0) return {o.sampling_width, o.sampling_height};
  const double side = std::sqrt(double(o.sampling_width) * o.sampling_height);
  const double stretch = std::sqrt(double(width) / height);
  return {whole_side(side * stretch), whole_side(side / stretch)};
}

void PosePredictor::add(double t_s, const geometry::Pose& pose) {
  if (!samples_.empty() && t_s <= samples_.back().t_s) return;
  samples_.push_back({t_s, pose});
  while (samples_.size() > 2 && samples_[1].t_s < t_s - kVelocityWindow_s) samples_.pop_front();
}

PosePredictor::Velocity PosePredictor::velocity() const {
  if (samples_.size() < 2) return {};
  const Sample &a = samples_.front(), &b = samples_.back();
  const double dt = b.t_s - a.t_s;
  if (dt < 1e-3) return {};
  return {(b.pose.position_room - a.pose.position_room) / dt,
          rotation_vector(b.pose.orientation * glm::conjugate(a.pose.orientation)) / dt};
}

double PosePredictor::speed_m_s() const { return glm::length(velocity().linear); }
double PosePredictor::turn_rad_s() const { return glm::length(velocity().angular); }

geometry::Pose PosePredictor::predict(double t_s) const {
  if (samples_.empty()) return {};
  const Sample& last = samples_.back();
  const double dt = std::max(0.0, t_s - last.t_s);
  const Velocity v = velocity();
  return {last.pose.position_room + clamp_length(v.linear * dt, kMaxMove_m),
          glm::normalize(rotation(clamp_length(v.angular * dt, kMaxTurn_rad)) * last.pose.orientation)};
}

void ViewRequester::on_pose(double t_s, const geometry::Camera& display) {
  predictor_.add(t_s, display.pose);
  display_ = display;
}

geometry::Camera ViewRequester::wanted(double now_s, bool& still) {
  const double horizon_s = displayed_latency_s_ > 0 ? displayed_latency_s_
                           : latency_s_ > 0         ? latency_s_
                                                    : options_.initial_latency_s;
  geometry::Camera camera = *display_;
  camera.pose = predictor_.predict(now_s + horizon_s);
  // The faster the head, the wider the view that is sampled; a still head gets exactly what it looks at.
  const double motion = predictor_.turn_rad_s() * horizon_s + predictor_.speed_m_s() * horizon_s / 0.6;
  const double margin = motion < 0.002 ? 0.0 : std::min(options_.max_margin, 0.02 + 0.6 * motion);
  // The first view is wanted soon rather than sharp, and so is each of an epoch that may not last.
  changing_ = last_update_s_ < epoch_began_s_ || now_s - epoch_began_s_ < kEpochSettles_s;
  still = margin == 0 && latency_s_ > 0 && !changing_;
  if (options_.adaptive) {
    if (scale_ == 0)
      scale_ = std::clamp(std::sqrt(kFirstPixels / (double(display_->width) * display_->height)), min_scale(), 1.0);
    scale_ = std::clamp(scale_, min_scale(), 1.0);
    // A wider view is sampled as finely; a still head sees every pixel's own sample.
    const double per_pixel = scale_ * (1 + margin);
    camera.width = still ? display_->width : whole_side(display_->width * per_pixel);
    camera.height = still ? display_->height : whole_side(display_->height * per_pixel);
  } else {
    std::tie(camera.width, camera.height) = sampling_size(options_, display_->width, display_->height);
  }
  const double du = (camera.right - camera.left) * margin / 2, dv = (camera.top - camera.bottom) * margin / 2;
  camera.left -= du, camera.right += du, camera.bottom -= dv, camera.top += dv;
  return camera;
}

std::optional<wire::ViewRequest> ViewRequester::next(double now_s) {
  if (!display_ || (options_.buffers == 0 && now_s - last_sent_s_ < 1.0 / options_.max_rate_hz)) return std::nullopt;
  last_sent_s_ = now_s;
  bool still = false;
  const geometry::Camera camera = wanted(now_s, still);
  const RequestId id = next_;
  next_ = next_.next();
  open_[id] = {id,   options_.buffers ? std::min<uint64_t>(open_.size(), options_.buffers - 1) : 0, now_s, 0, 0, camera,
               still};
  while (open_.size() > kMaxOpen) open_.erase(open_.begin());
  return wire::ViewRequest{viewer_, id, camera, now_s, options_.buffers};
}

std::vector<wire::ViewRequest> ViewRequester::again(std::span<const RequestId> requests, double now_s) {
  std::vector<wire::ViewRequest> out;
  for (const RequestId id : requests) {
    const auto it = open_.find(id);
    if (it == open_.end() || !display_) continue;
    it->second.camera = wanted(now_s, it->second.still);
    out.push_back({viewer_, id, it->second.camera, now_s, options_.buffers});
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
          .complete = p.frame_complete && p.step <= 1,
          .tiles = 1,
          .points = p.kept,
          .samples = p.samples,
          .bytes = p.image.size(),
          .camera = p.camera,
          .eliminated = p.samples - std::min(p.kept, p.samples)};
}

std::optional<ViewRequester::Update> ViewRequester::on_part(const ViewPart& part, double now_s) {
  if (part.viewer != viewer_) return std::nullopt;
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
  u.complete_s = last_update_s_ = now_s;
  // The master's clock as seen from here may be set back when the connection is made anew.
  const double latency_s = std::max(now_s - u.requested_s, 1e-3);
  latency_s_ = latency_s_ == 0 ? latency_s : 0.8 * latency_s_ + 0.2 * latency_s;
  // Time goes with the number of pixels, hence the root; by small steps, since views differ. Requests that were sent
  // before it took their share.
  if (options_.adaptive && !u.still) {
    const double own_s = latency_s / double(1 + u.ahead);
    scale_ = std::clamp(scale_ * std::clamp(std::sqrt(options_.target_latency_s / own_s), 0.85, 1.1), min_scale(), 1.0);
  }
  const Update done = u;
  // Asynchronous requests before this one were replaced at the master and will never be answered; others may still be.
  open_.erase(options_.buffers ? it : open_.begin(), std::next(it));
  return done;
}

}  // namespace telesplat::viewer
