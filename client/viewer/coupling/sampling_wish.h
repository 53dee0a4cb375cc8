// How finely views are to be sampled, as a person wishes it while looking.
#pragma once

namespace telesplat::viewer {

struct SamplingWish {
  bool adaptive = true;         ///< as fine as updates in time allow (RequestOptions); else the size below
  int width = 0, height = 0;    ///< not adaptive: pixels; in a window as many in its aspect
  double least_sampling = 0.5;  ///< adaptive: sampled pixels a displayed pixel, on each axis, at least
  bool operator==(const SamplingWish&) const = default;
};

}  // namespace telesplat::viewer
