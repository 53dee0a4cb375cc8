#include "services/master/gate/gate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "common/core/utf8.h"

namespace telesplat::master {

wire::ViewRequest Gate::admit(const wire::ViewRequest& view) {
  const auto pixels = [](const geometry::Camera& c) { return uint64_t(c.width) * uint64_t(c.height); };
  const uint64_t most = std::max<uint64_t>(limits_.max_sampling_pixels, 1);
  if (pixels(view.camera) <= most) return view;
  ++hit_.views_coarser;
  wire::ViewRequest out = view;
  int step = std::max(2, int(std::sqrt(double(pixels(view.camera)) / double(most))));
  do out.camera = geometry::subsample(view.camera, step++);
  while (pixels(out.camera) > most);
  return out;
}

}  // namespace telesplat::master
