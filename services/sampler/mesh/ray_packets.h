// Camera rays in packets of 4 x 2 pixels, and the loop that traces a tile with them.
#pragma once

#include <embree3/rtcore.h>
#include <tbb/blocked_range2d.h>

#include <algorithm>
#include <limits>
#include <span>
#include <vector>

#include "common/geometry/camera.h"
#include "common/parallel/in_parallel.h"
#include "services/sampler/mesh/hit_packet.h"
#include "services/sampler/mesh/masked_pixels.h"
#include "services/sampler/mesh/ray_scene.h"

namespace telesplat::sampler {

inline constexpr int kPacketWidth = 4, kPacketHeight = 2;
static_assert(kPacketWidth * kPacketHeight == kPacket);

/// Rays through the pixel centres of a camera. A direction is R (u, v, -1), so a ray's parameter is depth in metres.
/// It is the sum of a term per column and a term per row, both held in double precision for the range that is traced.
class PixelRays {
 public:
  /// Rays for pixels [x0, x1) x [y0, y1), which may lie outside the image; what lies outside of `clip` they do not see.
  PixelRays(const geometry::Camera& camera, const geometry::Clip& clip, int x0, int y0, int x1, int y1)
      : x0_(x0),
        y0_(y0),
        eye_(camera.pose.position_room),
        origin_(eye_),
        near_(static_cast<float>(camera.near_m)),
        clip_(clip) {
    const glm::dquat& r = camera.pose.orientation;
    for (int x = x0; x < x1; ++x) columns_.push_back(r * glm::dvec3(camera.left + (x + 0.5) / camera.focal_x(), 0, 0));
    for (int y = y0; y < y1; ++y) rows_.push_back(r * glm::dvec3(0, camera.top - (y + 0.5) / camera.focal_y(), -1));
  }

  /// What stays the same from packet to packet.
  void begin(RTCRayHit8& packet) const {
    std::fill_n(packet.ray.org_x, kPacket, origin_.x);
    std::fill_n(packet.ray.org_y, kPacket, origin_.y);
    std::fill_n(packet.ray.org_z, kPacket, origin_.z);
    std::fill_n(packet.ray.tnear, kPacket, near_);
    std::fill_n(packet.ray.time, kPacket, 0.0f);
    std::fill_n(packet.ray.mask, kPacket, ~0u);
    std::fill_n(packet.ray.id, kPacket, 0u);
    std::fill_n(packet.ray.flags, kPacket, 0u);
  }

  /// Rays of the packet whose upper left pixel is (x, y).
  void aim(int x, int y, RTCRayHit8& packet) const {
    for (int k = 0; k < kPacket; ++k)
      aim(k, columns_[x - x0_ + k % kPacketWidth] + rows_[y - y0_ + k / kPacketWidth], packet);
  }

  /// Rays of up to kPacket pixels, counted from (x, y); other lanes keep what they have, but hit nothing.
  void aim(std::span<const MaskedPixel> pixels, int x, int y, RTCRayHit8& packet) const {
    for (size_t k = 0; k < pixels.size(); ++k)
      aim(static_cast<int>(k), columns_[x - x0_ + pixels[k].x] + rows_[y - y0_ + pixels[k].y], packet);
    for (size_t k = pixels.size(); k < kPacket; ++k) packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
  }

 private:
  void aim(int k, const glm::dvec3& d, RTCRayHit8& packet) const {
    packet.ray.dir_x[k] = static_cast<float>(d.x);
    packet.ray.dir_y[k] = static_cast<float>(d.y);
    packet.ray.dir_z[k] = static_cast<float>(d.z);
    packet.ray.tfar[k] = std::numeric_limits<float>::infinity();
    if (!clip_.empty()) {
      const auto [begin, end] = clip_.stretch(eye_, d);
      const bool any = begin <= end && end > near_;
      packet.ray.tnear[k] = any ? std::max(near_, static_cast<float>(begin)) : 1.0f;
      packet.ray.tfar[k] = any ? static_cast<float>(end) : 0.0f;  // before it begins: it meets nothing
    }
    packet.hit.geomID[k] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
  }

