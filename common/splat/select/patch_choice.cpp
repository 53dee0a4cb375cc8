#include "common/splat/select/patch_choice.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <numeric>

namespace telesplat::splat {
namespace {

constexpr float kMinCosine = 0.35f;     // samples taken at a steeper slope count as taken at this one
constexpr float kPixelRadius2 = 0.25f;  // variance of the low-pass, squared pixels
constexpr float kMoreCovered = 1.1f, kApart = 0.1f;
// Errors of estimates from n samples: kAreaOff / sqrt n of the area, and kCentreOff spacings for the centre.
constexpr float kAreaOff = 1.5f, kCentreOff = 0.5f;

// Cosine of the slope at which samples were taken, at least kMinCosine.
float sampled_cosine(const glm::vec3& normal, const glm::vec3& to_eye) {
  return std::max(glm::dot(normal, to_eye), kMinCosine);
}

}  // namespace

PatchView patch_view(const geometry::Camera& camera) {
  return {glm::mat4(camera.view()), static_cast<float>(camera.focal_x()), static_cast<float>(camera.focal_y()),
          static_cast<float>(camera.near_m)};
}

namespace {

// surfel_quality() of a surfel at `centroid_room` that was sampled with pixel_range from to_eye_room.
float quality_of(const glm::vec3& centroid_room, const glm::vec3& normal_room, const glm::vec3& to_eye_room,
                 float pixel_range, float leaf_m, const PatchView& view) {
  const glm::vec4 centre = view.view * glm::vec4(centroid_room, 1.0f);
  const float w = -centre.z;
  if (!(w > view.near_m)) return 0;
  const auto turn = [&](const glm::vec3& v) {
    const glm::vec3 c = glm::mat3(view.view) * v;
    return glm::vec3(c.x, -c.y, -c.z);
  };
  const glm::vec3 normal = turn(normal_room), to_eye = turn(to_eye_room);
  const float u = centre.x / w, v = -centre.y / w;
  const float rho = 0.5f * leaf_m / (pixel_range * w), rho2 = rho * rho;

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

}  // namespace

float surfel_quality(const points::Mosaic& m, const geometry::Box& leaf_room, const PatchView& view) {
  return quality_of(m.centroid_room(leaf_room), m.cone_axis(), m.direction_to_eye(), m.pixel_range(),
                    leaf_room.hi.x - leaf_room.lo.x, view);
}

float surface_covered(const points::Mosaic& m) {
  return static_cast<float>(m.count(0)) /
         (m.pixel_range() * m.pixel_range() * sampled_cosine(m.cone_axis(), m.direction_to_eye()));
}

// True if `better` shows the part of the cluster that `patch` shows.
bool PatchChooser::shows(const Patch& better, const Patch& patch, float leaf_m) const {
  const float larger = kMoreCovered + patch.covered_off + better.covered_off;
  if (patch.covered > larger * better.covered) return false;
  const float inside = 0.5f * std::max(1.0f - patch.covered / better.covered, 0.0f);
  const float apart = (kApart + inside) * std::sqrt(better.covered) + patch.centre_off + better.centre_off;
  const glm::vec3 between = patch.centre - better.centre;
  return glm::dot(between, between) <= apart * apart * leaf_m * leaf_m;
}

void PatchChooser::choose(const geometry::Box& leaf_room, const PatchView& view,
                          std::vector<const points::Mosaic*>& mosaics) {
  if (mosaics.size() < 2) return;
  // Mosaics of one frame need not follow each other: blocks of several frames alternate.
  patches_.clear();
  patch_of_.clear();
  for (const points::Mosaic* m : mosaics) {
    size_t i = patches_.size();
    while (i > 0 && patches_[i - 1].frame != m->frame_tag()) --i;
    if (i == 0) {
      patches_.push_back({m->frame_tag(), m->pixel_range(), {}});
      i = patches_.size();
    }
    patch_of_.push_back(static_cast<uint32_t>(i - 1));
  }
  if (patches_.size() < 2) return;

  // All mosaics of a patch in this leaf were sampled at one rate from one direction.
  for (size_t i = 0; i < mosaics.size(); ++i) {
    const points::Mosaic& m = *mosaics[i];
    Patch& p = patches_[patch_of_[i]];
    if (p.points == 0) p.to_eye = m.direction_to_eye();
    const auto n = static_cast<float>(m.count(0));
    const glm::vec3 normal = m.cone_axis();
    p.points += n;
    p.covered += n / (p.pixel_range * p.pixel_range * sampled_cosine(normal, p.to_eye));
    p.centre += n * m.centroid_room(leaf_room);
    p.normal += n * normal;
  }
  const float leaf_m = leaf_room.hi.x - leaf_room.lo.x;
  for (Patch& p : patches_) {
    p.centre /= p.points;
    const float length2 = glm::dot(p.normal, p.normal);
    p.normal = length2 > 0 ? p.normal / std::sqrt(length2) : p.to_eye;
    p.quality = quality_of(p.centre, p.normal, p.to_eye, p.pixel_range, leaf_m, view);
    p.covered_off = kAreaOff / std::sqrt(p.points);
    p.centre_off = kCentreOff / p.pixel_range;
  }

  by_quality_.resize(patches_.size());
  std::iota(by_quality_.begin(), by_quality_.end(), 0u);
  std::sort(by_quality_.begin(), by_quality_.end(), [&](uint32_t a, uint32_t b) {
    return patches_[a].quality != patches_[b].quality ? patches_[a].quality > patches_[b].quality : a < b;
  });
  for (size_t i = 0; i < by_quality_.size(); ++i) {
    Patch& p = patches_[by_quality_[i]];
    p.drawn = true;
    for (size_t j = 0; j < i && p.drawn; ++j) {
      const Patch& better = patches_[by_quality_[j]];
      p.drawn = !(better.drawn && shows(better, p, leaf_m));
    }
  }
  size_t kept = 0;
  for (size_t i = 0; i < mosaics.size(); ++i)
    if (patches_[patch_of_[i]].drawn) mosaics[kept++] = mosaics[i];
  mosaics.resize(kept);
}

}  // namespace telesplat::splat
