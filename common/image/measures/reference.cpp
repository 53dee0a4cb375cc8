#include "common/image/measures/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/parallel/in_parallel.h"

namespace telesplat::image {
namespace {

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr int kPieceSide = 2048;  // side of a piece as it is drawn

int side_of(int samples) { return static_cast<int>(std::lround(std::sqrt(samples))); }

// Pixel (x, y) of the result, whose rays begin at pixel (fine_x, fine_y) of `fine`.
void gather(const View& fine, int fine_x, int fine_y, int side, size_t at, Reference& out) {
  uint32_t sum[3] = {};
  int hits = 0;
  float farthest = 0, nearest = kNothing;
  for (int j = 0; j < side; ++j)
    for (int i = 0; i < side; ++i) {
      const size_t from = size_t(fine_y + j) * fine.width + (fine_x + i);
      const uint32_t c = fine.colour[from];
      sum[0] += c >> 16 & 255, sum[1] += c >> 8 & 255, sum[2] += c & 255;
      hits += fine.depth_m[from] < kNothing;
      farthest = std::max(farthest, fine.depth_m[from]);
      nearest = std::min(nearest, fine.depth_m[from]);
    }
  const auto n = static_cast<uint32_t>(side * side);
  const auto mean = [&](int channel) { return (sum[channel] + n / 2) / n; };
  out.view.colour[at] = mean(0) << 16 | mean(1) << 8 | mean(2);
  out.view.depth_m[at] = farthest;
  out.hits[at] = static_cast<uint16_t>(hits);
  out.nearest_m[at] = nearest;
}

void gather_piece(const View& fine, const geometry::Rect& piece, int side, Reference& out) {
  in_parallel(tbb::blocked_range<int>(0, piece.height, 16), [&](const tbb::blocked_range<int>& rows) {
    for (int y = rows.begin(); y < rows.end(); ++y)
      for (int x = 0; x < piece.width; ++x)
        gather(fine, x * side, y * side, side, size_t(piece.y + y) * out.view.width + (piece.x + x), out);
  });
}

}  // namespace

Status validate_samples(int samples) {
  if (samples >= 1 && samples <= kMostSamples && side_of(samples) * side_of(samples) == samples) return ok_status();
  return Error{fmt::format("{} rays a pixel: not a square number from 1 to {}", samples, kMostSamples)};
}

Reference reference_of(View view) {
  CHECK(view.depth_m.size() == view.colour.size());
  return {1, std::move(view), {}, {}};
}

Result<Reference> supersample(const geometry::Camera& camera, int samples,
                              const std::function<Result<View>(const geometry::Camera&)>& draw) {
  CHECK(validate_samples(samples));
  if (samples == 1) {
    auto drawn = draw(camera);
    if (!drawn) return drawn.error();
    return reference_of(std::move(*drawn));
  }
  const int side = side_of(samples), most = kPieceSide / side;
  const size_t pixels = size_t(camera.width) * camera.height;
  Reference out{samples,
                {camera.width, camera.height, std::vector<uint32_t>(pixels), std::vector<float>(pixels)},
                std::vector<uint16_t>(pixels),
                std::vector<float>(pixels)};
  for (int y = 0; y < camera.height; y += most)
    for (int x = 0; x < camera.width; x += most) {
      const geometry::Rect piece{x, y, std::min(most, camera.width - x), std::min(most, camera.height - y)};
      geometry::Camera fine = geometry::crop(camera, piece);
      fine.width *= side;
      fine.height *= side;
      const auto drawn = draw(fine);
      if (!drawn) return drawn.error();
      CHECK(drawn->width == fine.width && drawn->height == fine.height);
      CHECK(drawn->depth_m.size() == size_t(fine.width) * fine.height);
      gather_piece(*drawn, piece, side, out);
    }
  return out;
}

}  // namespace telesplat::image
