#include "services/sampler/tiles/picture_maker.h"

#include <algorithm>
#include <cmath>

#include "common/image/jpeg.h"

namespace telesplat::sampler {
namespace {

constexpr size_t kMostSeen = 256;  // viewers that are remembered

// Returns rays a pixel on each axis: 1, 2 or 4, for any number that a master may send.
int side_of(int samples) { return samples >= 16 ? 4 : samples >= 4 ? 2 : 1; }

// Returns the mean colour of each side x side pixels.
std::vector<uint32_t> averaged(const std::vector<uint32_t>& fine, int width, int height, int side) {
  std::vector<uint32_t> out(size_t(width) * size_t(height));
  const auto count = uint32_t(side * side);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      uint32_t red = count / 2, green = red, blue = red;
      for (int j = 0; j < side; ++j)
        for (int i = 0; i < side; ++i) {
          const uint32_t c = fine[size_t(y * side + j) * size_t(width * side) + size_t(x * side + i)];
          red += c >> 16 & 255, green += c >> 8 & 255, blue += c & 255;
        }
      out[size_t(y) * size_t(width) + size_t(x)] = red / count << 16 | green / count << 8 | blue / count;
    }
  return out;
}

}  // namespace

void PictureMaker::follow(const wire::Welcome& session) {
  const wire::SessionSettings& s = session.settings;
  quality_ = s.pictures ? int(s.picture_quality) : 0;
  samples_ = int(s.picture_samples);
  parameters_ = *image::shading_named(image::kShadingNames[size_t(s.picture_shading)]);
  parameters_.background = uint32_t(s.picture_background);
  shading_.reset();
}

// True if the viewer asks for the same view as in the frame before. All tiles of a frame get the same answer, even if
// the frame before was not drawn here.
bool PictureMaker::is_still(const wire::Lease& lease) {
  if (seen_.size() >= kMostSeen && !seen_.contains(lease.viewer)) seen_.clear();
  Seen& seen = seen_[lease.viewer];
  if (seen.frame != lease.frame)
    seen = {lease.frame, lease.camera, lease.epoch, seen.camera == lease.camera && seen.epoch == lease.epoch};
  return seen.still;
}

PictureMaker::Rays PictureMaker::rays(const wire::Lease& lease) {
  const bool still = is_still(lease);
  Rays out{.side = side_of(still ? std::max(samples_, kStillSamples) : samples_),
           .quality = still ? std::max(quality_, kStillQuality) : quality_};
  const int most = geometry::kMaxImageSide / std::max(lease.camera.width, lease.camera.height);
  out.side = std::clamp(most, 1, out.side);
  if (out.side == 1) return out;
  out.lease = lease;
  out.lease->camera.width *= out.side, out.lease->camera.height *= out.side;
  geometry::Rect& r = out.lease->rect;
  r = {r.x * out.side, r.y * out.side, r.width * out.side, r.height * out.side};
  return out;
}

std::vector<std::byte> PictureMaker::picture(const wire::Lease& lease, const Rays& rays,
                                             const image::DepthImage& sampled) {
  if (!shading_ || shaded_ != lease.camera) {
    shading_.emplace(parameters_, lease.camera);
    shaded_ = lease.camera;
  }
  const auto& intensity = shading_->table();
  std::vector<uint32_t> colour(sampled.pixels());
  for (size_t i = 0; i < colour.size(); ++i)
    colour[i] = sampled.depth[i] == 0 ? shading_->background()
                                      : image::Shading::apply(sampled.colour[i], intensity[sampled.normal[i]]);
  if (rays.side > 1) colour = averaged(colour, lease.rect.width, lease.rect.height, rays.side);
  return image::encode_jpeg(colour, lease.rect.width, lease.rect.height, rays.quality);
}

}  // namespace telesplat::sampler
