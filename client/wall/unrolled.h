// A wall laid flat: where the picture of each screen lies in one picture of all, with the gaps that bezels leave.
#pragma once

#include <vector>

#include "client/wall/wall.h"

namespace telesplat::wall {

struct Unrolled {
  int width = 0, height = 0;           ///< pixels of the whole
  std::vector<geometry::Rect> places;  ///< of each screen's picture
  double metres_per_pixel = 0;
};

/// Pixels are as fine as the finest screen's. Screens of other pixels have places of other sizes than their pictures.
/// Error: the whole is larger than a picture may be; names the wall, its size and the limit.
Result<Unrolled> unrolled(const Wall& wall);

}  // namespace telesplat::wall
