#include "client/viewer/display/renderers.h"

namespace telesplat::viewer {

Renderers::Renderers(std::string kind, int threads, std::unique_ptr<Renderer> first,
                     std::shared_ptr<RendererChoice> choice)
    : kind_(std::move(kind)),
      threads_(threads),
      name_(first->name()),
      device_(first->device()),
      first_(std::move(first)),
      choice_(std::move(choice)) {}

Result<Renderers> Renderers::make(const std::string& kind, int threads) {
  auto choice = std::make_shared<RendererChoice>();
  auto first = make_renderer(kind, threads, choice);
  if (!first) return first.error();
  return Renderers(kind, threads, std::move(*first), std::move(choice));
}

Result<std::unique_ptr<Renderer>> Renderers::for_points() {
  if (first_) return std::move(first_);
  return make_renderer(kind_, threads_, choice_);
}

Result<std::unique_ptr<VolumeRenderer>> Renderers::for_slices() {
  first_.reset();  // its context must be gone first
  return make_volume_renderer(kind_, threads_, choice_);
}

}  // namespace telesplat::viewer
