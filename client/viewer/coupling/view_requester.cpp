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

std::optional<wire::ViewRequest> ViewRequester::next(double now_s) {
  if (!display_ || now_s - last_sent_s_ < 1.0 / options_.max_rate_hz) return std::nullopt;
  last_sent_s_ = now_s;
  const double horizon_s = latency_s_ > 0 ? latency_s_ : options_.initial_latency_s;
  geometry::Camera camera = *display_;
  camera.pose = predictor_.predict(now_s + horizon_s);
  // The faster the head, the wider the view that is sampled; a still head gets exactly what it looks at.
  const double motion = predictor_.turn_rad_s() * horizon_s + predictor_.speed_m_s() * horizon_s / 0.6;
  const double margin = motion < 0.002 ? 0.0 : std::min(options_.max_margin, 0.02 + 0.6 * motion);
  // The first view is wanted soon rather than sharp, and so is each of an epoch that may not last.
  changing_ = last_update_s_ < epoch_began_s_ || now_s - epoch_began_s_ < kEpochSettles_s;
  const bool still = margin == 0 && latency_s_ > 0 && !changing_;
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
  const RequestId id = next_;
  next_ = next_.next();
  open_[id] = {id, now_s, 0, 0, camera, still};
  while (open_.size() > kMaxOpen) open_.erase(open_.begin());
  return wire::ViewRequest{viewer_, id, camera, now_s};
}

std::optional<ViewRequester::Update> ViewRequester::on_applied(const wire::Patch& patch, double now_s) {
  if (patch.viewer != viewer_) return std::nullopt;
  const auto it = open_.find(patch.request);
  if (it == open_.end()) return std::nullopt;
  Update& u = it->second;
  if (u.tiles++ == 0) u.first_s = now_s;
  u.points += patch.kept;
  u.samples += patch.samples;
  u.bytes += patch.image.size();
  if (!patch.frame_complete || patch.step > 1) return std::nullopt;
  u.complete_s = last_update_s_ = now_s;
  // The master's clock as seen from here may be set back when the connection is made anew.
  const double latency_s = std::max(now_s - u.requested_s, 1e-3);
  latency_s_ = latency_s_ == 0 ? latency_s : 0.8 * latency_s_ + 0.2 * latency_s;
  // Time goes with the number of pixels, hence the root; by small steps, since views differ.
  if (options_.adaptive && !u.still)
    scale_ =
        std::clamp(scale_ * std::clamp(std::sqrt(options_.target_latency_s / latency_s), 0.85, 1.1), min_scale(), 1.0);
  const Update done = u;
  // Requests before this one were replaced at the master and will never be answered.
  open_.erase(open_.begin(), std::next(it));
  return done;
}

}  // namespace telesplat::viewer
