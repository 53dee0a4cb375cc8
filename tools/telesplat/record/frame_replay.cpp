#include "tools/telesplat/record/frame_replay.h"

#include <fmt/format.h>

#include <filesystem>
#include <tuple>

#include "client/viewer/points/still_picture.h"
#include "client/viewer/record/slice_record.h"
#include "client/viewer/render/renderer.h"
#include "client/viewer/render/supersampler.h"
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
    if (same_as_last(frame, camera)) {
      view.colour = last_.colour;
      return true;
    }
    const splat::SelectionOptions selection = select(frame, camera, {});
    image::ShadingParameters shading = run_.shading;
    put_into(frame.look, shading);
    render(frame, camera, shading, view);
    if (frame.refined > 0 && camera == frame.camera) refine(frame, selection, shading, view);
    keep(frame, camera, view);
    find_coverage(frame, camera, shading, view);
    return true;
  }

  Result<bool> draw_pair(const DisplayedFrame& frame, const viewer::EyePair& pair,
                         std::array<image::View, 2>& views) override {
    const auto there = models_->advance(frame);
    if (!there || !*there) return there;
    select(frame, pair.head, pair.eyes);
    image::ShadingParameters shading = run_.shading;
    put_into(frame.look, shading);
    for (size_t i = 0; i < 2; ++i) {
      fit(views[i], pair.eyes[i]);
      render(frame, pair.eyes[i], shading, views[i]);
      find_coverage(frame, pair.eyes[i], shading, views[i]);
    }
    return true;
  }

 private:
  // Selects the points of the present model that the frame drew.
  splat::SelectionOptions select(const DisplayedFrame& frame, const geometry::Camera& camera,
                                 const std::optional<std::array<geometry::Camera, 2>>& eyes) {
    splat::SelectionOptions selection;
    selection.scale = run_.splat_scale_of(frame.look.render.kernel);
    selection.detail = float(frame.detail);
    selection.best_patch_only = run_.keeps_redundant;
    selection.eyes = eyes;
    const geometry::Camera drawn = frame.look.render.halved ? geometry::half_size(camera) : camera;
    splat::select_view(*models_->model(), drawn, selection, list_, &models_->summaries());
    list_.base = models_->base();
    list_.applied = models_->applied();
    list_.replica = models_->replica() + 1;
    list_.epoch = frame.epoch;
    return selection;
  }

  void find_coverage(const DisplayedFrame& frame, const geometry::Camera& camera, image::ShadingParameters shading,
                     image::View& view) {
    if (!run_.transparent) return;
    fit(over_white_, camera);
    shading.background = 0xffffff;
    render(frame, camera, shading, over_white_);
    image::find_coverage(over_white_, view);
  }

  // A head that stands still leaves many equal frames, and each takes up to a second to draw.
  bool same_as_last(const DisplayedFrame& frame, const geometry::Camera& camera) const {
    const DisplayedFrame& last = last_frame_;
    const auto look = [](const viewer::Look& l) {
      return std::tuple(l.render.kernel, splat::finish_bits(l.render.finish), l.lit, l.head_light, l.background);
    };
    return frame.refined > 0 && last.refined == frame.refined && last.sequence == frame.sequence &&
           last.replica == frame.replica && last.summaries == frame.summaries && last.epoch == frame.epoch &&
           last.sub_pixels == frame.sub_pixels && camera == last_camera_ && look(last.look) == look(frame.look);
  }
  void keep(const DisplayedFrame& frame, const geometry::Camera& camera, const image::View& view) {
    last_frame_ = frame;
    last_camera_ = camera;
    if (frame.refined > 0) last_.colour = view.colour;
  }

  // Refines as many tiles as the display had, in its order. Points that had just come made tiles wait there; here they
  // are ready.
  void refine(const DisplayedFrame& frame, const splat::SelectionOptions& selection,
              const image::ShadingParameters& parameters, image::View& view) {
    constexpr double kRounding = 1e-4;
    const image::Shading shading(parameters, frame.camera);
    viewer::Supersampler supersampler(*renderer_, frame.sub_pixels);
    const viewer::Supersampler::Scene scene{
        [&](const geometry::Camera& camera, const splat::SelectionOptions& options, splat::DrawList& list) {
          splat::select_view(*models_->model(), camera, options, list, &models_->summaries());
          list.base = models_->base();
          list.applied = list_.applied;
          list.replica = list_.replica;
          list.epoch = list_.epoch;
        },
        selection, frame.look.render, shading, &models_->fine_rays()};
    still_.begin(frame.camera);
    while (still_.share() < frame.refined - kRounding) {
      const auto tile = still_.next(0);
      if (!tile) break;
      still_.done(
          *tile,
          supersampler.draw(scene, frame.camera, still_.rect(*tile), still_.pixels(*tile), size_t(frame.camera.width)),
          0);
    }
    still_.put_over(view);
  }

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
  viewer::StillPicture still_;
  DisplayedFrame last_frame_;
  geometry::Camera last_camera_;
  image::View last_;
};

class SliceFrameReplay final : public FrameReplay {
 public:
  SliceFrameReplay(std::unique_ptr<viewer::SliceReplay> slices, std::unique_ptr<viewer::VolumeRenderer> renderer)
      : slices_(std::move(slices)), renderer_(std::move(renderer)) {}

  Result<bool> draw(const DisplayedFrame& frame, const geometry::Camera& camera, image::View& view) override {
    const auto there = slices_->advance({frame.sequence.value}, frame.replica);
    if (!there || !*there) return there;
    draw_now(frame, camera, view);
    return true;
  }

  Result<bool> draw_pair(const DisplayedFrame& frame, const viewer::EyePair& pair,
                         std::array<image::View, 2>& views) override {
    const auto there = slices_->advance({frame.sequence.value}, frame.replica);
    if (!there || !*there) return there;
    for (size_t i = 0; i < 2; ++i) draw_now(frame, pair.eyes[i], views[i]);
    return true;
  }

 private:
  void draw_now(const DisplayedFrame& frame, const geometry::Camera& camera, image::View& view) {
    fit(view, camera);
    renderer_->render(slices_->frame(), camera, frame.look.background,
                      {camera.width, camera.height, view.colour.data(), nullptr});
  }

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
  return std::unique_ptr<FrameReplay>(new SliceFrameReplay(std::move(*slices), std::move(*drawn_by)));
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
