#include "tools/lab/simulation/programs.h"

#include <utility>

#include "services/data/data_service.h"
#include "services/data/kinds.h"
#include "services/master/master_service.h"
#include "services/packer/packer_service.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/sampler_service.h"
#include "tools/lab/simulation/scenes/fields.h"

namespace telesplat::simulation {
namespace {

net::ServiceOptions service_of(const std::string& name) {
  net::ServiceOptions out;
  out.name = name;
  out.master = kMasterEndpoint;
  return out;
}

Result<std::unique_ptr<data::Served>> serve_scene(const Surroundings& s) {
  if (s.show == Show::kMesh) {
    data::DataOptions options;
    options.scene = s.scenario.file;
    options.mesh.use_cache = false;
    return data::open(options, [](const char*, double) {});
  }
  if (const auto surface = surface_of(s.show)) return serve_surface(*surface);
  if (s.show == Show::kJulia) return serve_julia_set();
  const int parts = s.scenario.data_servers;
  return serve_ball_volume(s.show == Show::kSeries, s.number % parts, parts);
}

std::unique_ptr<sampler::Sampler> sample_scene(Show show) {
  if (show == Show::kMesh) return sampler::make_ray_sampler(1);
  return sample_surface(surface_of(show).value_or(Surface::kSpheres));
}

class MasterProgram final : public Program {
 public:
  static Result<std::unique_ptr<Program>> begin(net::Context& context, const Surroundings& s) {
    auto out = std::make_unique<MasterProgram>();
    auto& o = out->options_;
    o.service = service_of(s.name);
    o.service.bind = kMasterEndpoint;
    o.started_by = "launcher";
    o.master.schedule.tile_size = s.scenario.tile_size;
    o.master.octree_depth = 3;
    o.master.settings = s.scenario.settings;
    o.out = s.folder;
    o.goes_on = !s.folder.empty() && !s.first;
    auto made = master::MasterService::open(context, o);
    if (!made) return made.error();
    out->service_ = *std::move(made);
    return {std::move(out)};
  }
  net::Turns& turns() override { return *service_; }
  Status finish() override { return service_->write_record(); }

 private:
  master::MasterServiceOptions options_;
  std::unique_ptr<master::MasterService> service_;
};

class DataProgram final : public Program {
 public:
  static Result<std::unique_ptr<Program>> begin(net::Context& context, const Surroundings& s) {
    auto out = std::make_unique<DataProgram>();
    out->options_ = service_of(s.name);
    auto served = serve_scene(s);
    if (!served) return served.error();
    out->served_ = *std::move(served);
    auto made = data::DataService::open(context, *out->served_, out->options_);
    if (!made) return made.error();
    out->service_ = *std::move(made);
    return {std::move(out)};
  }
  net::Turns& turns() override { return *service_; }
  int exit_code() const override { return service_->exit_code(); }

 private:
  net::ServiceOptions options_;
  std::unique_ptr<data::Served> served_;
  std::unique_ptr<data::DataService> service_;
};

class PackerProgram final : public Program {
 public:
  static Result<std::unique_ptr<Program>> begin(net::Context& context, const Surroundings& s) {
    auto out = std::make_unique<PackerProgram>();
    out->options_.service = service_of(s.name);
    out->options_.threads = 1;
    out->options_.log_limit_mb = s.scenario.log_limit_mb;
    auto made = packer::PackerService::open(context, out->options_);
    if (!made) return made.error();
    out->service_ = *std::move(made);
    return {std::move(out)};
  }
  net::Turns& turns() override { return *service_; }
  int exit_code() const override { return service_->exit_code(); }

 private:
  packer::PackerOptions options_;
  std::unique_ptr<packer::PackerService> service_;
};

// Takes as long for a tile as the scenario says.
class SlowSampler final : public sampler::Sampler {
 public:
  SlowSampler(std::unique_ptr<sampler::Sampler> sampler, const Surroundings& s)
      : sampler_(std::move(sampler)),
        spend_(s.spend),
        slowness_(s.slowness),
        pixel_s_(s.scenario.tile_s / (double(s.scenario.tile_size) * s.scenario.tile_size)) {}
  const char* name() const override { return sampler_->name(); }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override {
    return sampler_->add_chunk(id, std::move(chunk));
  }
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override {
    return sampler_->add_chunks(std::move(chunks));
  }
  void remove_chunk(ChunkId id) override { sampler_->remove_chunk(id); }
  void show(const std::vector<ChunkId>& chunks) override { sampler_->show(chunks); }
  void set_colours(std::shared_ptr<const scene::ColourTable> colours) override { sampler_->set_colours(colours); }
  void set_clip(const geometry::Clip& clip) override { sampler_->set_clip(clip); }
  image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                           const image::PixelMask* mask) override {
    const double pixels = mask ? double(mask->count()) : double(tile.width) * tile.height;
    spend_(slowness_() * pixel_s_ * pixels);
    return sampler_->sample(camera, tile, mask);
  }

 private:
  std::unique_ptr<sampler::Sampler> sampler_;
  std::function<void(double)> spend_;
  std::function<double()> slowness_;
  double pixel_s_;
};

class SamplerProgram final : public Program {
 public:
  static Result<std::unique_ptr<Program>> begin(net::Context& context, const Surroundings& s) {
    auto out = std::make_unique<SamplerProgram>();
    out->options_.service = service_of(s.name);
    out->options_.threads = 1;
    auto meshes = std::make_unique<SlowSampler>(sample_scene(s.scenario.show), s);
    out->service_ = sampler::SamplerService::open(context, out->options_, std::move(meshes));
    return {std::move(out)};
  }
  net::Turns& turns() override { return *service_; }
  int exit_code() const override { return service_->exit_code(); }

 private:
  sampler::SamplerOptions options_;
  std::unique_ptr<sampler::SamplerService> service_;
};

class ViewerProgram final : public Program {
 public:
  ViewerProgram(net::Context& context, const Surroundings& s) : viewer_(context, service_of(s.name), s.scenario) {}
  net::Turns& turns() override { return viewer_.worker(); }
  SimulatedViewer* viewer() override { return &viewer_; }

 private:
  SimulatedViewer viewer_;
};

}  // namespace

std::optional<Surface> surface_of(Show show) {
  if (show == Show::kSpheres) return Surface::kSpheres;
  if (show == Show::kTerrain) return Surface::kTerrain;
  if (show == Show::kBars) return Surface::kFence;
  return std::nullopt;
}

Result<std::unique_ptr<Program>> make_program(Role role, net::Context& context, const Surroundings& s) {
  switch (role) {
    case Role::kMaster:
      return MasterProgram::begin(context, s);
    case Role::kData:
      return DataProgram::begin(context, s);
    case Role::kPacker:
      return PackerProgram::begin(context, s);
    case Role::kSampler:
      return SamplerProgram::begin(context, s);
    case Role::kViewer:
      return {std::make_unique<ViewerProgram>(context, s)};
  }
  return Error{"no such role"};
}

}  // namespace telesplat::simulation
