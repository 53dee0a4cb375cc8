#include "tools/telesplat/bench/codec/errors.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "common/core/check.h"
#include "common/image/normal.h"

namespace telesplat::launcher {
namespace {

constexpr int kGap = 8;           // pixels between maps
constexpr int kMostSide = 16384;  // of a picture
constexpr double kMagnified = 8;

uint32_t grey_level(double v) { return uint32_t(std::clamp(v, 0.0, 255.0)); }

// x and y of a normal's code, -127 to 127.
std::array<int, 2> coordinates(uint16_t code) {
  return {std::min(code & 255, 254) - 127, std::min(code >> 8, 254) - 127};
}

struct MapPixel {
  uint32_t depth = 0, normal = 0, colour = 0;
};

MapPixel map_pixel(const image::DepthImage& a, const image::DepthImage& b, size_t i, double focal_px) {
  if (a.depth[i] == 0 && b.depth[i] == 0) return {};
  if (a.depth[i] == 0 || b.depth[i] == 0) return {0xff00ff, 0, 0};
  MapPixel out;
  out.depth = 0x010101 * grey_level(255 * kMagnified * depth_error_px(a.depth[i], b.depth[i], focal_px));
  out.normal = grey_level(kMagnified * normal_distance(a.normal[i], b.normal[i])) << 16 |
               grey_level(kMagnified * normal_angle_deg(a.normal[i], b.normal[i])) << 8;
  for (int shift = 0; shift < 24; shift += 8) {
    const int step = std::abs(int(a.colour[i] >> shift & 255) - int(b.colour[i] >> shift & 255));
    out.colour |= grey_level(kMagnified * step) << shift;
  }
  return out;
}

}  // namespace

double depth_error_px(uint32_t original, uint32_t decoded, double focal_px) {
  return focal_px * std::abs(double(original) - double(decoded)) / double(decoded);
}

int normal_distance(uint16_t a, uint16_t b) {
  constexpr int kAcross = 254;  // from rim to rim
  const auto [ax, ay] = coordinates(a);
  const auto [bx, by] = coordinates(b);
  // b, and what it is in the maps beyond the four sides and the four corners.
  const std::array<int, 2> places[] = {{bx, by},
                                       {kAcross - bx, -by},
                                       {-kAcross - bx, -by},
                                       {-bx, kAcross - by},
                                       {-bx, -kAcross - by},
                                       {bx + kAcross, by + kAcross},
                                       {bx + kAcross, by - kAcross},
                                       {bx - kAcross, by + kAcross},
                                       {bx - kAcross, by - kAcross}};
  int least = kAcross;
  for (const auto& [x, y] : places) least = std::min(least, std::max(std::abs(ax - x), std::abs(ay - y)));
  return least;
}

double normal_angle_deg(uint16_t a, uint16_t b) {
  const glm::vec3 p = image::octahedral16(a), q = image::octahedral16(b);
  const glm::dvec3 u(p), v(q);
  // Not by the cosine, which says little of small angles.
  return std::atan2(glm::length(glm::cross(u, v)), glm::dot(u, v)) * 180 / std::numbers::pi;
}

int colour_distance(uint32_t a, uint32_t b) {
  int most = 0;
  for (int shift = 0; shift < 24; shift += 8)
    most = std::max(most, std::abs(int(a >> shift & 255) - int(b >> shift & 255)));
  return most;
}

void add_errors(const image::DepthImage& original, const image::DepthImage& decoded, double focal_px, CodecErrors& to) {
  CHECK(original.width == decoded.width && original.height == decoded.height);
  for (size_t i = 0; i < original.pixels(); ++i) {
    const uint32_t a = original.depth[i], b = decoded.depth[i];
    to.uncovered += (a == 0) != (b == 0);
    if (a == 0 || b == 0) continue;
    ++to.pixels;
    if (a != b) to.depth_px.add(depth_error_px(a, b, focal_px));
    if (original.normal[i] != decoded.normal[i]) {
      to.normal_codes.add(normal_distance(original.normal[i], decoded.normal[i]));
      to.normal_deg.add(normal_angle_deg(original.normal[i], decoded.normal[i]));
    }
    if (original.colour[i] != decoded.colour[i])
      to.colour_codes.add(colour_distance(original.colour[i], decoded.colour[i]));
  }
}

image::View error_maps(const image::DepthImage& original, const image::DepthImage& decoded, double focal_px) {
  CHECK(original.width == decoded.width && original.height == decoded.height);
  image::View out{3 * original.width + 2 * kGap, original.height, {}, {}};
  out.colour.assign(size_t(out.width) * size_t(out.height), 0x404040);
  const auto step = size_t(original.width + kGap);
  for (int y = 0; y < original.height; ++y)
    for (int x = 0; x < original.width; ++x) {
      const auto pixel = map_pixel(original, decoded, size_t(y) * size_t(original.width) + size_t(x), focal_px);
      uint32_t* to = &out.colour[size_t(y) * size_t(out.width) + size_t(x)];
      to[0] = pixel.depth, to[step] = pixel.normal, to[2 * step] = pixel.colour;
    }
  return out;
}

Result<image::View> stacked(const std::vector<image::View>& pictures) {
  image::View out;
  for (const image::View& p : pictures) {
    out.width = std::max(out.width, p.width);
    out.height += p.height + (out.height > 0 ? kGap : 0);
  }
  if (out.width > kMostSide || out.height > kMostSide)
    return Error{fmt::format("the error sheet would have {} x {} pixels, limit {} a side: name fewer files", out.width,
                             out.height, kMostSide)};
  out.colour.assign(size_t(out.width) * size_t(out.height), 0x404040);
  size_t row = 0;
  for (const image::View& p : pictures) {
    for (int y = 0; y < p.height; ++y)
      std::copy_n(&p.colour[size_t(y) * size_t(p.width)], p.width, &out.colour[(row + size_t(y)) * size_t(out.width)]);
    row += size_t(p.height) + kGap;
  }
  return out;
}

}  // namespace telesplat::launcher
