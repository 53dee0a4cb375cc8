#include "services/data/texture/texture.h"

#include <algorithm>
#include <cmath>

#include "common/image/srgb.h"
#include "services/data/base/refusal.h"

namespace telesplat::data {
namespace {

int64_t wrapped(int64_t i, int64_t size, Wrap wrap) {
  if (wrap == Wrap::kClamp) return std::clamp<int64_t>(i, 0, size - 1);
  const int64_t period = wrap == Wrap::kMirror ? 2 * size : size;
  const int64_t at = ((i % period) + period) % period;
  return at < size ? at : period - 1 - at;
}

}  // namespace

glm::vec3 linear_of(uint32_t rgb) {
  const auto& table = image::linear_of_srgb();
  return {table[rgb >> 16 & 255], table[rgb >> 8 & 255], table[rgb & 255]};
}

Texture::Texture(image::View picture, Wrap wrap_u, Wrap wrap_v, bool nearest)
    : wrap_{wrap_u, wrap_v}, nearest_(nearest) {
  CHECK(picture.width > 0 && picture.height > 0);
  levels_.push_back({picture.width, picture.height, std::move(picture.colour)});
  const auto& texels = levels_[0].texels;
  plain_ = std::all_of(texels.begin(), texels.end(), [&](uint32_t t) { return ((t ^ texels[0]) & 0xffffff) == 0; });
  while (levels_.back().width > 1 || levels_.back().height > 1) {
    const Level& from = levels_.back();
    Level to{std::max(1, from.width / 2), std::max(1, from.height / 2), {}};
    to.texels.reserve(size_t(to.width) * size_t(to.height));
    // Means of linear light, over all texels below one of the smaller picture.
    for (int y = 0; y < to.height; ++y)
      for (int x = 0; x < to.width; ++x) {
        glm::vec3 sum(0);
        const int x0 = int(int64_t{x} * from.width / to.width), x1 = int((int64_t{x} + 1) * from.width / to.width);
        const int y0 = int(int64_t{y} * from.height / to.height), y1 = int((int64_t{y} + 1) * from.height / to.height);
        for (int v = y0; v < y1; ++v)
          for (int u = x0; u < x1; ++u) sum += linear_of(from.texels[size_t(v) * size_t(from.width) + size_t(u)]);
        sum /= float((x1 - x0) * (y1 - y0));
        to.texels.push_back(image::srgb_of_linear(sum.r) << 16 | image::srgb_of_linear(sum.g) << 8 |
                            image::srgb_of_linear(sum.b));
      }
    levels_.push_back(std::move(to));
  }
}

glm::vec3 Texture::texel(const Level& level, int64_t x, int64_t y) const {
  return linear_of(level.texels[size_t(wrapped(y, level.height, wrap_[1])) * size_t(level.width) +
                                size_t(wrapped(x, level.width, wrap_[0]))]);
}

glm::vec3 Texture::sample(glm::vec2 uv, int level) const {
  const Level& at = levels_[size_t(std::clamp(level, 0, int(levels_.size()) - 1))];
  const double x = double(uv.x) * at.width, y = double(uv.y) * at.height;
  if (nearest_ && level <= 0) return texel(at, int64_t(std::floor(x)), int64_t(std::floor(y)));
  const double left = std::floor(x - 0.5), upper = std::floor(y - 0.5);
  const auto fx = float(x - 0.5 - left), fy = float(y - 0.5 - upper);
  const auto x0 = int64_t(left), y0 = int64_t(upper);
  const glm::vec3 above = texel(at, x0, y0) * (1 - fx) + texel(at, x0 + 1, y0) * fx;
  const glm::vec3 below = texel(at, x0, y0 + 1) * (1 - fx) + texel(at, x0 + 1, y0 + 1) * fx;
  return above * (1 - fy) + below * fy;
}

float Texture::texels(glm::vec2 from, glm::vec2 to) const {
  return std::hypot((to.x - from.x) * float(width()), (to.y - from.y) * float(height()));
}

uint32_t NamedTextures::number_of(const std::string& picture, Wrap wrap) {
  const auto [entry, is_new] = numbers_.try_emplace({picture, wrap}, uint32_t(all_.size()));
  if (!is_new) return entry->second;
  const auto bytes = companions_.read(picture);
  if (!bytes) {
    notes_.push_back(fmt::format("{}: the texture {} is not there; the colours without it are shown", file_, picture));
    return entry->second = kNoTexture;
  }
  auto view = companions_.picture(*bytes, picture, room_);
  if (!view) refuse("{}: {}", file_, view.error().text);
  room_ -= view->colour.size();
  all_.push_back(std::make_shared<Texture>(std::move(*view), wrap, wrap));
  return entry->second;
}

}  // namespace telesplat::data
