#include "client/viewer/display/renderers.h"

namespace telesplat::viewer {

Renderers::Renderers(std::string kind, int threads, std::unique_ptr<Renderer> first)
    : kind_(std::move(kind)),
      threads_(threads),
      name_(first->name()),
      device_(first->device()),
      first_(std::move(first)) {}

Result<Renderers> Renderers::make(const std::string& kind, int threads) {
  auto first = make_renderer(kind, threads);
  if (!first) return first.error();
  return Renderers(kind, threads, std::move(*first));
}

Result<std::unique_ptr<Renderer>> Renderers::for_points() {
  if (first_) return std::move(first_);
  return make_renderer(kind_, threads_);
}

Result<std::unique_ptr<VolumeRenderer>> Renderers::for_slices() {
  first_.reset();  // its context must be gone
  return make_volume_renderer(kind_, threads_);
}

}  // namespace telesplat::viewer
