#include "common/geometry/surfels.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace telesplat::geometry {
namespace {

constexpr size_t bytes_of(size_t surfels) { return sizeof(SurfelHeader) + 20 * surfels; }

}  // namespace

Result<SurfelView> SurfelView::validate(std::span<const std::byte> bytes) {
  SurfelHeader h;
  if (bytes.size() < sizeof h)
    return Error{fmt::format("surfel set of {} bytes is shorter than its header", bytes.size())};
  CHECK(reinterpret_cast<uintptr_t>(bytes.data()) % 4 == 0);
  std::memcpy(&h, bytes.data(), sizeof h);
  if (h.magic != kSurfelMagic)
    return Error{fmt::format("surfel set has magic {:#x} instead of {:#x}", h.magic, kSurfelMagic)};
  if (h.surfels == 0 || h.surfels > kMaxSurfels)
    return Error{fmt::format("surfel set says {} surfels, limits are 1..{}", h.surfels, kMaxSurfels)};
  if (bytes.size() != bytes_of(h.surfels))
    return Error{fmt::format("surfel set has {} bytes, its header says {}", bytes.size(), bytes_of(h.surfels))};
  if (h.scalars > 1) return Error{fmt::format("surfel set has colours of the unknown kind {}", h.scalars)};
  if (!(h.spacing_m > 0 && h.spacing_m < 1e6f)) return Error{fmt::format("surfel set has spacing {} m", h.spacing_m)};
  const auto* words = reinterpret_cast<const uint32_t*>(bytes.data() + sizeof h);
  const size_t n = h.surfels;
  SurfelView out{.spacing_m = h.spacing_m,
                 .scalars = h.scalars == 1,
                 .positions_room = {reinterpret_cast<const float*>(words), 3 * n},
                 .normals = {words + 3 * n, n},
                 .colours = {words + 4 * n, n}};
  if (!std::ranges::all_of(out.positions_room, [](float p) { return std::isfinite(p); }))
    return Error{"surfel set holds a position that is not finite"};
  return out;
}

std::vector<std::byte> build_surfels(std::span<const float> positions_room, std::span<const uint32_t> normals,
                                     std::span<const uint32_t> colours, float spacing_m, bool scalars) {
  const size_t n = normals.size();
  CHECK(n >= 1 && n <= kMaxSurfels && positions_room.size() == 3 * n && colours.size() == n && spacing_m > 0);
  const SurfelHeader h{.surfels = static_cast<uint32_t>(n), .scalars = scalars, .spacing_m = spacing_m};
  std::vector<std::byte> out(bytes_of(n));
  std::byte* p = out.data();
  const auto put = [&p](const void* data, size_t bytes) {
    std::memcpy(p, data, bytes);
    p += bytes;
  };
  put(&h, sizeof h);
  put(positions_room.data(), positions_room.size_bytes());
  put(normals.data(), normals.size_bytes());
  put(colours.data(), colours.size_bytes());
  return out;
}

}  // namespace telesplat::geometry
