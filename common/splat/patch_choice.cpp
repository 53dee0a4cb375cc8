#include "common/splat/patch_choice.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numeric>

namespace telesplat::splat {
namespace {

constexpr float kMinCosine = 0.35f;     // samples taken at a steeper slope count as taken at this one
constexpr float kPixelRadius2 = 0.25f;  // of the low-pass
constexpr size_t kFramesInFlight = 16;  // the most a session may have
constexpr float kMoreCovered = 1.1f, kApart = 0.1f;

// Of the slope by which the mosaic was sampled, not below kMinCosine.
float sampled_cosine(const points::Mosaic& m) {
  return std::max(glm::dot(m.cone_axis(), m.direction_to_eye()), kMinCosine);
}

}  // namespace

PatchView patch_view(const geometry::Camera& camera) {
  return {glm::mat4(camera.view()), static_cast<float>(camera.focal_x()), static_cast<float>(camera.focal_y()),
          static_cast<float>(camera.near_m)};
}

float surfel_quality(const points::Mosaic& mosaic, const geometry::Box& leaf_room, const PatchView& view) {
  const glm::vec4 centre = view.view * glm::vec4(mosaic.centroid_room(leaf_room), 1.0f);
  const float w = -centre.z;
  if (!(w > view.near_m)) return 0;
  const auto turn = [&](const glm::vec3& v) {
    const glm::vec3 c = glm::mat3(view.view) * v;
    return glm::vec3(c.x, -c.y, -c.z);
  };
  const glm::vec3 normal = turn(mosaic.cone_axis()), to_eye = turn(mosaic.direction_to_eye());
  const float u = centre.x / w, v = -centre.y / w;
  const float rho = 0.5f * (leaf_room.hi.x - leaf_room.lo.x) / (mosaic.pixel_range() * w), rho2 = rho * rho;

  // Camera axes X right, Y down, Z forward. G = T (I - n n^T + kappa d d^T) T^T, T = [1 0 -u; 0 1 -v; 0 0 1].
  const float cosine = glm::dot(normal, to_eye), kappa = 1.0f / std::max(cosine * cosine, kMinCosine * kMinCosine);
  const glm::vec3 d = to_eye - cosine * normal;
  const auto shift = [&](const glm::vec3& a) { return glm::vec3(a.x - u * a.z, a.y - v * a.z, a.z); };
  const glm::vec3 s = shift(normal), t = shift(d), x = shift({1, 0, 0}), y = shift({0, 1, 0}), z = shift({0, 0, 1});
  const auto g = [&](int i, int j) {
    return x[i] * x[j] + y[i] * y[j] + z[i] * z[j] - s[i] * s[j] + kappa * t[i] * t[j];
  };
  float k = 1.0f - rho2 * g(2, 2);
  const bool parallel = k < 0.25f;
  if (parallel) k = 1.0f;
  const float fx = view.focal_x, fy = view.focal_y;
  const float cx = parallel ? 0.0f : -rho2 * fx * g(0, 2) / k, cy = parallel ? 0.0f : -rho2 * fy * g(1, 2) / k;
  const float xx = rho2 * fx * fx * g(0, 0) / k + cx * cx + kPixelRadius2, xy = rho2 * fx * fy * g(0, 1) / k + cx * cy,
              yy = rho2 * fy * fy * g(1, 1) / k + cy * cy + kPixelRadius2;
  const float mean = 0.5f * (xx + yy), root = std::sqrt(std::max(0.25f * (xx - yy) * (xx - yy) + xy * xy, 0.0f));
  const float long2 = mean + root, short2 = std::max(mean - root, kPixelRadius2);
  return std::sqrt(short2) / long2;  // (r1 / r0) / r0
}

float surface_covered(const points::Mosaic& m) {
  return static_cast<float>(m.count(0)) / (m.pixel_range() * m.pixel_range() * sampled_cosine(m));
}

void PatchChooser::choose(const geometry::Box& leaf_room, const PatchView& view,
                          std::vector<const points::Mosaic*>& mosaics) {
  if (mosaics.size() < 2) return;
  patches_.clear();
  patch_of_.clear();
  for (const points::Mosaic* m : mosaics) {
    // Mosaics are in order of sequence, and at most kFramesInFlight frames are packed at a time.
    size_t i = patches_.size();
    while (i > 0 && patches_.size() - i < kFramesInFlight && patches_[i - 1].frame != m->frame_tag()) --i;
    if (i == 0 || patches_[i - 1].frame != m->frame_tag()) {
      patches_.push_back({m->frame_tag()});
      i = patches_.size();
    }
    Patch* patch = &patches_[i - 1];
    patch_of_.push_back(static_cast<uint32_t>(i - 1));
    const auto n = static_cast<float>(m->count(0));
    patch->quality += n * surfel_quality(*m, leaf_room, view);
    patch->covered += surface_covered(*m);
    patch->points += n;
    patch->centre += n * m->centroid_room(leaf_room);
  }
  if (patches_.size() < 2) return;
  for (Patch& p : patches_) p.quality /= p.points, p.centre /= p.points;

  by_quality_.resize(patches_.size());
  std::iota(by_quality_.begin(), by_quality_.end(), 0u);
  std::stable_sort(by_quality_.begin(), by_quality_.end(),
                   [&](uint32_t a, uint32_t b) { return patches_[a].quality > patches_[b].quality; });
  const float leaf_m = leaf_room.hi.x - leaf_room.lo.x;
  for (size_t i = 0; i < by_quality_.size(); ++i) {
    Patch& p = patches_[by_quality_[i]];
    p.drawn = true;
    for (size_t j = 0; j < i && p.drawn; ++j) {
      const Patch& better = patches_[by_quality_[j]];
      if (!better.drawn) continue;
      const bool more = p.covered > kMoreCovered * better.covered;
      const float inside = 0.5f * std::max(1.0f - p.covered / better.covered, 0.0f);
      const bool elsewhere =
          glm::distance(p.centre, better.centre) > (kApart + inside) * leaf_m * std::sqrt(better.covered);
      if (!more && !elsewhere) p.drawn = false;
    }
  }
  size_t kept = 0;
  for (size_t i = 0; i < mosaics.size(); ++i)
    if (patches_[patch_of_[i]].drawn) mosaics[kept++] = mosaics[i];
  mosaics.resize(kept);
}

}  // namespace telesplat::splat
