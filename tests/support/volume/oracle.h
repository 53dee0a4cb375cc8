// Shear-splatting by the definition in services/sampler/volume/shear/splatter.h, pixel by pixel in double precision:
// gathers every slice at every pixel, skips nothing.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/volume/lighting.h"
#include "tests/support/volume/scenes.h"

namespace telesplat::test {

class SplatOracle {
 public:
  /// planes: number of planes that a slice is sampled on.
  SplatOracle(const VolumeScene& scene, const volume::ShearFrame& frame, int planes)
      : grid_(scene.grid), frame_(frame), planes_(planes) {
    const auto& n = grid_.size;
    field_.resize(size_t(n[0]) * size_t(n[1]) * size_t(n[2]), glm::dvec4(0));
    std::vector<float> light;
    if (!scene.voxels.normal.empty())
      light = volume::normal_intensities(grid_, grid_.index_to_room * glm::dvec4(frame.eye, 1));
    size_t row = 0;
    for (int k = 0; k < n[2]; ++k)
      for (int j = 0; j < n[1]; ++j, ++row)
        for (uint32_t v = scene.voxels.rows[row]; v < scene.voxels.rows[row + 1]; ++v) {
          const auto& c = scene.colours[scene.voxels.level[v]];
          const double i = light.empty() ? 1.0 : double(light[scene.voxels.normal[v]]);
          at(scene.voxels.i[v], j, k) = glm::dvec4(glm::dvec3(c.r, c.g, c.b) * i, 1) * double(c.extinction);
        }
  }

  /// Returns a layer's pixel: premultiplied colour and alpha, 0 to 1.
  glm::dvec4 pixel(const volume::Layer& layer, int x, int y) {
    glm::dvec4 sum(0);
    std::vector<double> at;
    if (planes_ == 2 && layer.begin == 0) at.push_back(-0.5);
    for (int s = layer.begin; s < layer.end; ++s) {
      at.push_back(s);
      if (planes_ == 2) at.push_back(s + 0.5);
    }
    if (frame_.direction < 0) std::reverse(at.begin(), at.end());
    for (const double s : at) {
      const glm::dvec4 e = slice(s, x, y);
      if (!(e.w > 0)) continue;
      const double alpha = 1 - std::exp(-e.w * frame_.path(grid_, x + 0.5, y + 0.5) / planes_);
      sum += (1 - sum.w) * alpha * glm::dvec4(glm::dvec3(e) / e.w, 1);
    }
    return sum;
  }

 private:
  glm::dvec4& at(int i, int j, int k) {
    return field_[(size_t(k) * size_t(grid_.size[1]) + size_t(j)) * size_t(grid_.size[0]) + size_t(i)];
  }

  // Returns a slice at a pixel: extinction times colour, and extinction.
  glm::dvec4 slice(double s, int x, int y) {
    const glm::dvec3 p = frame_.unproject(x + 0.5, y + 0.5, s);
    const double t = frame_.t(s), ru = std::max(1.0, frame_.du * t), rv = std::max(1.0, frame_.dv * t);
    const int u = frame_.u(), v = frame_.v();
    glm::dvec4 sum(0);
    double weights = 0;
    for (int b = int(std::ceil(p[v] - rv)); b <= p[v] + rv; ++b)
      for (int a = int(std::ceil(p[u] - ru)); a <= p[u] + ru; ++a) {
        const double w = (1 - std::abs(a - p[u]) / ru) * (1 - std::abs(b - p[v]) / rv);
        weights += w;
        if (a < 0 || b < 0 || a >= grid_.size[size_t(u)] || b >= grid_.size[size_t(v)]) continue;
        std::array<int, 3> index{};
        index[size_t(u)] = a, index[size_t(v)] = b;
        for (const double side : {std::floor(s), std::ceil(s)}) {  // the same slice twice, or half way between two
          index[size_t(frame_.axis)] = int(side);
          if (side >= 0 && side < grid_.size[size_t(frame_.axis)]) sum += 0.5 * w * at(index[0], index[1], index[2]);
        }
      }
    return weights > 0 ? sum / weights : sum;
  }

  volume::Grid grid_;
  volume::ShearFrame frame_;
  int planes_;
  std::vector<glm::dvec4> field_;
};

}  // namespace telesplat::test
