#include "services/sampler/works.h"

#include <iterator>

#include "common/core/machine.h"
#include "services/sampler/julia/tiles.h"
#include "services/sampler/mesh/tiles.h"
#include "services/sampler/tiles/work.h"
#include "services/sampler/volume/shear/splatter.h"
#include "services/sampler/volume/work.h"

namespace telesplat::sampler {
namespace {

using Made = Result<std::unique_ptr<Work>>;

uint64_t cache_bytes(const SamplerOptions& o) {
  return uint64_t((o.memory_mb > 0 ? o.memory_mb : usable_memory_mb() / 4) * 1e6);
}

Made tile_work(std::unique_ptr<TileSource> source, const WorkTools& tools) {
  return Made(std::make_unique<TileWork>(std::move(source), tools.link));
}

Made mesh_work(const WorkTools& tools) {
  std::unique_ptr<Sampler> sampler = std::move(tools.mesh_sampler);
  if (!sampler) {
    auto made = make_sampler(tools.options.kind, tools.options.threads);
    if (!made) return made.error();
    sampler = std::move(*made);
  }
  return tile_work(std::make_unique<MeshTiles>(std::move(sampler), cache_bytes(tools.options),
                                               tools.options.service.name, tools.context, tools.link, tools.spans),
                   tools);
}

Made julia_work(const WorkTools& tools) {
  return tile_work(std::make_unique<JuliaTiles>(tools.options.threads), tools);
}

Made volume_work(const WorkTools& tools) {
  net::MasterLink& link = tools.link;
  const VolumeWork::Master master{.instance = link.instance(),
                                  .ready = [&link](const wire::SlabReady& m) { link.socket().send(m); },
                                  .extend = [&link](const wire::LeaseExtend& m) { link.socket().send(m); },
                                  .to_master_s = [&link](double s) { return link.to_master_s(s); }};
  const SamplerOptions& o = tools.options;
  const VolumeWork::Options options{
      .threads = o.threads, .cache_bytes = cache_bytes(o), .service_name = o.service.name};
  return Made(std::make_unique<VolumeWork>(make_shear_slabs(o.threads), options, tools.context, master, tools.spans));
}

struct Row {
  scene::Kind kind;
  Made (*make)(const WorkTools&);
};
constexpr Row kWorks[] = {
    {scene::Kind::kMesh, mesh_work},
    {scene::Kind::kJulia, julia_work},
    {scene::Kind::kVolume, volume_work},
};
static_assert(std::size(kWorks) == std::size(scene::kKinds), "a row a kind");

}  // namespace

Made make_work(scene::Kind kind, const WorkTools& tools) {
  for (const Row& row : kWorks)
    if (row.kind == kind) return row.make(tools);
  return Error{"this sampler does not know " + std::string(scene::described(kind))};
}

}  // namespace telesplat::sampler
