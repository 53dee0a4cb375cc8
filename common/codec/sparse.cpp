#include "common/codec/sparse.h"

#include <cstdlib>

namespace telesplat::codec::detail {
namespace {
constexpr int kFar = -1000000;  // where the pixel of an empty cell stands
}

void Neighbours::reset(int width, int height, const Pixel& base) {
  cells_per_row_ = (width + kCell - 1) / kCell + 2;
  cells_.assign(static_cast<size_t>(cells_per_row_) * static_cast<size_t>((height + kCell - 1) / kCell + 1),
                Entry{kFar, kFar, base});
  last_ = {kFar, kFar, base};
}

Pixel Neighbours::predict(int x, int y) const {
  const Entry* const here = &cells_[static_cast<size_t>((y / kCell + 1) * cells_per_row_ + x / kCell + 1)];
  const Entry* best = &last_;
  int best_distance = std::abs(x - last_.x) + std::abs(y - last_.y);
  const auto consider = [&](const Entry* entry) {
    const int distance = std::abs(x - entry->x) + std::abs(y - entry->y);
    best = distance < best_distance ? entry : best;
    best_distance = distance < best_distance ? distance : best_distance;
  };
  for (const Entry* entry :
       {here, here - 1, here + 1, here - cells_per_row_, here - cells_per_row_ - 1, here - cells_per_row_ + 1})
    consider(entry);
  return best->pixel;
}

void Neighbours::add(int x, int y, const Pixel& pixel) {
  last_ = {x, y, pixel};
  cells_[static_cast<size_t>((y / kCell + 1) * cells_per_row_ + x / kCell + 1)] = last_;
}

}  // namespace telesplat::codec::detail
