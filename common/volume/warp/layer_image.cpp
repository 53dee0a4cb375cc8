#include "common/volume/warp/layer_image.h"

#include <algorithm>
#include <cstring>
#include <numeric>

namespace telesplat::volume {
namespace {

constexpr int kBlock = LayerImage::kBlock;

bool fits(const SliceImage& image, const ShearFrame& shear) {
  const geometry::Rect& r = image.rect;
  return image.layer >= 0 && static_cast<size_t>(image.layer) < shear.layers.size() && r.width > 0 && r.height > 0 &&
         r.x >= 0 && r.y >= 0 && r.width <= shear.width - r.x && r.height <= shear.height - r.y &&
         image.pixels.size() == static_cast<size_t>(r.width) * static_cast<size_t>(r.height);
}

geometry::Rect united(const geometry::Rect& a, const geometry::Rect& b) {
  const int x = std::min(a.x, b.x), y = std::min(a.y, b.y);
  return {x, y, std::max(a.x + a.width, b.x + b.width) - x, std::max(a.y + a.height, b.y + b.height) - y};
}

uint32_t over(uint32_t front, uint32_t back) {
  const uint32_t through = 255 - (front >> 24);
  uint32_t out = 0;
  for (int shift = 0; shift < 32; shift += 8) {
    const uint32_t sum = (front >> shift & 255) + ((back >> shift & 255) * through + 127) / 255;
    out |= std::min(sum, 255u) << shift;
  }
  return out;
}

void draw_behind(const SliceImage& image, LayerImage& out) {
  const size_t width = static_cast<size_t>(image.rect.width);
  for (int y = 0; y < image.rect.height; ++y) {
    const uint32_t* from = image.pixels.data() + static_cast<size_t>(y) * width;
    uint32_t* to = const_cast<uint32_t*>(out.row(image.rect.y - out.rect.y + y)) + (image.rect.x - out.rect.x);
    for (size_t x = 0; x < width; ++x)
      if (from[x] && to[x] >> 24 != 255) to[x] = to[x] ? over(to[x], from[x]) : from[x];
  }
}

void find_filled(LayerImage& image) {
  const int blocks_x = (image.pitch + kBlock - 1) / kBlock, blocks_y = (image.rows() + kBlock - 1) / kBlock;
  image.block_pitch = blocks_x + 1;
  image.filled.assign(static_cast<size_t>(image.block_pitch) * static_cast<size_t>(blocks_y + 1), 0);
  for (int y = 0; y < image.rows(); ++y) {
    const uint32_t* row = image.texels.data() + static_cast<ptrdiff_t>(y) * image.pitch;
    uint8_t* blocks = image.filled.data() + static_cast<ptrdiff_t>(y / kBlock) * image.block_pitch;
    for (int b = 0; b < blocks_x; ++b) {
      if (blocks[b]) continue;
      const int end = std::min((b + 1) * kBlock, image.pitch);
      uint32_t any = 0;
      for (int x = b * kBlock; x < end; ++x) any |= row[x];
      blocks[b] = any != 0;
    }
  }
  // In place: blocks to the right and below are still unchanged.
  for (int by = 0; by < blocks_y; ++by) {
    uint8_t *here = image.filled.data() + static_cast<ptrdiff_t>(by) * image.block_pitch,
            *below = here + image.block_pitch;
    for (int bx = 0; bx < blocks_x; ++bx)
      here[bx] = static_cast<uint8_t>(here[bx] | here[bx + 1] | below[bx] | below[bx + 1]);
  }
}

}  // namespace

bool LayerImage::may_fill(int x0, int y0, int x1, int y1) const {
  for (int by = y0 / kBlock; by <= y1 / kBlock; by += 2)
    for (int bx = x0 / kBlock; bx <= x1 / kBlock; bx += 2)
      if (filled[static_cast<size_t>(by) * static_cast<size_t>(block_pitch) + static_cast<size_t>(bx)]) return true;
  return false;
}

std::vector<int> slab_order(std::span<const SliceImage> images, const glm::dvec3& eye) {
  std::vector<int> out(images.size());
  std::iota(out.begin(), out.end(), 0);
  const auto distance = [&](const SliceImage& image) {
    return std::max({image.k_begin - 0.5 - eye.z, eye.z - (image.k_end - 0.5), 0.0});
  };
  std::stable_sort(out.begin(), out.end(), [&](int a, int b) {
    const SliceImage &ia = images[static_cast<size_t>(a)], &ib = images[static_cast<size_t>(b)];
    return ia.layer != ib.layer ? ia.layer < ib.layer : distance(ia) < distance(ib);
  });
  return out;
}

std::vector<LayerImage> merge_layers(std::span<const SliceImage> images, const ShearFrame& shear) {
  std::vector<int> order = slab_order(images, shear.eye);
  std::erase_if(order, [&](int i) { return !fits(images[static_cast<size_t>(i)], shear); });
  const auto image = [&](size_t i) -> const SliceImage& { return images[static_cast<size_t>(order[i])]; };
  std::vector<LayerImage> out;
  for (size_t begin = 0, end = 0; begin < order.size(); begin = end) {
    LayerImage& layer = out.emplace_back();
    layer.layer = image(begin).layer;
    layer.rect = image(begin).rect;
    for (end = begin; end < order.size() && image(end).layer == layer.layer; ++end)
      layer.rect = united(layer.rect, image(end).rect);
    layer.pitch = layer.rect.width + 3;
    layer.texels.assign(static_cast<size_t>(layer.pitch) * static_cast<size_t>(layer.rows()), 0);
    for (size_t i = begin; i < end; ++i) draw_behind(image(i), layer);
    find_filled(layer);
  }
  return out;
}

}  // namespace telesplat::volume
