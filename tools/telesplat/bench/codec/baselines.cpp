#include "tools/telesplat/bench/codec/baselines.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/image/plane_file.h"
#include "tools/telesplat/bench/codec/lzw.h"
#include "tools/telesplat/bench/codec/rvl.h"
#include "tools/telesplat/bench/codec/zstd_size.h"

namespace telesplat::launcher {
namespace {

using image::DepthImage;
using Bytes = std::vector<uint8_t>;

// compression: empty: the format's own.
Result<PlaneBits> picture_files(const DepthImage& image, const std::string& extension, const std::string& compression) {
  const auto bits = [&](auto values, int channels, int value_bytes) {
    return 8 * image::plane_file_bytes(extension, compression, image.width, image.height, channels, value_bytes,
                                       std::as_bytes(values));
  };
  const Bytes depth = depth_bytes(image), colour = colour_bytes(image), normal = normal_bytes(image);
  PlaneBits out{bits(std::span(depth), 3, 1), bits(std::span(colour), 3, 1), bits(std::span(normal), 2, 1)};
  if (extension == "tif")
    if (const size_t whole = bits(std::span(image.depth), 1, 4); whole != 0) out.depth = std::min(out.depth, whole);
  if (out.depth == 0 || out.colour == 0 || out.normal == 0)
    return Error{fmt::format("OpenImageIO writes no .{} to memory", extension)};
  return out;
}

size_t zstd_bits(const Bytes& interleaved, size_t channels) {
  Bytes planes;
  for (size_t c = 0; c < channels; ++c)
    for (size_t i = c; i < interleaved.size(); i += channels) planes.push_back(interleaved[i]);
  return 8 * zstd_size(std::as_bytes(std::span(planes)));
}

Result<PlaneBits> lzw(const DepthImage& image) {
  const LzwBits bits = lzw_bits(image);
  return PlaneBits{bits.depth, bits.colour, bits.normal};
}

Result<PlaneBits> zstd(const DepthImage& image) {
  return PlaneBits{zstd_bits(depth_bytes(image), 3), zstd_bits(colour_bytes(image), 3),
                   zstd_bits(normal_bytes(image), 2)};
}

Bytes bytes_of(const auto& values, int channels) {
  Bytes out;
  out.reserve(values.size() * size_t(channels));
  for (const auto v : values)
    for (int shift = 8 * channels - 8; shift >= 0; shift -= 8) out.push_back(uint8_t(v >> shift));
  return out;
}

}  // namespace

std::vector<uint8_t> depth_bytes(const DepthImage& image) { return bytes_of(image.depth, 3); }
std::vector<uint8_t> colour_bytes(const DepthImage& image) { return bytes_of(image.colour, 3); }
std::vector<uint8_t> normal_bytes(const DepthImage& image) { return bytes_of(image.normal, 2); }

const std::vector<Baseline>& baselines() {
  const auto here = [] { return std::string(); };
  static const std::vector<Baseline> all{
      {"lzw", "LZW", false, lzw, here},
      {"tiff", "TIFF with LZW", false, [](const DepthImage& i) { return picture_files(i, "tif", "lzw"); }, here},
      {"png", "PNG", false, [](const DepthImage& i) { return picture_files(i, "png", ""); }, here},
      {"zstd", "zstd -3", false, zstd, here},
      {"rvl", "RVL", true,
       [](const DepthImage& i) -> Result<PlaneBits> {
         return PlaneBits{8 * rvl_encode(i.depth).size(), 0, 0};
       },
       here},
  };
  return all;
}

}  // namespace telesplat::launcher
