#include "tools/telesplat/scene/mesh_scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "services/data/inspect.h"
#include "services/data/kinds.h"
#include "services/sampler/mesh/sampler.h"
#include "tools/common/csv_table.h"

namespace telesplat::launcher {
namespace {

// Quotes double the text's length, numbers stand beside it.
constexpr tools::CsvTable::Limits kEpochs{.rows = 1'000'000, .line_bytes = scene::kMaxColouringText * 2 + (1 << 14)};

// Begins as the options colour it; each epoch of a record has colours of its own, and maybe another array's chunks.
class DirectMesh : public DirectScene {
 public:
  using Open = std::function<Result<std::shared_ptr<data::MeshStore>>(const std::string& array)>;

  DirectMesh(MeshScene::Epochs epochs, Open open, int threads)
      : epochs_(std::move(epochs)), open_(std::move(open)), sampler_(sampler::make_ray_sampler(threads)) {}

  // Holds the chunks of this store and no others.
  Status load(std::shared_ptr<data::MeshStore> store) {
    if (store_)
      for (const auto& c : store_->chunks()) sampler_->remove_chunk(c.id);
    store_ = std::move(store);
    std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks;
    for (const auto& c : store_->chunks()) chunks.emplace_back(c.id, store_->chunk(c.id));
    return sampler_->add_chunks(std::move(chunks));
  }
  void colour_by(const std::optional<scene::Colouring>& colouring) {
    sampler_->set_colours(colouring ? std::make_shared<const scene::ColourTable>(scene::make_table(*colouring))
                                    : nullptr);
  }

  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch,
                           double) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return sampler::render_directly(*sampler_, camera, image::Shading(shading, camera));
  }
  Result<image::DepthImage> sample_tile(const geometry::Camera& camera, const geometry::Rect& tile,
                                        const image::PixelMask* mask, EpochId epoch, double) override {
    if (const Status s = prepare(epoch); !s) return s.error();
    return sampler_->sample(camera, tile, mask);
  }
  geometry::Box box_room() const override { return store_->info().box_room; }
  uint64_t primitives() const override { return store_->info().triangles; }
  std::string size() const override { return fmt::format("{} triangles", primitives()); }

 private:
  // Frames come in order, so there is seldom another epoch than before.
  Status prepare(EpochId id) {
    if (!epochs_.told || prepared_ == id) return ok_status();
    const auto colouring = epochs_.at(id);
    if (!colouring) return colouring.error();
    const std::string array = *colouring ? (*colouring)->array : "";
    if (array != store_->info().array) {
      auto store = open_(array);
      if (!store) return store.error();
      if (const Status s = load(std::move(*store)); !s) return s;
    }
    colour_by(*colouring);
    sampler_->set_clip(epochs_.clips.at(id));
    prepared_ = id;
    return ok_status();
  }

  MeshScene::Epochs epochs_;
  Open open_;
  std::shared_ptr<data::MeshStore> store_;
  std::unique_ptr<sampler::Sampler> sampler_;
  std::optional<EpochId> prepared_;
};

Status read_epochs(const std::string& path, MeshScene::Epochs& out) {
  const auto table = tools::CsvTable::read(path, kEpochs);
  if (!table) return table.error();
  const auto epoch = table->column("epoch"), text = table->column(scene::kColouringFact);
  if (!epoch) return epoch.error();
  if (!text) return ok_status();  // a run of before meshes were coloured
  out.told = true;
  for (size_t row = 0; row < table->rows(); ++row) {
    const auto id = table->count(row, *epoch);
    if (!id) return id.error();
    if (const Status s = out.clips.read(*table, row, *id); !s) return s;
    const std::string colouring = table->text(row, *text);
    auto& at = out.by_id[*id];
    if (colouring.empty()) continue;
    auto read = scene::colouring_from_text(colouring);
    if (!read) return Error{fmt::format("{}: epoch {}: {}", path, *id, read.error().text)};
    at = *std::move(read);
  }
  return ok_status();
}

}  // namespace

Result<std::optional<scene::Colouring>> MeshScene::Epochs::at(EpochId epoch) const {
  const auto found = by_id.find(epoch.value);
  if (found != by_id.end()) return found->second;
  if (by_id.empty()) return Error{fmt::format("{}/epochs.csv: holds no epochs", directory)};
  return Error{fmt::format("{}/epochs.csv: has no epoch {}; it holds {} to {}", directory, epoch.value,
                           by_id.begin()->first, by_id.rbegin()->first)};
}

Status MeshScene::read_record(const std::string& run_directory) {
  epochs_.directory = run_directory;
  std::error_code error;
  const std::string path = run_directory + "/epochs.csv";
  const bool there = std::filesystem::exists(path, error) && std::filesystem::file_size(path, error) > 0;
  return there ? read_epochs(path, epochs_) : ok_status();
}

Result<std::unique_ptr<DirectScene>> MeshScene::open_direct(int threads, const data::Progress& progress) const {
  const data::MeshOptions options = options_.mesh_options();
  auto store = data::open_mesh(options_.scene, options, progress);
  if (!store) return store.error();
  auto begun = data::colouring_of(options, (*store)->info());
  if (!begun) return begun.error();
  const auto open = [file = options_.scene, options](const std::string& array) {
    return data::open_mesh_by(file, options, array, [](const char*, double) {});
  };
  auto out = std::make_unique<DirectMesh>(epochs_, open, threads);
  if (const Status s = out->load(std::move(*store)); !s) return s.error();
  out->colour_by(*begun);
  return std::unique_ptr<DirectScene>(std::move(out));
}

std::string MeshScene::summary(uint64_t primitives) const { return fmt::format(": {} triangles", primitives); }

Result<data::Description> MeshScene::describe_data(const data::Progress& progress) const {
  const auto facts = data::inspect_mesh(options_.scene, options_.mesh_options(), progress);
  if (!facts) return facts.error();
  return data::describe(*facts);
}

}  // namespace telesplat::launcher
