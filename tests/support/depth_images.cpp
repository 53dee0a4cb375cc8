#include "tests/support/depth_images.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <glm/geometric.hpp>
#include <limits>
#include <random>
#include <vector>

#include "common/geometry/camera.h"
#include "common/image/normal.h"

namespace telesplat::test {
namespace {

using image::DepthImage;

// Uniform in [0, 1), a pure function of its arguments.
double lattice(int32_t x, int32_t y, uint32_t seed) {
  uint32_t h = static_cast<uint32_t>(x) * 0x8DA6B343u ^ static_cast<uint32_t>(y) * 0xD8163841u ^ seed * 0xCB1AB31Fu;
  h = (h ^ h >> 16) * 0x7FEB352Du;
  h = (h ^ h >> 15) * 0x846CA68Bu;
  return (h ^ h >> 16) * 0x1p-32;
}

double smooth_noise(double x, double y, uint32_t seed) {
  const double fx = std::floor(x), fy = std::floor(y), u = x - fx, v = y - fy;
  const auto at = [&](int i, int j) {
    return lattice(static_cast<int32_t>(fx) + i, static_cast<int32_t>(fy) + j, seed);
  };
  const double a = u * u * (3 - 2 * u), b = v * v * (3 - 2 * v);
  return (at(0, 0) * (1 - a) + at(1, 0) * a) * (1 - b) + (at(0, 1) * (1 - a) + at(1, 1) * a) * b;
}

class Terrain {
 public:
  explicit Terrain(const TerrainView& view) : view_(view) {
    for (uint32_t i = 0; i < 6; ++i) {
      const auto random = [&](int k) { return lattice(static_cast<int32_t>(i), k, view.seed + 77); };
      const double radius = 0.02 + 0.04 * random(0), x = 0.5 * random(1) - 0.25, z = 0.5 * random(2) - 0.25;
      spheres_.push_back({glm::dvec3(x, height(x, z) + radius * 0.6, z), radius});
    }
  }

  double height(double x, double z) const {
    double h = 0, scale = 6, amplitude = 0.05;
    for (int octave = 0; octave < (view_.rough ? 9 : 4); ++octave, scale *= 2.1, amplitude *= 0.47)
      h += amplitude * (smooth_noise(x * scale, z * scale, view_.seed + static_cast<uint32_t>(octave)) - 0.5);
    return h;
  }

  glm::dvec3 normal(double x, double z) const {
    constexpr double kStep = 5e-4;
    return glm::normalize(glm::dvec3(height(x - kStep, z) - height(x + kStep, z), 2 * kStep,
                                     height(x, z - kStep) - height(x, z + kStep)));
  }

  // Finds the distance along `direction` (in units of its length) to the first hit, and the normal there.
  bool hit(const glm::dvec3& origin, const glm::dvec3& direction, double& t, glm::dvec3& n) const {
    bool found = false;
    double last = (0.06 - origin.y) / direction.y;  // above the whole terrain
    double gap = 1;
    for (double at = last; at < 4; at += std::max(0.001, gap * 0.4)) {
      const glm::dvec3 p = origin + at * direction;
      gap = p.y - height(p.x, p.z);
      if (gap > 0) {
        last = at;
        continue;
      }
      double above = last, below = at;
      for (int i = 0; i < 16; ++i) {
        const double middle = 0.5 * (above + below);
        const glm::dvec3 q = origin + middle * direction;
        (q.y > height(q.x, q.z) ? above : below) = middle;
      }
      const glm::dvec3 q = origin + below * direction;
      if (!view_.covers_all && std::max(std::abs(q.x), std::abs(q.z)) > 0.3) break;
      t = below, n = normal(q.x, q.z), found = true;
      break;
    }
    for (const Sphere& s : spheres_) {
      const glm::dvec3 to = origin - s.centre;
      const double a = glm::dot(direction, direction), b = glm::dot(to, direction),
                   c = glm::dot(to, to) - s.radius * s.radius;
      const double root = b * b - a * c;
      if (root < 0) continue;
      const double at = (-b - std::sqrt(root)) / a;
      if (found && at > t) continue;
      t = at, n = glm::normalize(to + at * direction), found = true;
    }
    return found;
  }

  uint32_t colour(const glm::dvec3& p) const {
    if (view_.constant_albedo) return 0xC0B8A8;
    const double h = std::clamp(p.y * 12 + 0.5, 0.0, 1.0), patch = smooth_noise(p.x * 40, p.z * 40, view_.seed + 99);
    const double grain = view_.rough ? smooth_noise(p.x * 300, p.z * 300, view_.seed + 98) * 12 : 0;
    const auto channel = [&](double low, double high) {
      return static_cast<uint32_t>(low + (high - low) * h + 20 * patch + grain);
    };
    return channel(60, 190) << 16 | channel(100, 180) << 8 | channel(50, 150);
  }

 private:
  struct Sphere {
    glm::dvec3 centre;
    double radius;
  };
  TerrainView view_;
  std::vector<Sphere> spheres_;
};

void clear(DepthImage& image, size_t i) { image.depth[i] = 0, image.colour[i] = 0, image.normal[i] = 0; }

}  // namespace

DepthImage render(const TerrainView& view) {
  const Terrain terrain(view);
  const double pitch = -50 * 3.14159265358979323846 / 180;
  const geometry::Pose pose{{0, 0.5, 0.42}, glm::dquat(std::cos(pitch / 2), std::sin(pitch / 2), 0, 0)};
  const auto camera = geometry::make_camera(pose, view.covers_all ? 55 : 90, view.width, view.height);
  DepthImage image(view.width, view.height);
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      const glm::dvec3 direction = camera.unproject(x + 0.5, y + 0.5, 1) - pose.position_room;  // depth 1: t is depth
      double depth = 0;
      glm::dvec3 normal{0};
      if (!terrain.hit(pose.position_room, direction, depth, normal)) continue;
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(view.width) + static_cast<size_t>(x);
      image.depth[i] = image::encode_depth(depth, camera.near_m);
      image.normal[i] = image::encode_normal16(normal);
      image.colour[i] = terrain.colour(pose.position_room + depth * direction);
    }
  return image;
}

