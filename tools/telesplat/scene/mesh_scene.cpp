#include "tools/telesplat/scene/mesh_scene.h"

#include <fmt/format.h>

#include <filesystem>
#include <functional>

#include "services/data/inspect.h"
#include "services/data/kinds.h"
#include "services/sampler/mesh/sampler.h"

namespace telesplat::launcher {
namespace {

// Begins with the options' colours; each epoch of a record has its own, and maybe another array's chunks.
class DirectMesh : public DirectScene {
 public:
  using Open = std::function<Result<std::shared_ptr<data::MeshStore>>(const std::string& array)>;

  DirectMesh(MeshScene::Colours epochs, Open open, int threads)
      : epochs_(std::move(epochs)), open_(std::move(open)), sampler_(sampler::make_ray_sampler(threads)) {}

  // Replaces all chunks by those of this store.
  Status load(std::shared_ptr<data::MeshStore> store) {
    if (store_)
      for (const auto& c : store_->leaves()) sampler_->remove_chunk(c.id);
    store_ = std::move(store);
    std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks;
    for (const auto& c : store_->leaves()) chunks.emplace_back(c.id, store_->chunk(c.id));
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
  uint64_t primitives() const override { return store_->info().triangles; }
  std::string size() const override { return fmt::format("{} triangles", primitives()); }

 private:
  // Frames come in order: the epoch seldom changes.
  Status prepare(EpochId id) {
    if (epochs_.by_id.empty() || prepared_ == id) return ok_status();
    const auto colouring = epochs_.at(id);
    if (!colouring) return colouring.error();
    const std::string array = *colouring ? (*colouring)->array : "";
    if (array != store_->info().array) {
      auto store = open_(array);
      if (!store) return store.error();
      if (const Status s = load(std::move(*store)); !s) return s;
    }
    colour_by(*colouring);
    sampler_->set_clip(epochs_.clip_at(id));
    prepared_ = id;
    return ok_status();
  }

  MeshScene::Colours epochs_;
  Open open_;
  std::shared_ptr<data::MeshStore> store_;
  std::unique_ptr<sampler::Sampler> sampler_;
  std::optional<EpochId> prepared_;
};

}  // namespace

Status MeshScene::read_record(const std::string& run_directory) {
  epochs_.directory = run_directory;
  std::error_code error;
  if (std::filesystem::file_size(run_directory + "/epochs.csv", error) == 0) return ok_status();
  return read_epochs(run_directory, {"epoch"}, [&](uint64_t epoch, tools::CsvRow& row) -> Status {
    if (!row.has(scene::kColouringFact)) return ok_status();  // an old run: its meshes had no colouring
    read_clip(epoch, row, epochs_.clips);
    auto& at = epochs_.by_id[epoch];
    const std::string text = row.text(scene::kColouringFact);
    if (text.empty()) return ok_status();
    auto colouring = scene::colouring_from_text(text);
    if (!colouring)
      return Error{fmt::format("{}/epochs.csv: epoch {}: {}", run_directory, epoch, colouring.error().text)};
    at = *std::move(colouring);
    return ok_status();
  });
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
