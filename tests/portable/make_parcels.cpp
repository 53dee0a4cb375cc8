// Writes parcels (parcels.h) of made-up data with this machine's codec: make_parcels FILE.
#include <cstdio>
#include <fstream>
#include <random>

#include "common/codec/depth_codec.h"
#include "common/codec/golomb.h"
#include "tests/portable/parcels.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::portable {
namespace {

using namespace codec::detail;
using Bytes = std::vector<uint8_t>;

class File {
 public:
  explicit File(const char* path) : out_(path, std::ios::binary) {}
  void add(Kind kind, const Bytes& bytes, uint64_t digest) {
    Bytes all;
    put(all, kind);
    put(all, static_cast<uint32_t>(bytes.size()));
    all.insert(all.end(), bytes.begin(), bytes.end());
    put(all, digest);
    out_.write(reinterpret_cast<const char*>(all.data()), static_cast<std::streamsize>(all.size()));
  }
  bool close() { return out_.close(), !out_.fail(); }

 private:
  std::ofstream out_;
};

void append(Bytes& out, std::span<const uint8_t> more) { out.insert(out.end(), more.begin(), more.end()); }

void add_golomb(File& file, std::mt19937& random) {
  constexpr uint32_t kCount = 20'000, kExpected = 40;
  BitWriter bits;
  bits.start(size_t{kCount} * GolombContext::kMostBits);
  GolombContext context;
  context.start(kExpected);
  Digest digest;
  for (uint32_t i = 0; i < kCount; ++i) {
    const int residual = static_cast<int>(random() >> (8 + random() % 24)) * (random() % 2 ? 1 : -1);
    context.put(residual, bits.sink);
    digest.add(static_cast<uint32_t>(residual));
  }
  Bytes out;
  put(out, kCount);
  put(out, kExpected);
  append(out, bits.bytes());
  file.add(Kind::kGolomb, out, digest.value());
}

Pixel at(const image::DepthImage& image, int x, int y) {
  const size_t i = static_cast<size_t>(y) * static_cast<size_t>(image.width) + static_cast<size_t>(x);
  return {image.depth[i], image.colour[i], image.normal[i]};
}

void add_scatter(File& file, const image::DepthImage& image, const Mask& mask) {
  const auto count = static_cast<uint32_t>(mask.count());
  Bytes out, places;
  for (const int n : {image.width, image.height, static_cast<int>(count)}) put(out, static_cast<uint32_t>(n));
  BitWriter bits;
  bits.start(size_t{count} * kParts * GolombContext::kMostBits);
  GolombContext context;
  context.start(100);
  ScatterWalk walk;
  ScatterPredictor predictor;
  predictor.start({});
  Digest digest;
  walk(mask, [&](int x, int y, std::span<const uint16_t> neighbours) {
    const Pixel pixel = at(image, x, y);
    int parts[kParts], guessed[kParts];
    parts_of(pixel, parts);
    parts_of(predictor.predict(x, y, neighbours), guessed);
    for (int i = 0; i < kParts; ++i) {
      context.put(parts[i] - guessed[i], bits.sink);
      digest.add(static_cast<uint32_t>(parts[i]));
    }
    predictor.add(x, y, pixel, {});
    return true;
  });
  for (int y = 0; y < image.height; ++y)
    image::for_each_set(mask.row(y), mask.words_per_row(), [&](size_t x) {
      put(places, static_cast<uint16_t>(x));
      put(places, static_cast<uint16_t>(y));
    });
  append(out, places);
  append(out, bits.bytes());
  file.add(Kind::kScatter, out, digest.value());
}

uint64_t digest_of(const image::DepthImage& image) {
  Digest digest;
  for (const int n : {image.width, image.height}) digest.add(static_cast<uint32_t>(n));
  for (size_t i = 0; i < image.pixels(); ++i)
    for (const uint32_t v : {image.depth[i], image.colour[i], uint32_t{image.normal[i]}}) digest.add(v);
  return digest.value();
}

// Adds the exact image, the bounded one, and its refinement.
void add_depth(File& file, const image::DepthImage& image) {
  file.add(Kind::kDepth, codec::encode(image), digest_of(image));
  image::DepthImage bounded;
  const auto stream = codec::encode(image, codec::error_bounds(1 / 32.0, 2 / 1280.0, 1, 1), &bounded);
  file.add(Kind::kDepth, stream, digest_of(bounded));
  Bytes out;
  put(out, static_cast<uint32_t>(stream.size()));
  append(out, stream);
  append(out, codec::encode_refinement(image, bounded));
  file.add(Kind::kRefinement, out, digest_of(image));
}

bool write(const char* path) {
  File file(path);
  std::mt19937 random(7);
  for (int round = 0; round < 3; ++round) add_golomb(file, random);
  for (const bool rough : {false, true}) {
    const auto image = test::render({.width = 256, .height = 200, .rough = rough});
    add_scatter(file, image, test::spread_mask(image.width, image.height, 32, 7));
    add_depth(file, image);
    add_depth(file, test::masked(image, test::spread_mask(image.width, image.height, 32, 7)));
    add_depth(file, test::masked(image, test::band_mask(image.width, image.height, 3)));
  }
  add_depth(file, test::render({.width = 300, .height = 280, .covers_all = false}));
  add_depth(file, test::facets(256, 200, 3));
  add_depth(file, test::masked(test::facets(190, 180, 2), test::band_mask(190, 180, 30)));
  return file.close();
}

}  // namespace
}  // namespace telesplat::portable

int main(int argc, char** argv) {
  if (argc == 2 && telesplat::portable::write(argv[1])) return 0;
  std::fprintf(stderr, argc == 2 ? "%s cannot be written\n" : "usage: make_parcels FILE\n", argv[argc - 1]);
  return 2;
}