DepthImage plane(int width, int height, double slope_x, double slope_y) {
  DepthImage image(width, height);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const size_t i = static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x);
      image.depth[i] =
          static_cast<uint32_t>(std::clamp(4e6 + slope_x * x + slope_y * y, 1.0, double{image::kMaxDepthCode}));
      image.colour[i] = static_cast<uint32_t>(x & 255) << 16 | static_cast<uint32_t>(y & 255) << 8 |
                        static_cast<uint32_t>((x + y) / 2 & 255);
      image.normal[i] = 0x7F90;
    }
  return image;
}

DepthImage facets(int width, int height, uint32_t seed, int spread) {
  std::mt19937 random(seed);
  DepthImage image = plane(width, height, 0, 0);
  const int columns = width / 5 + 2;
  struct Corner {
    double depth, x, y;
  };
  std::vector<Corner> corners(static_cast<size_t>(columns * (height / 5 + 2)));
  for (Corner& c : corners) {
    c.depth = 4e6 + static_cast<double>(random() % 60000);
    c.x = 127 - spread / 2 + static_cast<double>(random() % static_cast<uint32_t>(spread));
    c.y = 127 - spread / 2 + static_cast<double>(random() % static_cast<uint32_t>(spread));
  }
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const double u = x % 5 / 5.0, v = y % 5 / 5.0;
      const auto at = [&](int i, int j) { return corners[static_cast<size_t>((y / 5 + j) * columns + x / 5 + i)]; };
      const auto between = [&](double Corner::*of) {
        return u + v < 1
                   ? at(0, 0).*of + u * (at(1, 0).*of - at(0, 0).*of) + v * (at(0, 1).*of - at(0, 0).*of)
                   : at(1, 1).*of + (1 - u) * (at(0, 1).*of - at(1, 1).*of) + (1 - v) * (at(1, 0).*of - at(1, 1).*of);
      };
      const auto i = static_cast<size_t>(y * width + x);
      image.depth[i] = static_cast<uint32_t>(between(&Corner::depth)), image.colour[i] = 0x8090A0;
      image.normal[i] =
          static_cast<uint16_t>(static_cast<int>(between(&Corner::x)) | static_cast<int>(between(&Corner::y)) << 8);
    }
  return image;
}

DepthImage random_pixels(int width, int height, double density, uint32_t seed) {
  std::mt19937 random(seed);
  DepthImage image(width, height);
  for (size_t i = 0; i < image.pixels(); ++i) {
    const uint32_t depth = random(), colour = random(), normal = random();
    if (random() * 0x1p-32 >= density) continue;
    image.depth[i] = std::max(depth & image::kMaxDepthCode, 1u);
    image.colour[i] = colour & 0xFFFFFF;
    image.normal[i] = static_cast<uint16_t>(normal);
  }
  return image;
}

void keep_random(DepthImage& image, double density, uint32_t seed) {
  std::mt19937 random(seed);
  for (size_t i = 0; i < image.pixels(); ++i)
    if (random() * 0x1p-32 >= density) clear(image, i);
}

void keep_outlines(DepthImage& image) {
  const DepthImage whole = image;
  const auto depth = [&](int x, int y) {
    const int u = std::clamp(x, 0, image.width - 1), v = std::clamp(y, 0, image.height - 1);
    return static_cast<int64_t>(
        whole.depth[static_cast<size_t>(v) * static_cast<size_t>(image.width) + static_cast<size_t>(u)]);
  };
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      const int64_t here = depth(x, y);
      const int64_t across = 2 * here - depth(x - 1, y) - depth(x + 1, y),
                    down = 2 * here - depth(x, y - 1) - depth(x, y + 1);
      if (std::max(std::abs(across), std::abs(down)) * 50 <= here)
        clear(image, static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x));
    }
}

DepthImage crop(const DepthImage& image, int x, int y, int width, int height) {
  DepthImage part(width, height);
  for (int row = 0; row < height; ++row) {
    const size_t from = static_cast<size_t>(y + row) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
    const size_t to = static_cast<size_t>(row) * static_cast<size_t>(width);
    std::copy_n(image.depth.begin() + static_cast<ptrdiff_t>(from), width,
                part.depth.begin() + static_cast<ptrdiff_t>(to));
    std::copy_n(image.colour.begin() + static_cast<ptrdiff_t>(from), width,
                part.colour.begin() + static_cast<ptrdiff_t>(to));
    std::copy_n(image.normal.begin() + static_cast<ptrdiff_t>(from), width,
                part.normal.begin() + static_cast<ptrdiff_t>(to));
  }
  return part;
}

bool is_canonical(const DepthImage& image) {
  const size_t pixels = static_cast<size_t>(image.width) * static_cast<size_t>(image.height);
  if (image.width < 1 || image.height < 1 || image.depth.size() != pixels || image.colour.size() != pixels ||
      image.normal.size() != pixels)
    return false;
  for (size_t i = 0; i < pixels; ++i) {
    if (image.depth[i] > image::kMaxDepthCode || image.colour[i] > 0xFFFFFF) return false;
    if (image.depth[i] == 0 && (image.colour[i] != 0 || image.normal[i] != 0)) return false;
  }
  return true;
}

}  // namespace telesplat::test
