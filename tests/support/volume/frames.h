// Frames of slice images for tests of the warp: made up, but planned as real frames are.
#pragma once

#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <vector>

#include "common/volume/warp/warper.h"

namespace telesplat::testing {

/// A grid that is not square and not straight: spacing differs by axis, axes are turned.
inline volume::Grid turned_grid() {
  volume::Grid g{{60, 50, 40}, glm::dmat4(1)};
  g.index_to_room = glm::translate(glm::dmat4(1), glm::dvec3(-0.3, -0.2, -0.25));
  g.index_to_room = glm::rotate(g.index_to_room, 0.2, glm::dvec3(0.3, 1, 0.2));
  g.index_to_room = glm::scale(g.index_to_room, glm::dvec3(0.01, 0.009, 0.014));
  return g;
}

inline geometry::Camera looking_at(const glm::dvec3& target, const glm::dvec3& from, int width, int height,
                                   double fov_x_deg = 70) {
  const glm::dvec3 forward = glm::normalize(target - from);
  const glm::dvec3 up = std::abs(forward.y) > 0.9 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 1, 0);
  return geometry::make_camera({from, glm::quatLookAt(forward, up)}, fov_x_deg, width, height);
}

/// Position of an eye at distance_m from the grid's centre; angles in radians.
inline glm::dvec3 orbit(const volume::Grid& grid, double distance_m, double around, double above) {
  return grid.centre_room() + distance_m * glm::dvec3(std::cos(above) * std::sin(around), std::sin(above),
                                                      std::cos(above) * std::cos(around));
}

inline uint32_t premultiplied(double red, double green, double blue, double alpha) {
  const auto byte = [&](double v) { return static_cast<uint32_t>(std::lround(v * alpha * 255)); };
  return static_cast<uint32_t>(std::lround(alpha * 255)) << 24 | byte(red) << 16 | byte(green) << 8 | byte(blue);
}

/// Soft blobs, different in every layer, in about a third of the pixels; some are opaque.
inline volume::SliceImage blobs(const volume::ShearFrame& shear, int layer, const geometry::Rect& rect) {
  volume::SliceImage out{layer, 0, 4096, rect, {}};
  out.pixels.reserve(static_cast<size_t>(rect.width) * static_cast<size_t>(rect.height));
  const double size = std::max(std::min(shear.width, shear.height) / 6.0, 6.0), shift = 1.7 * layer;
  for (int y = rect.y; y < rect.y + rect.height; ++y)
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const double height =
          std::sin(x / size + shift) * std::cos(y / size - 0.6 * shift) + 0.3 * std::sin((x + y) / size);
      const double alpha = std::clamp(2.5 * (height - 0.3), 0.0, 1.0);
      out.pixels.push_back(premultiplied(0.5 + 0.5 * std::sin(layer + x / size), 0.5 + 0.5 * std::sin(y / size),
                                         layer % 3 / 2.0, alpha));
    }
  return out;
}

inline volume::VolumeFrame frame_of(const volume::Grid& grid, const volume::ShearFrame& shear,
                                    const std::vector<volume::SliceImage>& images) {
  return volume::make_volume_frame(grid, shear, images, FrameId{1}, EpochId{1}, 0);
}

/// A frame with blobs in all layers.
inline volume::VolumeFrame blob_frame(const volume::Grid& grid, const geometry::Camera& camera, int layers = 16) {
  volume::PlanOptions options;
  options.layers = layers;
  const auto shear = volume::plan_frame(grid, std::span(&camera, 1), options).value();
  std::vector<volume::SliceImage> images;
  for (int l = 0; l < static_cast<int>(shear.layers.size()); ++l) {
    // Not the whole raster: images have borders within it.
    const int inset = 3 * (l % 4);
    images.push_back(
        blobs(shear, l, {inset, inset, std::max(shear.width - 2 * inset, 1), std::max(shear.height - 2 * inset, 1)}));
  }
  return frame_of(grid, shear, images);
}