  int x0_, y0_;
  glm::dvec3 eye_;
  glm::vec3 origin_;
  float near_;
  const geometry::Clip& clip_;
  std::vector<glm::dvec3> columns_, rows_;
};

/// Whether a traced packet hit anything.
inline bool any_hit(const RTCRayHit8& packet) {
  bool any = false;
  for (int k = 0; k < kPacket; ++k) any |= packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
  return any;
}

/// Traces every packet that touches `tile`. Each task (several run at once) starts with task = begin(), calls
/// consume(task, packet, x, y) for the packets in which something was hit, and ends with end(task); (x, y) is the
/// packet's upper left pixel, and its pixels may lie outside the tile. Packets lie on a grid fixed to the whole image
/// and are always traced whole, so that a pixel's result does not depend on the tile that asks for it (where two
/// triangles are equally near, the packet decides).
template <class Begin, class Consume, class End>
void trace_tile(RayScene& scene, const geometry::Camera& camera, const geometry::Rect& tile, const Begin& begin,
                const Consume& consume, const End& end) {
  if (tile.width <= 0 || tile.height <= 0) return;
  const int column0 = tile.x / kPacketWidth, column1 = (tile.x + tile.width - 1) / kPacketWidth + 1;
  const int row0 = tile.y / kPacketHeight, row1 = (tile.y + tile.height - 1) / kPacketHeight + 1;
  const PixelRays rays(camera, scene.clip(), column0 * kPacketWidth, row0 * kPacketHeight, column1 * kPacketWidth,
                       row1 * kPacketHeight);
  scene.commit();

  // Tasks of up to 32 x 16 pixels: neighbours share the hierarchy's nodes in the cache.
  scene.arena().execute([&] {
    in_parallel(tbb::blocked_range2d<int>(row0, row1, 8, column0, column1, 8),
                [&](const tbb::blocked_range2d<int>& part) {
                  auto task = begin();
                  RTCRayHit8 packet;
                  rays.begin(packet);
                  alignas(32) static constexpr int kAll[kPacket] = {-1, -1, -1, -1, -1, -1, -1, -1};
                  RTCIntersectContext context;
                  rtcInitIntersectContext(&context);
                  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
                  for (int row = part.rows().begin(); row < part.rows().end(); ++row)
                    for (int column = part.cols().begin(); column < part.cols().end(); ++column) {
                      rays.aim(column * kPacketWidth, row * kPacketHeight, packet);
                      rtcIntersect8(kAll, scene.scene(), &context, &packet);
                      if (any_hit(packet)) consume(task, packet, column * kPacketWidth, row * kPacketHeight);
                    }
                  end(task);
                });
  });
}

/// The same without a state per task: consume(packet, x, y).
template <class Consume>
void trace_tile(RayScene& scene, const geometry::Camera& camera, const geometry::Rect& tile, const Consume& consume) {
  trace_tile(
      scene, camera, tile, [] { return 0; },
      [&](int, const RTCRayHit8& packet, int x, int y) { consume(packet, x, y); }, [](int) {});
}

/// Traces the pixels of `tile` that `mask`, of its size, covers; consume(task, packet, pixels) as in trace_tile(), the
/// packet's pixels being counted from the tile's corner. Packets hold what of the mask lies close together.
template <class Begin, class Consume, class End>
void trace_pixels(RayScene& scene, const geometry::Camera& camera, const geometry::Rect& tile,
                  const image::PixelMask& mask, const Begin& begin, const Consume& consume, const End& end) {
  const std::vector<MaskedPixel> pixels = gather(mask);
  if (pixels.empty()) return;
  const PixelRays rays(camera, scene.clip(), tile.x, tile.y, tile.x + tile.width, tile.y + tile.height);
  scene.commit();
  constexpr size_t kTask = 16 * kPacket;  // pixels: fewer are not worth a thread
  const auto trace = [&](const tbb::blocked_range<size_t>& part) {
    auto task = begin();
    RTCRayHit8 packet;
    rays.begin(packet);
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (size_t i = part.begin() * kPacket; i < std::min(part.end() * kPacket, pixels.size()); i += kPacket) {
      const size_t count = std::min<size_t>(kPacket, pixels.size() - i);
      const std::span<const MaskedPixel> group(pixels.data() + i, count);
      alignas(32) int valid[kPacket];
      for (int k = 0; k < kPacket; ++k) valid[k] = static_cast<size_t>(k) < count ? -1 : 0;
      rays.aim(group, tile.x, tile.y, packet);
      rtcIntersect8(valid, scene.scene(), &context, &packet);
      if (any_hit(packet)) consume(task, packet, group);
    }
    end(task);
  };
  const size_t packets = (pixels.size() + kPacket - 1) / kPacket;
  scene.arena().execute([&] { in_parallel(tbb::blocked_range<size_t>(0, packets, kTask / kPacket), trace); });
}

}  // namespace telesplat::sampler
