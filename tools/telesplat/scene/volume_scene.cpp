#include "tools/telesplat/scene/volume_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <set>

#include "common/volume/session.h"
#include "services/data/inspect.h"
#include "services/data/volume/store.h"
#include "services/sampler/volume/raycaster.h"

namespace telesplat::launcher {
namespace {

class DirectVolume : public DirectScene {
 public:
  DirectVolume(Epochs<VolumeScene::Epoch> epochs, std::unique_ptr<data::VolumeStore> store, int threads)
      : epochs_(std::move(epochs)), store_(std::move(store)), threads_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch,
                           double) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return raycaster_->draw(camera, shading.background);
  }
  bool has_surface() const override { return false; }
  // Depth 1 where the volume is visible, none elsewhere, on any background.
  void mark_shown(image::View& view) const override {
    constexpr uint32_t kVisible = 3;  // steps of 255
    view.depth_m.assign(view.colour.size(), std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < view.colour.size(); ++i)
      if (view.colour[i] >> 24 >= kVisible) view.depth_m[i] = 1;
  }
  std::string size() const override {
    const auto& n = store_->session().grid.size;
    return fmt::format("{} x {} x {} voxels", n[0], n[1], n[2]);
  }

 private:
  // Frames come in order: the epoch seldom changes.
  Status prepare(EpochId id) {
    if (prepared_ == id && raycaster_) return ok_status();
    const auto epoch = epochs_.at(id, {});
    if (!epoch) return epoch.error();
    const volume::Session& session = store_->session();
    auto transfer = Result<volume::TransferFunction>(session.transfer);
    if (!epoch->transfer.empty()) transfer = volume::parse_transfer(epoch->transfer, session.range);
    if (!transfer)
      return Error{fmt::format("{}/epochs.csv: epoch {}: {}", epochs_.directory, id.value, transfer.error().text)};
    raycaster_.reset();
    const auto voxels = store_->voxels(epoch->step, 0, session.grid.size[2],
                                       data::shown_levels(*transfer, session.levels), volume::LevelSet());
    if (!voxels) return voxels.error();
    raycaster_ = std::make_unique<sampler::VolumeRaycaster>(
        session.grid, *voxels, volume::level_colours(*transfer, session.levels), threads_, epochs_.clip_at(id));
    prepared_ = id;
    return ok_status();
  }

  Epochs<VolumeScene::Epoch> epochs_;
  std::unique_ptr<data::VolumeStore> store_;
  int threads_;
  EpochId prepared_;
  std::unique_ptr<sampler::VolumeRaycaster> raycaster_;
};

}  // namespace

Status VolumeScene::check() const {
  const auto found = data::find_volume(options_.scene, options_.volume);
  return found ? ok_status() : Status(found.error());
}

Status VolumeScene::read_record(const std::string& run_directory) {
  epochs_.directory = run_directory;
  return read_epochs(run_directory, {"epoch", "volume.step", "transfer"}, [&](uint64_t epoch, tools::CsvRow& row) {
    read_clip(epoch, row, epochs_.clips);
    epochs_.by_id[epoch] = {row.text("transfer"), int(row.count("volume.step", volume::kMaxSteps))};
    return ok_status();
  });
}

Result<std::unique_ptr<DirectScene>> VolumeScene::open_direct(int threads, const data::Progress& progress) const {
  auto store = data::VolumeStore::open(options_.scene, options_.volume, options_.mesh, progress);
  if (!store) return store.error();
  return std::unique_ptr<DirectScene>(std::make_unique<DirectVolume>(epochs_, std::move(*store), threads));
}

std::string VolumeScene::summary(uint64_t primitives) const {
  constexpr size_t kShort = 60;  // a transfer function of many points is long
  std::string transfer = options_.volume.transfer.empty() ? "of the preset that fits (telesplat inspect names it)"
                                                          : options_.volume.transfer;
  if (transfer.size() > kShort) transfer = transfer.substr(0, kShort) + "...";
  std::set<int> steps;
  for (const auto& [id, epoch] : epochs_.by_id) steps.insert(epoch.step);
  return fmt::format(": {} voxels, transfer function {}{}", primitives, transfer,
                     steps.size() > 1 ? fmt::format(", {} steps shown", steps.size()) : "");
}

Result<data::Description> VolumeScene::describe_data(const data::Progress& progress) const {
  const auto facts = data::inspect_volume(options_.scene, options_.volume, options_.mesh, progress);
  if (!facts) return facts.error();
  return data::describe(*facts);
}

}  // namespace telesplat::launcher
