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
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

// Quotes double the text's length, numbers stand beside it.
constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = volume::kMaxTransferText * 2 + (1 << 14)};

class DirectVolume : public DirectScene {
 public:
  DirectVolume(std::string file, VolumeScene::Epochs epochs, std::unique_ptr<data::VolumeStore> store, int threads)
      : file_(std::move(file)), epochs_(std::move(epochs)), store_(std::move(store)), threads_(threads) {}

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch,
                           double) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return raycaster_->draw(camera, shading.background);
  }
  bool has_surface() const override { return false; }
  // Depth 1 where the volume covers the picture visibly, and none elsewhere, whatever the background.
  void mark_shown(image::View& view) const override {
    constexpr uint32_t kVisible = 3;  // steps of 255
    view.depth_m.assign(view.colour.size(), std::numeric_limits<float>::infinity());
    for (size_t i = 0; i < view.colour.size(); ++i)
      if (view.colour[i] >> 24 >= kVisible) view.depth_m[i] = 1;
  }
  Result<image::DepthImage> sample(const geometry::Camera&, EpochId) override {
    return Error{fmt::format("{}: is a volume, of which no depth images are sampled", file_)};
  }
  geometry::Box box_room() const override { return store_->session().grid.box_room(); }
  std::string size() const override {
    const auto& n = store_->session().grid.size;
    return fmt::format("{} x {} x {} voxels", n[0], n[1], n[2]);
  }

 private:
  // Frames come in order, so there is seldom another epoch than before.
  Status prepare(EpochId id) {
    if (prepared_ == id && raycaster_) return ok_status();
    const auto epoch = epochs_.at(id);
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
        session.grid, *voxels, volume::level_colours(*transfer, session.levels), threads_, epochs_.clips.at(id));
    prepared_ = id;
    return ok_status();
  }

  std::string file_;
  VolumeScene::Epochs epochs_;
  std::unique_ptr<data::VolumeStore> store_;
  int threads_;
  EpochId prepared_;
  std::unique_ptr<sampler::VolumeRaycaster> raycaster_;
};

Status read_epochs(const std::string& path, VolumeScene::Epochs& out) {
  const auto table = tools::CsvTable::read(path, kEpochs);
  if (!table) return table.error();
  const auto epoch = table->column("epoch"), step = table->column("volume.step"), transfer = table->column("transfer");
  for (const auto* column : {&epoch, &step, &transfer})
    if (!*column) return column->error();
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto id = table->count(row, *epoch), at = table->count(row, *step, volume::kMaxSteps);
    if (!id) return id.error();
    if (!at) return at.error();
    if (const Status s = out.clips.read(*table, row, *id); !s) return s;
    out.by_id[*id] = {table->text(row, *transfer), int(*at)};
  }
  return ok_status();
}

}  // namespace

Result<VolumeScene::Epoch> VolumeScene::Epochs::at(EpochId epoch) const {
  if (by_id.empty()) return Epoch{};
  const auto found = by_id.find(epoch.value);
  if (found != by_id.end()) return found->second;
  return Error{fmt::format("{}/epochs.csv: has no epoch {}; it holds {} to {}", directory, epoch.value,
                           by_id.begin()->first, by_id.rbegin()->first)};
}

Status VolumeScene::check() const {
  const auto found = data::find_volume(options_.scene, options_.volume);
  return found ? ok_status() : Status(found.error());
}

Status VolumeScene::read_record(const std::string& run_directory) {
  epochs_.directory = run_directory;
  std::error_code error;
  const std::string path = run_directory + "/epochs.csv";
  return std::filesystem::exists(path, error) ? read_epochs(path, epochs_) : ok_status();
}

Result<std::unique_ptr<DirectScene>> VolumeScene::open_direct(int threads, const data::Progress& progress) const {
  auto store = data::VolumeStore::open(options_.scene, options_.volume, options_.mesh, progress);
  if (!store) return store.error();
  return std::unique_ptr<DirectScene>(
      std::make_unique<DirectVolume>(options_.scene, epochs_, std::move(*store), threads));
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
