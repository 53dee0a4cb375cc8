#include "tools/telesplat/bench/steering/comparison.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <sstream>

#include "common/image/measures/quality.h"
#include "common/net/service.h"
#include "tools/telesplat/bench/steering/pictures.h"

namespace telesplat::launcher {
namespace {

constexpr EpochId kEpoch{1};
constexpr double kFrame_s = 1.0 / 60;  // of the display
// A display draws still pictures with sub-pixels, tile by tile, once it has the time: from here on it has.
constexpr double kRefined_s = 0.5;
constexpr std::array<double, 4> kStillTimes_s{0.2, 1, 2, 5};

std::vector<std::string> split(const std::string& modes) {
  std::vector<std::string> out;
  std::istringstream list(modes);
  for (std::string name; std::getline(list, name, ',');) out.push_back(name);
  return out;
}

SteeredSessionConfig config_of(const SteeringBenchOptions& o, const std::string& mode, const geometry::Box& box) {
  SteeredSessionConfig out;
  out.name = mode;
  out.steering = mode != "off";
  out.plan.model = {box, points::ModelConfig{}.depth, true};
  out.plan.view_cell_m = mode == "no-cell" ? 0 : o.view_cell_m;
  out.plan.validation = o.validation;
  out.plan.still_rays = o.still_rays;
  out.plan.threads = o.threads;
  out.render.kernel = *splat::kernel_named(o.splat);
  return out;
}

}  // namespace

Status check_modes(const std::string& modes) {
  for (const auto& name : split(modes))
    if (name != "off" && name != "on" && name != "no-cell")
      return Error{fmt::format("--modes {}: {} is none of off, on, no-cell", modes, name)};
  return split(modes).empty() ? Status(Error{"--modes: names none of off, on, no-cell"}) : ok_status();
}

SteeringComparison::SteeringComparison(const SteeringBenchOptions& options, std::string scene_name, DirectScene& scene,
                                       const Walk& walk, std::pair<int, int> size, const TimingConfig& timing)
    : o_(options),
      scene_(scene),
      walk_(walk),
      size_(size),
      walk_s_(options.duration_s > 0 ? options.duration_s : walk.length_s()),
      scene_name_(std::move(scene_name)) {
  TimedSession::Audit audit;
  if (o_.audit) audit = [this](const geometry::Camera& camera) { return scene_.sample(camera, kEpoch); };
  for (const auto& mode : split(o_.modes)) {
    sessions_.push_back(std::make_unique<TimedSession>(
        std::make_unique<SteeredSession>(config_of(o_, mode, scene.box_room()), scene), timing, audit));
    reports_.push_back({scene_name_, mode, {}, {}});
  }
}

// The head stands where it was at the end of the walk.
geometry::Camera SteeringComparison::camera_at(double t_s) const {
  return geometry::make_camera(walk_.at(std::min(t_s, walk_s_ * (1 - 1e-9))), o_.fov_deg, size_.first, size_.second);
}

Result<std::vector<ModeReport>> SteeringComparison::run(const std::function<void(double, double)>& progress) {
  const double end_s = walk_s_ + o_.hold_s;
  size_t still_done = 0;
  for (int i = 0; i * kFrame_s < end_s && !net::stop_requested(); ++i) {
    const double t = i * kFrame_s;
    progress(t, end_s);
    for (const auto& session : sessions_)
      if (const Status s = session->display(t, camera_at(t)); !s) return s.error();
    if (t < walk_s_) {
      if (const Status s = sample_walk(t); !s) return s.error();
    } else if (still_done < kStillTimes_s.size() && t - walk_s_ + kFrame_s >= kStillTimes_s[still_done]) {
      if (const Status s = compare(t, kStillTimes_s[still_done++]); !s) return s.error();
    }
  }
  for (size_t i = 0; i < sessions_.size(); ++i) {
    reports_[i].views = sessions_[i]->views();
    for (ViewCost& v : reports_[i].views) v.still = v.t_s >= walk_s_;
  }
  return reports_;
}

// The first views are there before the first comparison.
Status SteeringComparison::sample_walk(double t_s) {
  if (t_s >= next_compare_s_) {
    next_compare_s_ += o_.compare_every_s;
    if (const Status s = compare(t_s, -1); !s) return s;
  }
  if (o_.pictures > 0 && !o_.out.empty() && t_s >= next_picture_s_) {
    next_picture_s_ += walk_s_ / o_.pictures;
    return picture(t_s);
  }
  return ok_status();
}

Status SteeringComparison::compare(double t_s, double still_s) {
  const geometry::Camera camera = camera_at(t_s);
  const image::ShadingParameters lit;
  const auto fine = scene_.draw_reference(camera, lit, kEpoch, o_.reference_samples);
  if (!fine) return fine.error();
  const auto one = scene_.draw(camera, lit, kEpoch);
  if (!one) return one.error();
  std::vector<image::View> drawn;
  for (size_t i = 0; i < sessions_.size(); ++i) {
    const image::View& view = sessions_[i]->session().draw(camera, still_s >= kRefined_s);
    const auto coarse = image::compare(*one, view);
    const auto quality = image::compare(*fine, view);
    if (quality.object_pixels > 0)
      reports_[i].quality.push_back({t_s, still_s, coarse.psnr_db, coarse.hole_fraction, quality.psnr_db,
                                     quality.hole_fraction, quality.ssim, image::flip(*fine, view)});
    if (!o_.out.empty()) drawn.push_back(view);
  }
  if (o_.out.empty() || still_s < 0) return ok_status();
  std::vector<std::string> names;
  for (const auto& s : sessions_) names.push_back(s->session().name());
  return write_still_sheet(fmt::format("{}/{}-still-{:.1f}s.png", o_.out, file_stem(scene_name_), still_s), *fine,
                           drawn, names);
}

Status SteeringComparison::picture(double t_s) {
  for (const auto& timed : sessions_) {
    SteeredSession& session = timed->session();
    if (!timed->newest()) continue;
    // What came of its newest view, seen from there.
    const geometry::Camera& camera = timed->newest()->camera;
    const auto truth = scene_.draw(camera, image::ShadingParameters{}, kEpoch);
    if (!truth) return truth.error();
    const std::string path = fmt::format("{}/{}-{}-{:05.2f}s.png", o_.out, file_stem(scene_name_), session.name(), t_s);
    const Status s = write_plan_sheet(path, *truth, session.draw(camera, false), session.cast(), session.needed());
    if (!s) return s;
  }
  return ok_status();
}

}  // namespace telesplat::launcher
