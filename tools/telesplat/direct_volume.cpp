#include <fmt/format.h>

#include <optional>

#include "common/volume/session.h"
#include "services/sampler/volume_raycaster.h"
#include "tools/telesplat/direct_scene.h"

namespace telesplat::launcher {
namespace {

class DirectVolume : public DirectScene {
 public:
  DirectVolume(RecordedVolume recorded, std::unique_ptr<data::VolumeStore> store, int threads)
      : recorded_(std::move(recorded)), store_(std::move(store)), threads_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading,
                           EpochId epoch) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return raycaster_->draw(camera, shading.background);
  }
  Result<image::DepthImage> sample(const geometry::Camera&, EpochId) override {
    return Error{fmt::format("{}: is a volume, of which no depth images are sampled", recorded_.file)};
  }
  bool translucent() const override { return true; }
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
