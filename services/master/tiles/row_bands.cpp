#include "services/master/tiles/row_bands.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/core/check.h"

namespace telesplat::master {

std::vector<geometry::Rect> cut_blocks(int width, int height) {
  std::vector<geometry::Rect> out;
  for (int y = 0; y < height; y += kBlockRows) out.push_back({0, y, width, std::min(kBlockRows, height - y)});
  const auto distance = [&](const geometry::Rect& r) { return std::abs(2 * r.y + r.height - height); };
  std::stable_sort(out.begin(), out.end(), [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  return out;
}

RowBands::RowBands(const std::vector<geometry::Rect>& blocks) : blocks_(blocks) {
  for (const auto& b : blocks_) rows_left_ += b.height;
}

RowBands::Band RowBands::carve(int rows) {
  CHECK(rows >= 1 && rows_left_ > 0);
  const geometry::Rect& block = blocks_[block_];
  const Band band{
      block_,
      {block.x, block.y + begun_rows_, block.width, std::min(rows, block.height - begun_rows_)},
  };
  rows_left_ -= band.rect.height;
  begun_rows_ += band.rect.height;
  if (begun_rows_ == block.height) ++block_, begun_rows_ = 0;
  return band;
}

int band_rows(double target_s, double row_s, int rows_left, size_t samplers) {
  const size_t parts = 3 * std::max<size_t>(samplers, 1);
  const int most = std::max(1, int((size_t(std::max(rows_left, 0)) + parts - 1) / parts));
  if (!(row_s > 0)) return 1;
  return int(std::clamp(std::round(target_s / row_s), 1.0, double(most)));
}

}  // namespace telesplat::master
