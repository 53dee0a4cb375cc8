#include "common/codec/walk.h"

namespace telesplat::codec::detail {
namespace {

Pixel at(const image::DepthImage& image, size_t i) { return {image.depth[i], image.colour[i], image.normal[i]}; }

}  // namespace

void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole) {
  s.predictor.start({base.depth, base.colour, turn_normal(base.normal, pole)});
  s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    Pixel pixel = at(image, rect.index(x, y));
    pixel.normal = turn_normal(pixel.normal, pole);
    const Magnitudes size = s.scatter_encoder.put(x, y, pixel, s.predictor.predict(x, y, neighbours));
    s.predictor.add(x, y, pixel, size);
    return true;
  });
}

bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base, int pole) {
  s.predictor.start({base.depth, base.colour, turn_normal(base.normal, pole)});
  return s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    Magnitudes size;
    const auto pixel = s.scatter_decoder.get(x, y, s.predictor.predict(x, y, neighbours), size);
    if (!pixel) return false;
    const size_t i = rect.index(x, y);
    image.depth[i] = pixel->depth, image.colour[i] = pixel->colour, image.normal[i] = turn_back(pixel->normal, pole);
    s.predictor.add(x, y, *pixel, size);
    return true;
  });
}

}  // namespace telesplat::codec::detail
