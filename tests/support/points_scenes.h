// A scene with known surfaces for the tests of point model, packer and splatter: a bumpy ball above a square floor.
#pragma once

#include <cmath>
#include <random>

#include "common/geometry/camera.h"
#include "common/geometry/trajectory.h"
#include "common/image/depth_image.h"
#include "common/image/normal.h"
#include "common/points/point_model.h"

namespace telesplat::test {

inline points::ModelConfig scene_config(int depth = 6) {
  return {{glm::vec3(-0.4f, -0.3f, -0.4f), glm::vec3(0.4f, 0.3f, 0.4f)}, depth};
}

inline geometry::Camera scene_camera(const glm::dvec3& eye, int width, int height) {
  return geometry::make_camera(geometry::look_at(eye, {0, 0, 0}), 60, width, height);
}

inline uint32_t scene_colour(const glm::dvec3& p) {
  const auto channel = [](double v) { return static_cast<uint32_t>(127.5 + 127.0 * std::sin(v)); };
  return channel(p.x * 40) << 16 | channel(p.y * 50 + 1) << 8 | channel(p.z * 45 + 2);
}

/// Samples the pixels `tile` of the frame by ray casting.
inline image::DepthImage sample_scene(const geometry::Camera& camera, const geometry::Rect& tile) {
  constexpr double kRadius = 0.25, kFloor = -0.29, kHalf = 0.39;
  image::DepthImage out(tile.width, tile.height);
  const glm::dvec3 eye = camera.pose.position_room;
  for (int y = 0; y < tile.height; ++y) {
    for (int x = 0; x < tile.width; ++x) {
      const glm::dvec3 d = camera.unproject(tile.x + x + 0.5, tile.y + y + 0.5, 1.0) - eye;  // per metre of depth
      double t = INFINITY;
      glm::dvec3 normal(0);
      const double a = glm::dot(d, d), b = glm::dot(eye, d), c = glm::dot(eye, eye) - kRadius * kRadius;
      if (const double root = b * b - a * c; root > 0 && (-b - std::sqrt(root)) / a > camera.near_m) {
        t = (-b - std::sqrt(root)) / a;
        const glm::dvec3 p = (eye + t * d) / kRadius;
        normal = glm::normalize(p + 0.2 * glm::dvec3(std::sin(40 * p.x), std::sin(40 * p.y), std::sin(40 * p.z)));
      }
      if (const double s = (kFloor - eye.y) / d.y; s > camera.near_m && s < t) {
        const glm::dvec3 p = eye + s * d;
        if (std::abs(p.x) < kHalf && std::abs(p.z) < kHalf) t = s, normal = {0, eye.y > kFloor ? 1 : -1, 0};
      }
      if (!(t < INFINITY)) continue;
      const size_t i = static_cast<size_t>(y) * tile.width + x;
      out.depth[i] = image::encode_depth(t, camera.near_m);
      out.colour[i] = scene_colour(eye + t * d);
      out.normal[i] = image::encode_normal16(glm::vec3(normal));
    }
  }
  return out;
}

/// Clears all but about `fraction` of the pixels, as redundancy elimination does: in clumps and single pixels.
inline void mask_randomly(image::DepthImage& image, double fraction, uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (size_t i = 0; i < image.pixels(); ++i)
    if (uniform(random) >= fraction) image.depth[i] = image.colour[i] = image.normal[i] = 0;
}

/// An eye on a ball of 0.5 to 0.9 m around the scene, above its floor.
inline glm::dvec3 random_eye(std::mt19937_64& random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double turn = 6.28318530718 * uniform(random), height = 0.05 + 0.4 * uniform(random),
               radius = 0.5 + 0.4 * uniform(random);
  return {radius * std::cos(turn), height, radius * std::sin(turn)};
}

}  // namespace telesplat::test