struct WarpedView {
  int width = 0, height = 0;
  std::vector<uint32_t> colour;
  std::vector<float> depth_m;

  explicit WarpedView(const geometry::Camera& camera)
      : width(camera.width),
        height(camera.height),
        colour(static_cast<size_t>(width) * static_cast<size_t>(height)),
        depth_m(colour.size(), -1.0f) {}
  volume::WarpTarget target() { return {width, height, colour.data(), depth_m.data()}; }
  size_t at(int x, int y) const { return static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x); }
};

inline int channel(uint32_t colour, int shift) { return static_cast<int>(colour >> shift & 255); }

/// Largest difference of the colours' channels.
inline int difference(uint32_t a, uint32_t b) {
  int most = 0;
  for (const int shift : {0, 8, 16, 24}) most = std::max(most, std::abs(channel(a, shift) - channel(b, shift)));
  return most;
}

/// Warps in double precision by the definition, with rays and planes in the room instead of matrices: returns colour
/// 0xCCRRGGBB, CC for coverage, and depth.
inline std::pair<uint32_t, double> warp_by_rays(const volume::VolumeFrame& frame, const geometry::Camera& camera,
                                                uint32_t background, int x, int y) {
  const glm::dmat4 to_index = frame.grid.room_to_index();
  const glm::dvec3 eye = to_index * glm::dvec4(camera.pose.position_room, 1);
  const glm::dvec3 ahead = glm::dvec3(to_index * glm::dvec4(camera.unproject(x + 0.5, y + 0.5, 1), 1)) - eye;
  const int p = frame.shear.axis;
  double colour[4] = {}, left = 1, depth = INFINITY;              // blue, green, red, alpha
  std::vector<std::pair<double, const volume::LayerImage*>> met;  // depth of the plane on this ray
  for (const auto& layer : frame.layers) {
    const double at = (frame.shear.layers[static_cast<size_t>(layer.layer)].plane - eye[p]) / ahead[p];
    if (at > 0 && std::isfinite(at)) met.emplace_back(at, &layer);
  }
  std::sort(met.begin(), met.end());
  for (const auto& [at, layer] : met) {
    const double plane = frame.shear.layers[static_cast<size_t>(layer->layer)].plane;
    const glm::dvec3 hit = eye + at * ahead;
    const double t = frame.shear.t(plane);
    const double rx = ((hit[frame.shear.u()] - frame.shear.eye[frame.shear.u()]) / t - frame.shear.u0) / frame.shear.du;
    const double ry = ((hit[frame.shear.v()] - frame.shear.eye[frame.shear.v()]) / t - frame.shear.v0) / frame.shear.dv;
    const double sx = rx - 0.5 - layer->rect.x, sy = ry - 0.5 - layer->rect.y;
    const double bx = std::floor(sx), by = std::floor(sy);
    double sample[4] = {};
    for (int j = 0; j < 2; ++j)
      for (int i = 0; i < 2; ++i) {
        const double tx = bx + i, ty = by + j;
        if (tx < 0 || ty < 0 || tx >= layer->rect.width || ty >= layer->rect.height) continue;
        const double weight = (i ? sx - bx : 1 - (sx - bx)) * (j ? sy - by : 1 - (sy - by));
        const uint32_t texel = layer->row(static_cast<int>(ty))[static_cast<int>(tx)];
        for (int c = 0; c < 4; ++c) sample[c] += weight * channel(texel, 8 * c) / 255.0;
      }
    for (int c = 0; c < 4; ++c) colour[c] += sample[c] * left;
    left = 1 - colour[3];
    if (left <= 1 - static_cast<double>(volume::kSolid) && depth == INFINITY) depth = at;
  }
  uint32_t out = 0;
  for (int c = 0; c < 4; ++c) {
    const double value = colour[c] * 255 + (c < 3 ? left * channel(background, 8 * c) : 0);
    out |= static_cast<uint32_t>(std::clamp(std::lround(value), 0l, 255l)) << 8 * c;
  }
  return {out, depth};
}

}  // namespace telesplat::testing
