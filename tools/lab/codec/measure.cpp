#include "tools/lab/codec/measure.h"

#include <fmt/format.h>
#include <zstd.h>

#include <algorithm>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "tools/lab/codec/lzw.h"
#include "tools/lab/walk.h"

namespace telesplat::lab {
namespace {

constexpr int kCodecTile = 256;  // as the master cuts frames
constexpr int kCodecPasses = 3;

size_t covered_pixels(const image::DepthImage& image) {
  return image.pixels() - size_t(std::count(image.depth.begin(), image.depth.end(), 0u));
}

size_t zstd_bits(const auto& values, int value_bytes) {
  constexpr int kLevel = 3;
  std::vector<uint8_t> planes;
  planes.reserve(values.size() * size_t(value_bytes));
  for (int shift = 8 * value_bytes - 8; shift >= 0; shift -= 8)
    for (const auto v : values) planes.push_back(uint8_t(v >> shift));
  std::vector<uint8_t> packed(ZSTD_compressBound(planes.size()));
  return 8 * ZSTD_compress(packed.data(), packed.size(), planes.data(), planes.size(), kLevel);
}

double fastest_s(const auto& work) {
  double out = 1e9;
  for (int pass = 0; pass < kCodecPasses; ++pass) {
    const double begin_s = thread_cpu_s();
    work();
    out = std::min(out, thread_cpu_s() - begin_s);
  }
  return out;
}

Status add_tile(const image::DepthImage& tile, CodecFigures& to) {
  std::vector<uint8_t> stream;
  Result<image::DepthImage> decoded = Error{};
  to.encode_s += fastest_s([&] { stream = codec::encode(tile); });
  to.decode_s += fastest_s([&] { decoded = codec::decode(stream); });
  if (!decoded) return Error{fmt::format("what was encoded is not decoded: {}", decoded.error().text)};
  if (*decoded != tile) return Error{"a decoded tile is not the encoded one"};
  to.bits += 8 * stream.size();
  to.lzw_bits += lzw_bits(tile);
  to.zstd_bits += zstd_bits(tile.depth, 3) + zstd_bits(tile.colour, 3) + zstd_bits(tile.normal, 2);
  ++to.tiles;
  to.covered += covered_pixels(tile);
  return ok_status();
}

}  // namespace

Status add(const image::DepthImage& image, CodecFigures& to) {
  ++to.images;
  for (int y = 0; y < image.height; y += kCodecTile)
    for (int x = 0; x < image.width; x += kCodecTile) {
      const auto tile = cut(image, {x, y, std::min(kCodecTile, image.width - x), std::min(kCodecTile, image.height - y)});
      if (covered_pixels(tile) == 0) continue;
      if (const Status s = add_tile(tile, to); !s) return s;
    }
  return ok_status();
}

std::string to_markdown(const std::vector<CodecFigures>& all) {
  const auto ratio = [](double a, double b) { return b > 0 ? a / b : 0; };
  std::string out =
      "| images | number | tiles | Mpx covered | bits a covered pixel | LZW | zstd -3 | of LZW | of zstd | "
      "encode, Mpx/s | decode, Mpx/s |\n|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const CodecFigures& f : all) {
    const double pixels = double(f.covered), bits = double(f.bits);
    out += fmt::format("| {} | {} | {} | {:.2f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.1f} | {:.1f} |\n",
                       f.name, f.images, f.tiles, pixels * 1e-6, ratio(bits, pixels), ratio(double(f.lzw_bits), pixels),
                       ratio(double(f.zstd_bits), pixels), ratio(bits, double(f.lzw_bits)),
                       ratio(bits, double(f.zstd_bits)), ratio(pixels * 1e-6, f.encode_s),
                       ratio(pixels * 1e-6, f.decode_s));
  }
  return out;
}

}  // namespace telesplat::lab
