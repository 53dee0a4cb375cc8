#include "common/image/jpeg.h"

#include <fmt/format.h>
#include <turbojpeg.h>

#include <bit>
#include <memory>

#include "common/core/check.h"

namespace telesplat::image {
namespace {

static_assert(std::endian::native == std::endian::little, "0xRRGGBB lies as B, G, R, 0");

struct Close {
  void operator()(void* codec) const { tjDestroy(codec); }
};
using Codec = std::unique_ptr<void, Close>;

const unsigned char* bytes_of(std::span<const std::byte> jpeg) {
  return reinterpret_cast<const unsigned char*>(jpeg.data());
}

}  // namespace

std::vector<std::byte> encode_jpeg(std::span<const uint32_t> colour, int width, int height, int quality) {
  CHECK(width > 0 && height > 0 && colour.size() == size_t(width) * size_t(height));
  CHECK(quality >= 1 && quality <= 100);
  static thread_local const Codec codec(tjInitCompress());
  const int chroma = quality >= kFullChromaFrom ? TJSAMP_444 : TJSAMP_420;
  std::vector<std::byte> out(tjBufSize(width, height, chroma));
  auto* to = reinterpret_cast<unsigned char*>(out.data());
  unsigned long size = out.size();
  const int failed = tjCompress2(codec.get(), reinterpret_cast<const unsigned char*>(colour.data()), width, 0, height,
                                 TJPF_BGRX, &to, &size, chroma, quality, TJFLAG_NOREALLOC);
  CHECK(failed == 0);
  out.resize(size);
  return out;
}

Status decode_jpeg(std::span<const std::byte> jpeg, int width, int height, uint32_t* to, int stride) {
  const Codec codec(tjInitDecompress());  // a new one each time: after an error it would keep the bytes it had read
  CHECK(codec);
  int w = 0, h = 0, chroma = 0, space = 0;
  if (tjDecompressHeader3(codec.get(), bytes_of(jpeg), jpeg.size(), &w, &h, &chroma, &space))
    return Error{fmt::format("no JPEG picture: {}", tjGetErrorStr2(codec.get()))};
  if (w != width || h != height)
    return Error{fmt::format("a JPEG picture of {}x{} pixels instead of {}x{}", w, h, width, height)};
  if (tjDecompress2(codec.get(), bytes_of(jpeg), jpeg.size(), reinterpret_cast<unsigned char*>(to), width, stride * 4,
                    height, TJPF_BGRX, 0))
    return Error{fmt::format("a damaged JPEG picture: {}", tjGetErrorStr2(codec.get()))};
  return ok_status();
}

}  // namespace telesplat::image
