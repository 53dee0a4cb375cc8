#include <fmt/format.h>

#include <cstdlib>
#include <limits>

#include "common/volume/session.h"
#include "services/sampler/volume/raycaster.h"
#include "tools/telesplat/scene/direct_scene.h"

namespace telesplat::launcher {
namespace {

// The picture with depth 1 where it differs visibly from the background, and none elsewhere.
image::View with_outline(image::View view, uint32_t background) {
  constexpr int kVisible = 3;  // steps of 255
  view.depth_m.assign(view.colour.size(), std::numeric_limits<float>::infinity());
  for (size_t i = 0; i < view.colour.size(); ++i)
    for (const int shift : {0, 8, 16})
      if (std::abs(int(view.colour[i] >> shift & 255) - int(background >> shift & 255)) >= kVisible)
        view.depth_m[i] = 1;
  return view;
}

class DirectVolume : public DirectScene {
 public:
  DirectVolume(RecordedVolume recorded, std::unique_ptr<data::VolumeStore> store, int threads)
      : recorded_(std::move(recorded)), store_(std::move(store)), threads_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                           EpochId epoch) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return raycaster_->draw(camera, shading.background);
  }
  // A volume has no surface: it shows where the picture is not the background.
  image::Quality compare(const image::View& reference, const image::View& view,
                         const image::ShadingParameters& shading) const override {
    return image::compare(with_outline(reference, shading.background), with_outline(view, shading.background));
  }
  Result<image::DepthImage> sample(const geometry::Camera&, EpochId) override {
    return Error{fmt::format("{}: is a volume, of which no depth images are sampled", recorded_.file)};
  }
  geometry::Box box_room() const override { return store_->session().grid.box_room(); }
  uint64_t primitives() const override { return 0; }
  std::string size() const override {
    const auto& n = store_->session().grid.size;
    return fmt::format("{} x {} x {} voxels", n[0], n[1], n[2]);
  }

 private:
  // Frames come in order, so that there is seldom another epoch than before.
  Status prepare(EpochId id) {
    if (prepared_ == id && raycaster_) return ok_status();
    const auto epoch = recorded_.at(id);
    if (!epoch) return epoch.error();
    const volume::Session& session = store_->session();
    auto transfer = Result<volume::TransferFunction>(session.transfer);
    if (!epoch->transfer.empty()) transfer = volume::parse_transfer(epoch->transfer, session.range);
    if (!transfer)
      return Error{fmt::format("{}/epochs.csv: epoch {}: {}", recorded_.directory, id.value, transfer.error().text)};
    raycaster_.reset();
    const auto voxels = store_->voxels(epoch->step, 0, session.grid.size[2],
                                       data::shown_levels(*transfer, session.levels), volume::LevelSet());
    if (!voxels) return voxels.error();
    raycaster_ = std::make_unique<sampler::VolumeRaycaster>(session.grid, *voxels,
                                                            volume::level_colours(*transfer, session.levels), threads_);
    prepared_ = id;
    return ok_status();
  }

  RecordedVolume recorded_;
  std::unique_ptr<data::VolumeStore> store_;
  int threads_;
  EpochId prepared_;
  std::unique_ptr<sampler::VolumeRaycaster> raycaster_;
};

}  // namespace

Result<std::unique_ptr<DirectScene>> open_direct_volume(RecordedVolume recorded, int threads,
                                                        const std::function<void(const char*, double)>& progress) {
  auto store = data::VolumeStore::open(recorded.file, recorded.options, recorded.mesh, progress);
  if (!store) return store.error();
  return std::unique_ptr<DirectScene>(std::make_unique<DirectVolume>(std::move(recorded), std::move(*store), threads));
}

}  // namespace telesplat::launcher
