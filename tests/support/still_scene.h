// A view of the test scene with any number of rays a pixel: for tests of pictures of a resting camera.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/viewer/render/supersampler.h"
#include "tests/support/points_scenes.h"

namespace telesplat::test {

/// The camera's view with `by` times as many pixels on each axis.
inline geometry::Camera finer(geometry::Camera camera, int by) {
  camera.width *= by, camera.height *= by;
  return camera;
}

/// Traces the scene with side x side evenly spaced rays a pixel: mean of their displayed colours.
inline image::View traced(const geometry::Camera& camera, int side, const image::Shading& shading) {
  const geometry::Camera fine = finer(camera, side);
  const image::DepthImage rays = sample_scene(fine, {0, 0, fine.width, fine.height});
  std::vector<uint32_t> colour(rays.pixels());
  for (size_t i = 0; i < colour.size(); ++i)
    colour[i] =
        rays.depth[i] ? image::Shading::apply(rays.colour[i], shading.table()[rays.normal[i]]) : shading.background();
  const auto pixels = size_t(camera.width) * size_t(camera.height);
  image::View out{camera.width, camera.height, std::vector<uint32_t>(pixels), {}};
  viewer::box_filter(colour.data(), size_t(fine.width), side,
                     {out.colour.data(), size_t(camera.width), camera.width, camera.height});
  return out;
}

/// A patch of all pixels of the camera's view with `by` times as many pixels on each axis.
inline points::PreparedPatch whole_patch(const points::ModelConfig& config, uint64_t sequence,
                                         const geometry::Camera& camera, int by) {
  const geometry::Camera fine = finer(camera, by);
  const geometry::Rect all{0, 0, fine.width, fine.height};
  return points::prepare_patch(config, Sequence{sequence}, fine, all, sample_scene(fine, all), FrameId{sequence});
}

/// Rays of such a view that were cast: their places, their hits, and the rays that met nothing.
struct CastRays {
  geometry::Camera camera;
  geometry::Rect rect;
  image::DepthImage image;
  image::PixelMask missed;
  points::PreparedPatch patch(const points::ModelConfig& config, uint64_t sequence) const {
    return points::prepare_patch(config, Sequence{sequence}, camera, rect, image, FrameId{sequence});
  }
  viewer::FineRays::Tile tile(EpochId epoch) const { return {epoch, camera, rect, &missed, rect, &image}; }
};

template <class Cast>
CastRays cast_rays(const geometry::Camera& camera, int by, const Cast& cast) {
  CastRays out{finer(camera, by), {}, {}, {}};
  out.rect = {0, 0, out.camera.width, out.camera.height};
  out.image = sample_scene(out.camera, out.rect);
  out.missed.reset(out.rect.width, out.rect.height);
  for (int y = 0; y < out.rect.height; ++y)
    for (int x = 0; x < out.rect.width; ++x) {
      const size_t i = size_t(y) * size_t(out.rect.width) + size_t(x);
      if (!cast(x, y))
        out.image.depth[i] = out.image.colour[i] = out.image.normal[i] = 0;
      else if (out.image.depth[i] == 0)
        out.missed.set(x, y);
    }
  return out;
}

/// PSNR of the colours, dB; infinity if they are equal.
inline double psnr_db(const image::View& a, const image::View& b) {
  double sum = 0;
  for (size_t i = 0; i < a.colour.size(); ++i)
    for (const int shift : {16, 8, 0}) {
      const double d = double(a.colour[i] >> shift & 255) - double(b.colour[i] >> shift & 255);
      sum += d * d;
    }
  return 10 * std::log10(255.0 * 255.0 * 3.0 * double(a.colour.size()) / sum);
}

}  // namespace telesplat::test
