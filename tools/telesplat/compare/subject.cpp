#include "tools/telesplat/compare/subject.h"

#include <fmt/format.h>

#include <filesystem>

#include "client/viewer/display/size_text.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/run_folder.h"
#include "tools/telesplat/record/dated_folder.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr int kPosesOfARun = 4;

// A data file, seen as a window shows it first.
Result<CompareSubject> find_scene(const CompareOptions& o) {
  if (!o.frames.empty() || o.poses > 1)
    return Error{fmt::format("{}: is a data file, which has one pose; --poses and --frames need a run folder", o.path)};
  const auto size = viewer::parse_size(o.size, "--size");
  if (!size) return size.error();
  data::DataOptions data = o.data;
  data.scene = o.path;
  auto scene = scene_of(data);
  if (!scene) return scene.error();
  CompareSubject s;
  s.scene = std::move(*scene);
  s.octree_depth = o.octree_depth;
  s.out = o.out.empty() ? dated_folder("compare-") : o.out;
  DisplayedFrame frame;
  frame.camera = geometry::make_camera({}, o.fov_deg, size->first, size->second, o.near_m);
  s.frames.push_back(frame);
  s.first_view = true;
  return s;
}

Status refuse_what_no_points_show(const CompareOptions& o, const Scene& scene) {
  if (scene.pipeline() == scene::Pipeline::kPoints) return ok_status();
  return Error{fmt::format("{}: shows {}, which is not drawn from points; telesplat run --verify compares its frames",
                           o.path, scene::described(scene.kind()))};
}

// The scene of a run, where its data lie now.
Status settle_scene(const CompareOptions& o, Scene& scene) {
  if (!o.moved.empty())
    if (const Status s = scene.move_to(o.moved); !s) return s;
  if (scene.options().scene.empty() && !scene.check())
    return Error{fmt::format("{}/session.toml: does not tell where the data is (key file of [scene]); --scene names it",
                             o.path)};
  const Status there = scene.check();
  if (there || !o.moved.empty()) return there;
  return Error{there.error().text + "; if it was moved, --scene tells where to"};
}

Result<CompareSubject> find_run(const CompareOptions& o) {
  auto run = read_recorded_run(o.path);
  if (!run) return run.error();
  if (const Status s = refuse_what_no_points_show(o, *run->scene); !s) return s.error();
  CompareSubject s;
  std::error_code error;
  if (!o.still) {
    s.events = o.path + "/points.events";
    if (!fs::is_regular_file(s.events, error))
      return Error{
          fmt::format("{}: is not there, so what the frames showed cannot be made again; telesplat run keeps it unless "
                      "it is given --record-points 0 (--still samples the poses anew)",
                      s.events)};
  }
  if (const Status safe = metrics::refuse_links(o.path, metrics::Logs::kOurs); o.out.empty() && !safe)
    return safe.error();
  run->scene->use_cache_of(o.data);
  if (const Status settled = settle_scene(o, *run->scene); !settled) return settled.error();
  s.octree_depth = run->octree_depth;
  s.shading = run->shading;
  s.best_patch_only = run->keeps_redundant;
  s.sampling = run->sampling_size;
  s.out = o.out.empty() ? o.path + (o.still ? "/compare-still" : "/compare") : o.out;
  auto frames = choose_frames(*run, o.poses ? o.poses : o.still ? 1 : kPosesOfARun, o.frames);
  if (!frames) return frames.error();
  s.frames = std::move(*frames);
  s.scene = std::move(run->scene);
  return s;
}

}  // namespace

Result<CompareSubject> find_subject(const CompareOptions& o) {
  std::error_code error;
  if (!fs::exists(o.path, error)) return Error{fmt::format("{}: no such file or folder", o.path)};
  const bool folder = fs::is_directory(o.path, error);
  if (!folder && !o.still)
    return Error{fmt::format("{}: is not a run folder; a data file can be compared with --still", o.path)};
  if (!o.still && o.magnify != 1) return Error{fmt::format("--magnify {}: needs --still", o.magnify)};
  auto subject = folder ? find_run(o) : find_scene(o);
  if (!subject) return subject;
  if (o.still) {
    const auto& c = subject->frames.front().camera;
    subject->sampling =
        fmt::format("{}x{}, each pose anew", std::max(1, c.width / o.magnify), std::max(1, c.height / o.magnify));
  }
  return subject;
}

Result<std::unique_ptr<PoseModels>> PoseModels::open(const CompareSubject& subject, int magnify, DirectScene& scene) {
  std::unique_ptr<PoseModels> out(new PoseModels(subject, magnify, scene));
  if (subject.events.empty()) return out;
  auto events = ModelReplay::open(subject.events, false);
  if (!events) return events.error();
  out->events_ = std::move(*events);
  return out;
}

Result<const points::PointModel*> PoseModels::replay(const DisplayedFrame& frame) {
  const auto there = events_->advance(frame);
  if (!there) return there.error();
  applied_ = events_->applied();
  if (!*there)
    return Error{fmt::format(
        "{}: ends at event {}, frame {} displayed event {}; --frames chooses earlier frames, and telesplat run "
        "--record-points keeps more",
        subject_.events, applied_.value, frame.number, frame.sequence.value)};
  return events_->model();
}

Result<const points::PointModel*> PoseModels::of(const DisplayedFrame& frame) {
  if (events_) return replay(frame);
  geometry::Camera sampling = frame.camera;
  sampling.width = std::max(1, sampling.width / magnify_);
  sampling.height = std::max(1, sampling.height / magnify_);
  const geometry::Rect whole{0, 0, sampling.width, sampling.height};
  const points::ModelConfig config{scene_.box_room(), subject_.octree_depth, !subject_.best_patch_only};
  if (const Status s = points::validate(config); !s)
    return Error{fmt::format("{}: {}", subject_.name(), s.error().text)};
  auto image = scene_.sample(sampling, frame.epoch);
  if (!image) return image.error();
  sampled_ = std::make_unique<points::PointModel>(config);
  applied_ = {1};
  sampled_->insert(points::prepare_patch(config, applied_, sampling, whole, std::move(*image)));
  return sampled_.get();
}

}  // namespace telesplat::launcher
