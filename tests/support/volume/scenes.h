// Small synthetic volumes for tests, and slice images put together plainly: like a viewer, without its speed.
#pragma once

#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <span>
#include <vector>

#include "common/geometry/trajectory.h"
#include "common/image/file.h"
#include "common/image/normal.h"
#include "common/volume/shear.h"
#include "common/volume/slices/image.h"
#include "common/volume/transfer/function.h"
#include "common/volume/voxels.h"

namespace telesplat::test {

struct VolumeScene {
  volume::Grid grid;
  volume::Voxels voxels;
  std::vector<volume::LevelColour> colours;  // 256 levels
};

/// A grid about the room's origin whose longest side is `side_m`; spacing by axis, turned by `degrees` about `about`.
inline volume::Grid make_grid(std::array<int, 3> size, double side_m, glm::dvec3 spacing = glm::dvec3(1),
                              double degrees = 0, glm::dvec3 about = glm::dvec3(0, 1, 0)) {
  volume::Grid grid;
  grid.size = size;
  const glm::dvec3 n(size[0], size[1], size[2]);
  const glm::dvec3 extent = n * spacing;
  const double scale = side_m / std::max({extent.x, extent.y, extent.z});
  glm::dmat4 m = glm::rotate(glm::dmat4(1.0), glm::radians(degrees), about);
  m = glm::scale(m, spacing * scale);
  grid.index_to_room = glm::translate(m, -(n - 1.0) / 2.0);
  return grid;
}

/// Makes voxels where `value` of the position in [-1, 1]^3 gives more than level 0; normals from its gradient.
inline VolumeScene make_scene(const volume::Grid& grid, const std::function<double(glm::dvec3)>& value,
                              std::vector<volume::LevelColour> colours, bool lit = true) {
  VolumeScene out{grid, {}, std::move(colours)};
  volume::Voxels& v = out.voxels;
  v.k_begin = 0, v.k_end = grid.size[2];
  v.rows.push_back(0);
  const glm::dmat3 to_room(grid.index_to_room);
  const auto at = [&](double i, double j, double k) {
    return value(
        {2 * (i + 0.5) / grid.size[0] - 1, 2 * (j + 0.5) / grid.size[1] - 1, 2 * (k + 0.5) / grid.size[2] - 1});
  };
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const int level = int(std::lround(std::clamp(at(i, j, k), 0.0, 1.0) * 255));
        if (!(out.colours[size_t(level)].extinction > 0)) continue;
        v.i.push_back(uint16_t(i)), v.level.push_back(uint16_t(level));
        if (!lit) continue;
        const glm::dvec3 gradient(at(i - 1, j, k) - at(i + 1, j, k), at(i, j - 1, k) - at(i, j + 1, k),
                                  at(i, j, k - 1) - at(i, j, k + 1));
        const glm::dvec3 normal = glm::transpose(glm::inverse(to_room)) * gradient;
        v.normal.push_back(glm::length(gradient) < 1e-9 ? volume::kNoNormal
                                                        : image::encode_normal16(glm::vec3(glm::normalize(normal))));
      }
      v.rows.push_back(uint32_t(v.i.size()));
    }
  return out;
}

/// Opacity from 0 at level `from` to `opacity` at 255; colours from blue over green to red.
inline std::vector<volume::LevelColour> ramp(double opacity, int from = 20) {
  std::vector<volume::LevelColour> out(256);
  for (int l = from; l < 256; ++l) {
    const double x = double(l - from) / (255 - from);
    out[size_t(l)] = {float(x), float(1 - std::abs(2 * x - 1)), float(1 - x),
                      float(-std::log(1 - std::min(opacity * x, double(volume::kMaxOpacity))))};
  }
  return out;
}

/// A few soft blobs.
inline double blobs(glm::dvec3 p) {
  double sum = 0;
  for (const auto& [c, r] : {std::pair{glm::dvec3(-0.3, -0.2, -0.25), 0.45},
                             {glm::dvec3(0.35, 0.3, 0.1), 0.4},
                             {glm::dvec3(0.1, -0.4, 0.45), 0.3},
                             {glm::dvec3(-0.4, 0.45, 0.35), 0.25}})
    sum += std::exp(-glm::dot(p - c, p - c) / (r * r) * 2);
  return std::min(sum, 1.0);
}

