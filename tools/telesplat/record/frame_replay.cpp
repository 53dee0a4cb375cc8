#include "tools/telesplat/record/frame_replay.h"

#include <fmt/format.h>

#include <filesystem>

#include "client/viewer/record/slice_record.h"
#include "client/viewer/render/renderer.h"
#include "client/viewer/render/slices/renderer.h"
#include "common/image/background.h"

namespace telesplat::launcher {
namespace {

void fit(image::View& view, const geometry::Camera& camera) {
  view.width = camera.width;
  view.height = camera.height;
  view.colour.resize(size_t(camera.width) * size_t(camera.height));
  view.depth_m.clear();
}

class PointReplay final : public FrameReplay {
 public:
  PointReplay(const RecordedRun& run, std::unique_ptr<ModelReplay> models, std::unique_ptr<viewer::Renderer> renderer)
      : run_(run), models_(std::move(models)), renderer_(std::move(renderer)) {}

  Result<bool> draw(const DisplayedFrame& frame, const geometry::Camera& camera, image::View& view) override {
    const auto there = models_->advance(frame);
    if (!there || !*there) return there;
    fit(view, camera);
    splat::SelectionOptions selection;
    selection.scale = run_.splat_scale_of(frame.look.render.kernel);
    selection.detail = float(frame.detail);
    selection.best_patch_only = run_.keeps_redundant;
    splat::select_view(*models_->model(), camera, selection, list_, &models_->summaries());
    list_.applied = models_->applied();
    list_.replica = models_->replica() + 1;
    list_.epoch = frame.epoch;
    image::ShadingParameters shading = run_.shading;
    shading.lit = frame.look.lit;
    render(frame, camera, shading, view);
    if (!run_.transparent) return true;
    fit(over_white_, camera);
    shading.background = 0xffffff;
    render(frame, camera, shading, over_white_);
    image::find_coverage(over_white_, view);
    return true;
  }

 private:
  void render(const DisplayedFrame& frame, const geometry::Camera& camera, const image::ShadingParameters& shading,
              image::View& view) {
    renderer_->render(list_, camera, frame.look.render, image::Shading(shading, camera),
                      {camera.width, camera.height, view.colour.data(), nullptr});
  }

  const RecordedRun& run_;
  std::unique_ptr<ModelReplay> models_;
  std::unique_ptr<viewer::Renderer> renderer_;
  splat::DrawList list_;
  image::View over_white_;
};

class SliceFrameReplay final : public FrameReplay {
 public:
  SliceFrameReplay(const RecordedRun& run, std::unique_ptr<viewer::SliceReplay> slices,
                   std::unique_ptr<viewer::VolumeRenderer> renderer)
      : run_(run), slices_(std::move(slices)), renderer_(std::move(renderer)) {}

  Result<bool> draw(const DisplayedFrame& frame, const geometry::Camera& camera, image::View& view) override {
    const auto there = slices_->advance({frame.sequence.value}, frame.replica);
    if (!there || !*there) return there;
    fit(view, camera);
    renderer_->render(slices_->frame(), camera, run_.shading.background,
                      {camera.width, camera.height, view.colour.data(), nullptr});
    return true;
  }

 private:
  const RecordedRun& run_;
  std::unique_ptr<viewer::SliceReplay> slices_;
  std::unique_ptr<viewer::VolumeRenderer> renderer_;
};

Result<std::unique_ptr<FrameReplay>> replay_points(const RecordedRun& run, const std::string& renderer, int threads) {
  auto models = ModelReplay::open(record_path(run), true);
  if (!models) return models.error();
  auto drawn_by = viewer::make_renderer(renderer, threads);
  if (!drawn_by) return drawn_by.error();
  return std::unique_ptr<FrameReplay>(new PointReplay(run, std::move(*models), std::move(*drawn_by)));
}

Result<std::unique_ptr<FrameReplay>> replay_slices(const RecordedRun& run, const std::string& renderer, int threads) {
  auto slices = viewer::SliceReplay::open(record_path(run));
  if (!slices) return slices.error();
  auto drawn_by = viewer::make_volume_renderer(renderer, threads);
  if (!drawn_by) return drawn_by.error();
  return std::unique_ptr<FrameReplay>(new SliceFrameReplay(run, std::move(*slices), std::move(*drawn_by)));
}

}  // namespace

Result<std::unique_ptr<ModelReplay>> ModelReplay::open(const std::string& path, bool with_summaries) {
  auto events = viewer::EventReplay::open(path, with_summaries);
  if (!events) return events.error();
  return std::unique_ptr<ModelReplay>(new ModelReplay(std::move(*events)));
}

Result<bool> ModelReplay::advance(const DisplayedFrame& frame) {
  for (; replica_ < frame.replica; ++replica_)
    if (const Status s = events_->next_replica(); !s) return s.error();
  if (const Status s = events_->advance({frame.sequence, frame.summaries}); !s) return s.error();
  return events_->model() && events_->applied() == frame.sequence;
}

std::string record_path(const RecordedRun& run) {
  const bool points = run.scene->pipeline() == scene::Pipeline::kPoints;
  return run.directory + (points ? "/points.events" : "/slices.events");
}

Result<std::unique_ptr<FrameReplay>> FrameReplay::open(const RecordedRun& run, const std::string& renderer,
                                                       int threads) {
  std::error_code error;
  if (const std::string path = record_path(run); !std::filesystem::is_regular_file(path, error))
    return Error{fmt::format(
        "{}: is not there, so what the frames showed cannot be made again; it is kept unless --record-points is 0",
        path)};
  return run.scene->pipeline() == scene::Pipeline::kPoints ? replay_points(run, renderer, threads)
                                                           : replay_slices(run, renderer, threads);
}

}  // namespace telesplat::launcher
