#include "common/codec/walk.h"

namespace telesplat::codec::detail {
namespace {

Pixel at(const image::DepthImage& image, size_t i) { return {image.depth[i], image.colour[i], image.normal[i]}; }

}  // namespace

void encode_sparse(TileScratch& s, const image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  s.predictor.start(base);
  s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    const Pixel pixel = at(image, rect.index(x, y));
    const Magnitudes size = s.scatter_encoder.put(pixel, s.predictor.predict(x, y, neighbours));
    s.predictor.add(x, y, pixel, size);
    return true;
  });
}

bool decode_sparse(TileScratch& s, image::DepthImage& image, const TileRect& rect, const Pixel& base) {
  s.predictor.start(base);
  return s.scatter_walk(s.mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    Magnitudes size;
    const auto pixel = s.scatter_decoder.get(s.predictor.predict(x, y, neighbours), size);
    if (!pixel) return false;
    const size_t i = rect.index(x, y);
    image.depth[i] = pixel->depth, image.colour[i] = pixel->colour, image.normal[i] = pixel->normal;
    s.predictor.add(x, y, *pixel, size);
    return true;
  });
}

}  // namespace telesplat::codec::detail
