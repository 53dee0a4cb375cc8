// The depth-image codec beside LZW (TIFF with predictor), PNG and zstd, on the same whole images of 1280 x 800 pixels.
// B/px: bytes per covered pixel. Mpx/s: pixels of the image per second, on one core.
#include <benchmark/benchmark.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <span>
#include <string>

#include "common/codec/depth_codec.h"
#include "tests/bench/plane_file.h"
#include "tests/support/depth_images.h"
#include "tests/support/masks.h"

namespace telesplat::codec {
namespace {

using image::DepthImage;
using Bytes = std::vector<uint8_t>;

// Name -> image, rendered once. full_*: every pixel is covered. patch_*: pixels that redundancy elimination may leave.
const DepthImage& test_image(const std::string& name) {
  static std::map<std::string, DepthImage> cache;
  if (const auto known = cache.find(name); known != cache.end()) return known->second;
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  DepthImage image =
      test::render({.rough = has("rough"), .constant_albedo = has("albedo"), .covers_all = !has("object")});
  if (has("outlines")) test::keep_outlines(image);
  if (has("spread")) image = test::masked(image, test::spread_mask(image.width, image.height, 32, 7));
  if (has("bands")) image = test::masked(image, test::band_mask(image.width, image.height, 3));
  if (has("lines")) image = test::masked(image, test::band_mask(image.width, image.height, 1));
  if (const size_t at = name.find("random_"); at != std::string::npos)
    test::keep_random(image, std::atof(name.c_str() + at + 7), 1);
  return cache.emplace(name, std::move(image)).first->second;
}

// Cuts an image as a session does: 20 tiles of 256 x 200.
std::vector<DepthImage> tiles_of(const DepthImage& image) {
  std::vector<DepthImage> tiles;
  for (int y = 0; y < image.height; y += 200)
    for (int x = 0; x < image.width; x += 256) tiles.push_back(test::crop(image, x, y, 256, 200));
  return tiles;
}

void report(benchmark::State& state, const DepthImage& image, size_t bytes) {
  const auto covered = std::count_if(image.depth.begin(), image.depth.end(), [](uint32_t d) { return d != 0; });
  const double pixels = static_cast<double>(image.pixels());
  state.counters["B/px"] = static_cast<double>(bytes) / static_cast<double>(covered);
  state.counters["covered"] = static_cast<double>(covered) / pixels;
  state.counters["Mpx/s"] =
      benchmark::Counter(pixels * 1e-6 * static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["s/covered"] =
      benchmark::Counter(static_cast<double>(covered) * static_cast<double>(state.iterations()),
                         benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void encode_tiles(benchmark::State& state, const std::string& name) {
  const auto tiles = tiles_of(test_image(name));
  size_t bytes = 0;
  for (auto _ : state) {
    bytes = 0;
    for (const DepthImage& tile : tiles) bytes += encode(tile).size();
  }
  report(state, test_image(name), bytes);
}

void decode_tiles(benchmark::State& state, const std::string& name) {
  std::vector<Bytes> streams;
  size_t bytes = 0;
  for (const DepthImage& tile : tiles_of(test_image(name))) bytes += streams.emplace_back(encode(tile)).size();
  DepthImage image;
  for (auto _ : state)
    for (const Bytes& stream : streams)
      if (!decode_into(image, stream).ok()) return state.SkipWithError("not decoded");
  report(state, test_image(name), bytes);
}

// Returns byte planes, interleaved by `channels`.
Bytes depth_bytes(const DepthImage& image) {
  Bytes out;
  for (const uint32_t d : image.depth)
    for (int shift = 16; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(d >> shift));
  return out;
}
Bytes colour_bytes(const DepthImage& image) {
  Bytes out;
  for (const uint32_t c : image.colour)
    for (int shift = 16; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(c >> shift));
  return out;
}
Bytes normal_bytes(const DepthImage& image) {
  Bytes out;
  for (const uint16_t n : image.normal)
    for (int shift = 0; shift <= 8; shift += 8) out.push_back(static_cast<uint8_t>(n >> shift));
  return out;
}

void image_file(benchmark::State& state, const std::string& name, const std::string& extension,
                const std::string& compression) {
  const DepthImage& image = test_image(name);
  const Bytes depth = depth_bytes(image), colour = colour_bytes(image), normal = normal_bytes(image);
  const auto size = [&](auto values, int channels, int value_bytes) {
    return image::plane_file_bytes(extension, compression, image.width, image.height, channels, value_bytes,
                                   std::as_bytes(values));
  };
  size_t bytes = 0;
  for (auto _ : state) {
    size_t depth_size = size(std::span(depth), 3, 1);
    const size_t colour_size = size(std::span(colour), 3, 1), normal_size = size(std::span(normal), 2, 1);
    // Take the smaller file: of three bytes, or of one number, a pixel.
    if (extension == "tif")
      if (const size_t whole = size(std::span(image.depth), 1, 4); whole != 0) depth_size = std::min(depth_size, whole);
    if (depth_size == 0 || colour_size == 0 || normal_size == 0) return state.SkipWithError("not written");
    bytes = depth_size + colour_size + normal_size;
  }
  report(state, image, bytes);
}

void zstd_planes(benchmark::State& state, const std::string& name, int level) {
  const DepthImage& image = test_image(name);
  Bytes planes;  // one byte plane after the other
  const std::pair<Bytes, size_t> parts[] = {
      {depth_bytes(image), 3}, {colour_bytes(image), 3}, {normal_bytes(image), 2}};
  for (const auto& [bytes, channels] : parts)
    for (size_t c = 0; c < channels; ++c)
      for (size_t i = c; i < bytes.size(); i += channels) planes.push_back(bytes[i]);
  Bytes packed(ZSTD_compressBound(planes.size()));
  size_t bytes = 0;
  for (auto _ : state) bytes = ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), level);
  report(state, image, bytes);
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto function) {
    benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMillisecond);
  };
  for (const std::string image :
       {"full_smooth", "full_smooth_albedo", "full_rough", "full_rough_albedo", "object_rough"}) {
    const std::string name = "codec/" + image + "/";
    add(name + "encode", [image](benchmark::State& s) { encode_tiles(s, image); });
    add(name + "decode", [image](benchmark::State& s) { decode_tiles(s, image); });
    add(name + "tiff_lzw", [image](benchmark::State& s) { image_file(s, image, "tif", "lzw"); });
    add(name + "png", [image](benchmark::State& s) { image_file(s, image, "png", ""); });
    for (const int level : {1, 3})
      add(name + "zstd_" + std::to_string(level),
          [image, level](benchmark::State& s) { zstd_planes(s, image, level); });
  }
  // Masked tiles: compare the time a pixel with full_smooth and full_rough.
  for (const std::string image :
       {"patch_outlines", "patch_random_0.3", "patch_random_0.03", "patch_random_0.001", "sparse_spread_smooth",
        "sparse_spread_rough", "sparse_bands_rough", "sparse_lines_rough", "sparse_random_0.1_rough"}) {
    const std::string name = "codec/" + image + "/";
    add(name + "encode", [image](benchmark::State& s) { encode_tiles(s, image); });
    add(name + "decode", [image](benchmark::State& s) { decode_tiles(s, image); });
    add(name + "zstd_1", [image](benchmark::State& s) { zstd_planes(s, image, 1); });
  }
  return true;
}();

}  // namespace
}  // namespace telesplat::codec
