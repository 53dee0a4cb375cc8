// What bounded streams leave out.
#include <fmt/format.h>

#include "common/codec/depth_codec.h"
#include "common/codec/entropy.h"

namespace telesplat::codec {
namespace {

using detail::Reader;
using image::DepthImage;

constexpr uint8_t kMagic = 0xD8, kVersion = 5;

Error damaged(std::string_view what) { return Error{fmt::format("depth image refinement: {}", what)}; }

bool same_mask(const DepthImage& a, const DepthImage& b) {
  if (a.width != b.width || a.height != b.height || a.pixels() != b.pixels()) return false;
  for (size_t i = 0; i < a.pixels(); ++i)
    if ((a.depth[i] == 0) != (b.depth[i] == 0)) return false;
  return true;
}

}  // namespace

std::vector<uint8_t> encode_refinement(const DepthImage& exact, const DepthImage& bounded) {
  CHECK(same_mask(exact, bounded));
  std::vector<uint8_t> out{kMagic, kVersion};
  const auto stream = encode(exact);
  out.insert(out.end(), stream.begin(), stream.end());
  return out;
}

Result<DepthImage> decode_refinement(std::span<const uint8_t> bytes, const DepthImage& bounded) {
  Reader in(bytes);
  const auto magic = in.u8(), version = in.u8();
  if (!version) return damaged("shorter than its header");
  if (*magic != kMagic) return damaged(fmt::format("begins with {:#04x}, not {:#04x}", *magic, kMagic));
  if (*version != kVersion) return damaged(fmt::format("version {}, expected {}", *version, kVersion));
  auto exact = decode(bytes.subspan(2), bounded.width, bounded.height);
  if (exact && !same_mask(*exact, bounded)) return damaged("of an image that covers other pixels");
  return exact;
}

}  // namespace telesplat::codec