/// Returns the voxels of the slices [begin, end) of k.
inline volume::Voxels part_of(const VolumeScene& scene, int begin, int end) {
  const volume::Voxels& all = scene.voxels;
  volume::Voxels out;
  out.k_begin = std::max(begin, 0), out.k_end = std::min(end, scene.grid.size[2]);
  const size_t rows = size_t(scene.grid.size[1]), first = size_t(out.k_begin) * rows, last = size_t(out.k_end) * rows;
  const uint32_t a = all.rows[first], b = all.rows[last];
  for (size_t r = first; r <= last; ++r) out.rows.push_back(all.rows[r] - a);
  out.i.assign(all.i.begin() + a, all.i.begin() + b);
  out.level.assign(all.level.begin() + a, all.level.begin() + b);
  if (!all.normal.empty()) out.normal.assign(all.normal.begin() + a, all.normal.begin() + b);
  return out;
}

/// Returns colour (0 to 1, premultiplied) and alpha at a continuous raster position; 0 outside.
inline glm::dvec4 look_up(const volume::SliceImage& image, double x, double y) {
  const double fx = x - 0.5 - image.rect.x, fy = y - 0.5 - image.rect.y;
  const int ix = int(std::floor(fx)), iy = int(std::floor(fy));
  glm::dvec4 sum(0);
  for (int n = 0; n < 4; ++n) {
    const int px = ix + (n & 1), py = iy + (n >> 1);
    if (px < 0 || py < 0 || px >= image.rect.width || py >= image.rect.height) continue;
    const uint32_t c = image.pixels[size_t(py) * size_t(image.rect.width) + size_t(px)];
    const double w = (n & 1 ? fx - ix : 1 - fx + ix) * (n >> 1 ? fy - iy : 1 - fy + iy);
    sum += w * glm::dvec4(c >> 16 & 255, c >> 8 & 255, c & 255, c >> 24) / 255.0;
  }
  return sum;
}

/// Draws all images (one slab, or slabs in the order of their k in `images`) as `camera` sees them. Planes front to
/// back; on one plane the slabs nearer to the eye along k first. Depth: 1 where more than a quarter is opaque, so that
/// image::compare recognises the object.
inline image::View warp_plainly(const volume::Grid& grid, const volume::ShearFrame& frame,
                                const std::vector<volume::SliceImage>& images, const geometry::Camera& camera,
                                uint32_t background) {
  const glm::dvec3 eye = grid.room_to_index() * glm::dvec4(camera.pose.position_room, 1);
  std::vector<const volume::SliceImage*> order;
  for (const auto& i : images) order.push_back(&i);
  const auto slab_distance = [&](const volume::SliceImage& i) {
    return std::max({i.k_begin - 0.5 - eye.z, eye.z - (i.k_end - 0.5), 0.0});
  };
  std::stable_sort(order.begin(), order.end(), [&](const auto* a, const auto* b) {
    return a->layer != b->layer ? a->layer < b->layer : slab_distance(*a) < slab_distance(*b);
  });
  std::vector<glm::dmat3> warps;
  for (const auto* i : order) {
    const auto m = volume::warp(grid, frame, frame.layers[size_t(i->layer)].plane, camera);
    warps.push_back(m ? *m : glm::dmat3(0));
  }
  image::View out{camera.width, camera.height, {}, {}};
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      glm::dvec4 sum(0);
      float depth = std::numeric_limits<float>::infinity();
      for (size_t n = 0; n < order.size(); ++n) {
        const glm::dvec3 at = warps[n] * glm::dvec3(x + 0.5, y + 0.5, 1);
        if (!(at.z > 0)) continue;
        sum += (1 - sum.w) * look_up(*order[n], at.x / at.z, at.y / at.z);
        if (sum.w > 0.25 && std::isinf(depth)) depth = 1;
      }
      uint32_t colour = 0;
      for (int c = 0; c < 3; ++c) {
        const double b = double(background >> (16 - 8 * c) & 255);
        colour |= uint32_t(std::clamp(sum[c] * 255 + (1 - sum.w) * b + 0.5, 0.0, 255.0)) << (16 - 8 * c);
      }
      out.colour.push_back(colour), out.depth_m.push_back(depth);
    }
  return out;
}

/// Peak signal to noise ratio over the pixels where a or b differs from the background.
inline double psnr(const image::View& a, const image::View& b, uint32_t background) {
  double sum = 0, count = 0;
  for (size_t n = 0; n < a.colour.size(); ++n) {
    if (a.colour[n] == background && b.colour[n] == background) continue;
    for (int shift : {0, 8, 16}) {
      const double d = double(a.colour[n] >> shift & 255) - double(b.colour[n] >> shift & 255);
      sum += d * d, count += 1;
    }
  }
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255.0 * count / sum);
}

}  // namespace telesplat::test
