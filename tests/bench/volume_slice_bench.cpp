// The codec of slice images beside memcpy and plain zstd, block by block, on one core. B/px and Mpx/s count the pixels
// that are not transparent.
#include <benchmark/benchmark.h>
#include <zstd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>

#include "common/volume/slices/image.h"

namespace telesplat::volume {
namespace {

constexpr int kSide = 1024;

// A field of waves: soft is a translucent fog with a rim, hard has shells with an opaque surface, noisy is hard with a
// scanner's noise.
const SliceImage& test_image(const std::string& name) {
  static std::map<std::string, SliceImage> cache;
  if (const auto known = cache.find(name); known != cache.end()) return known->second;
  SliceImage image{0, 0, 1, {0, 0, kSide, kSide}, std::vector<uint32_t>(size_t{kSide} * kSide)};
  uint32_t random = 1;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      const double f = std::sin(x * 0.031) * std::cos(y * 0.023) + 0.6 * std::sin(0.011 * (x + 2 * y)) +
                       0.2 * std::sin(0.13 * x) * std::sin(0.11 * y);
      double alpha = name == "soft" ? std::clamp(f - 0.3, 0.0, 1.0) * 0.7 : f > 0.7 ? std::min(1.0, 3 * f - 1.5) : 0.0;
      const double light = 0.7 + 0.3 * std::sin(0.05 * x + 0.07 * y);
      random = random * 1664525u + 1013904223u;
      if (name == "noisy" && alpha > 0) alpha = std::clamp(alpha + ((random >> 24) / 256.0 - 0.5) * 0.05, 0.0, 1.0);
      const auto channel = [&](double c) { return uint32_t(std::lround(255 * alpha * light * c)); };
      const auto a = uint32_t(std::lround(255 * alpha));
      if (a != 0)
        image.pixels[size_t(y) * kSide + size_t(x)] = a << 24 | channel(1) << 16 | channel(0.8) << 8 | channel(0.6);
    }
  return cache.emplace(name, std::move(image)).first->second;
}

void report(benchmark::State& state, const SliceImage& image, size_t bytes) {
  const auto covered =
      double(std::count_if(image.pixels.begin(), image.pixels.end(), [](uint32_t p) { return p != 0; }));
  state.counters["B/px"] = double(bytes) / covered;
  state.counters["covered"] = covered / double(image.pixels.size());
  state.counters["Mpx/s"] =
      benchmark::Counter(covered * 1e-6 * double(state.iterations()), benchmark::Counter::kIsRate);
}

void encode(benchmark::State& state, const std::string& name) {
  const auto& image = test_image(name);
  size_t bytes = 0;
  for (auto _ : state) bytes = encode_slice(image).size();
  report(state, image, bytes);
}

void decode(benchmark::State& state, const std::string& name) {
  const auto& image = test_image(name);
  const auto bytes = encode_slice(image);
  SliceImage out;
  for (auto _ : state) {
    const auto slices = parse_slices(bytes, kSide, kSide, 1);
    if (!slices.ok() || !decode_slice_into(out, slices->front(), kSide, kSide)) return state.SkipWithError("refused");
  }
  report(state, image, bytes.size());
}

void copy(benchmark::State& state, const std::string& name) {
  const auto& image = test_image(name);
  std::vector<uint32_t> to(image.pixels.size());
  for (auto _ : state) {
    std::memcpy(to.data(), image.pixels.data(), to.size() * 4);
    benchmark::DoNotOptimize(to.data());
  }
  report(state, image, to.size() * 4);
}

std::vector<std::vector<uint32_t>> blocks_of(const SliceImage& image) {
  std::vector<std::vector<uint32_t>> out;
  for (int y = 0; y < kSide; y += kSliceBlock)
    for (int x = 0; x < kSide; x += kSliceBlock) {
      std::vector<uint32_t> block;
      for (int row = 0; row < kSliceBlock; ++row)
        block.insert(block.end(), &image.pixels[size_t(y + row) * kSide + size_t(x)],
                     &image.pixels[size_t(y + row) * kSide + size_t(x)] + kSliceBlock);
      if (std::any_of(block.begin(), block.end(), [](uint32_t p) { return p != 0; })) out.push_back(std::move(block));
    }
  return out;
}

void zstd(benchmark::State& state, const std::string& name, bool decodes) {
  const auto& image = test_image(name);
  const auto blocks = blocks_of(image);
  std::vector<std::vector<char>> packed(blocks.size(), std::vector<char>(ZSTD_compressBound(4 * blocks[0].size())));
  std::vector<uint32_t> out(blocks[0].size());
  size_t bytes = 0;
  std::vector<size_t> sizes(blocks.size());
  const auto pack = [&] {
    bytes = 0;
    for (size_t i = 0; i < blocks.size(); ++i)
      bytes += sizes[i] = ZSTD_compress(packed[i].data(), packed[i].size(), blocks[i].data(), 4 * blocks[i].size(), 1);
  };
  pack();
  for (auto _ : state) {
    if (!decodes) pack();
    for (size_t i = 0; i < blocks.size() && decodes; ++i)
      ZSTD_decompress(out.data(), 4 * out.size(), packed[i].data(), sizes[i]);
  }
  report(state, image, bytes);
}

const bool registered = [] {
  const auto add = [](const std::string& name, auto function) {
    benchmark::RegisterBenchmark(name.c_str(), function)->Unit(benchmark::kMillisecond);
  };
  for (const std::string image : {"soft", "hard", "noisy"}) {
    const std::string name = "volume_slice/" + image + "/";
    add(name + "encode", [image](benchmark::State& s) { encode(s, image); });
    add(name + "decode", [image](benchmark::State& s) { decode(s, image); });
    add(name + "memcpy", [image](benchmark::State& s) { copy(s, image); });
    add(name + "zstd_1_encode", [image](benchmark::State& s) { zstd(s, image, false); });
    add(name + "zstd_1_decode", [image](benchmark::State& s) { zstd(s, image, true); });
  }
  return true;
}();

}  // namespace
}  // namespace telesplat::volume
