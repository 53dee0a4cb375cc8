// The ray sampler, and direct rendering, which traces the same scene: the reference that reconstructed views are
// measured against. Camera rays go in packets of 4 x 2 pixels.
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
#include "services/sampler/mesh/sampler.h"

namespace telesplat::sampler {
namespace {

constexpr int kPacketWidth = 4, kPacketHeight = 2;
static_assert(kPacketWidth * kPacketHeight == kPacket);

// Rays through the pixel centres of a camera. A direction is R (u, v, -1), so a ray's parameter is depth in metres.
// A direction is a term per column plus a term per row, both held in double precision for the range that is traced.
class PixelRays {
 public:
  // Rays for pixels [x0, x1) x [y0, y1), which may lie outside the image; they see only what `clip` keeps.
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

  // Sets the fields that are the same in all packets.
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

  // Sets the rays of the packet whose upper left pixel is (x, y).
  void aim(int x, int y, RTCRayHit8& packet) const {
    for (int k = 0; k < kPacket; ++k)
      aim(k, columns_[x - x0_ + k % kPacketWidth] + rows_[y - y0_ + k / kPacketWidth], packet);
  }

  // Sets the rays of up to kPacket pixels, counted from (x, y); other lanes keep their rays, but hit nothing.
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
      packet.ray.tfar[k] = any ? static_cast<float>(end) : 0.0f;  // an end before the begin: it meets nothing
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

// True if a ray of a traced packet hit something.
bool any_hit(const RTCRayHit8& packet) {
  bool any = false;
  for (int k = 0; k < kPacket; ++k) any |= packet.hit.geomID[k] != RTC_INVALID_GEOMETRY_ID;
  return any;
}

// Traces every packet that touches `tile`. Each task (several run at once) starts with task = begin(), calls
// consume(task, packet, x, y) for the packets in which something was hit, and ends with end(task); (x, y) is the
// packet's upper left pixel, and its pixels may lie outside the tile. Packets lie on a grid fixed to the whole image
// and are always traced whole, so that a pixel's result does not depend on the tile that asks for it (where two
// triangles are equally near, the packet decides).
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

// Likewise, without a state per task: consume(packet, x, y).
template <class Consume>
void trace_tile(RayScene& scene, const geometry::Camera& camera, const geometry::Rect& tile, const Consume& consume) {
  trace_tile(
      scene, camera, tile, [] { return 0; },
      [&](int, const RTCRayHit8& packet, int x, int y) { consume(packet, x, y); }, [](int) {});
}

// Traces the pixels of `tile` that `mask`, of its size, covers; consume(task, packet, pixels) as in trace_tile(), the
// packet's pixels being counted from the tile's corner; tasks end with task.flush(). Packets hold what of the mask lies
// close together.
template <class Begin, class Consume>
void trace_pixels(RayScene& scene, const geometry::Camera& camera, const geometry::Rect& tile,
                  const image::PixelMask& mask, const Begin& begin, const Consume& consume) {
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
    task.flush();
  };
  const size_t packets = (pixels.size() + kPacket - 1) / kPacket;
  scene.arena().execute([&] { in_parallel(tbb::blocked_range<size_t>(0, packets, kTask / kPacket), trace); });
}

// Hits of one task that wait for their attributes. Indices and vertices of neighbouring hits lie far apart in memory,
// so that fetching them hit by hit would wait each time: instead the hits are collected, their indices and vertices are
// prefetched step by step, and eight at a time are shaded when these have arrived.
class PendingHits {
 public:
  PendingHits(const RayScene& scene, const scene::ColourTable& colours, double near_m, image::DepthImage& out)
      : scene_(scene), colours_(colours), near_m_(near_m), out_(out) {}

  /// Keeps the hits of a packet that lie in the image; pixel_of(k) is the pixel of lane k.
  template <class PixelOf>
  void add(const RTCRayHit8& packet, const PixelOf& pixel_of) {
    if (count_ + kPacket > kCapacity) flush();
    for (int k = 0; k < kPacket; ++k) {
      if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
      const auto [px, py] = pixel_of(k);
      if (px < 0 || py < 0 || px >= out_.width || py >= out_.height) continue;
      const geometry::MeshChunkView& chunk = scene_.chunk(packet.hit.instID[0][k]);
      const int i = count_++, group = i / kPacket, lane = i % kPacket;
      corners_[i] = chunk.indices.data() + 3 * size_t{packet.hit.primID[k]};
      chunks_[i] = &chunk;
      pixels_[i] = size_t(py) * out_.width + px;
      depths_m_[i] = packet.ray.tfar[k];
      __builtin_prefetch(corners_[i]);
      HitPacket& hits = hits_[group];
      hits.u[lane] = packet.hit.u[k];
      hits.v[lane] = packet.hit.v[k];
      hits.geometric_normal[0][lane] = packet.hit.Ng_x[k];
      hits.geometric_normal[1][lane] = packet.hit.Ng_y[k];
      hits.geometric_normal[2][lane] = packet.hit.Ng_z[k];
      hits.direction[0][lane] = packet.ray.dir_x[k];
      hits.direction[1][lane] = packet.ray.dir_y[k];
      hits.direction[2][lane] = packet.ray.dir_z[k];
    }
  }

  /// Shades the collected hits and writes them to the image.
  void flush() {
    for (int i = 0; i < count_; ++i)
      for (int c = 0; c < 3; ++c) {
        __builtin_prefetch(&chunks_[i]->normals[corners_[i][c]]);
        __builtin_prefetch(&chunks_[i]->colours[corners_[i][c]]);
      }
    for (int first = 0; first < count_; first += kPacket) {
      HitPacket& hits = hits_[first / kPacket];
      const int lanes = std::min(kPacket, count_ - first);
      const bool scalars = chunks_[first]->scalars;
      for (int k = 0; k < lanes; ++k)
        for (int c = 0; c < 3; ++c) {
          const uint32_t vertex = corners_[first + k][c];
          hits.corner_normal[c][k] = chunks_[first + k]->normals[vertex];
          // Chunks with scalars and with colours meet only while they are replaced: then the other kind is neutral.
          const bool fits = chunks_[first + k]->scalars == scalars;
          hits.corner_colour[c][k] = fits ? chunks_[first + k]->colours[vertex] : scalars ? kNotANumber : kNeutral;
        }
      alignas(32) uint32_t colour[kPacket], normal[kPacket];
      shade_hits(hits, colour, normal, scalars ? &colours_ : nullptr);
      for (int k = 0; k < lanes; ++k) {
        const size_t at = pixels_[first + k];
        out_.depth[at] = image::encode_depth(depths_m_[first + k], near_m_);
        out_.colour[at] = colour[k];
        out_.normal[at] = static_cast<uint16_t>(normal[k]);
      }
    }
    count_ = 0;
  }

 private:
  static constexpr int kCapacity =
      64;  // eight packets: SamplerRay/40 takes 110 ms with it, 117 ms shading packet by packet

  static constexpr uint32_t kNotANumber = 0x7fc00000, kNeutral = 0xc8c8c8;

  const RayScene& scene_;
  const scene::ColourTable& colours_;
  double near_m_;
  image::DepthImage& out_;
  int count_ = 0;
  const uint32_t* corners_[kCapacity];
  const geometry::MeshChunkView* chunks_[kCapacity];
  size_t pixels_[kCapacity];
  float depths_m_[kCapacity];
  HitPacket hits_[kCapacity / kPacket] = {};  // lanes of the last, partly filled packet hold older hits or zeros
};

class RaySampler final : public Sampler {
 public:
  explicit RaySampler(int threads) : scene_(threads) {}

  const char* name() const override { return "ray"; }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override;
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override {
    return scene_.add(std::move(chunks));
  }
  void remove_chunk(ChunkId id) override { scene_.remove(id); }
  std::function<Result<Add>()> preparing(ChunkId id, geometry::ChunkBytes chunk) override {
    return [this, id, chunk = std::move(chunk)] { return scene_.prepare(id, chunk.bytes); };
  }
  void show(const std::vector<ChunkId>& chunks) override { scene_.show(chunks); }
  void set_colours(std::shared_ptr<const scene::ColourTable> colours) override {
    colours_ = colours ? std::move(colours) : neutral_colours();
  }
  void set_clip(const geometry::Clip& clip) override { scene_.set_clip(clip); }
  image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                           const image::PixelMask* mask = nullptr) override;

  RayScene& scene() { return scene_; }
  const scene::ColourTable& colours() const { return *colours_; }

 private:
  RayScene scene_;
  std::shared_ptr<const scene::ColourTable> colours_ = neutral_colours();
};

}  // namespace

Status RaySampler::add_chunk(ChunkId id, geometry::ChunkBytes chunk) {
  std::vector<std::pair<ChunkId, geometry::ChunkBytes>> one;
  one.emplace_back(id, std::move(chunk));
  return scene_.add(std::move(one));
}

image::DepthImage RaySampler::sample(const geometry::Camera& camera, const geometry::Rect& tile,
                                     const image::PixelMask* mask) {
  image::DepthImage out(tile.width, tile.height);
  const auto begin = [&] { return PendingHits(scene_, *colours_, camera.near_m, out); };
  const auto end = [](PendingHits& pending) { pending.flush(); };
  if (mask && mask->count() < out.pixels()) {
    trace_pixels(scene_, camera, tile, *mask, begin,
                 [](PendingHits& pending, const RTCRayHit8& packet, std::span<const MaskedPixel> pixels) {
                   pending.add(packet, [&](int k) { return std::pair<int, int>(pixels[k].x, pixels[k].y); });
                 });
    return out;
  }
  trace_tile(
      scene_, camera, tile, begin,
      [&tile](PendingHits& pending, const RTCRayHit8& packet, int x, int y) {
        pending.add(packet,
                    [&](int k) { return std::pair(x + k % kPacketWidth - tile.x, y + k / kPacketWidth - tile.y); });
      },
      end);
  return out;
}

std::shared_ptr<const scene::ColourTable> neutral_colours() {
  static const auto table = [] {
    scene::ColourTable out;
    out.colours.assign(scene::ColourTable::kEntries + 1, 0xc8c8c8);
    return std::make_shared<const scene::ColourTable>(std::move(out));
  }();
  return table;
}

std::unique_ptr<Sampler> make_ray_sampler(int threads) { return std::make_unique<RaySampler>(threads); }

image::View render_directly(Sampler& ray_sampler, const geometry::Camera& camera, const image::Shading& shading) {
  auto* sampler = dynamic_cast<RaySampler*>(&ray_sampler);
  CHECK(sampler != nullptr);
  RayScene& scene = sampler->scene();
  const size_t pixels = size_t(camera.width) * camera.height;
  image::View view{camera.width, camera.height, std::vector<uint32_t>(pixels, shading.background()),
                   std::vector<float>(pixels, std::numeric_limits<float>::infinity())};
  trace_tile(scene, camera, {0, 0, camera.width, camera.height}, [&](const RTCRayHit8& packet, int x, int y) {
    for (int k = 0; k < kPacket; ++k) {
      const int px = x + k % kPacketWidth, py = y + k / kPacketWidth;
      if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID || px >= camera.width || py >= camera.height) continue;
      const SurfacePoint point =
          surface_point(scene.chunk(packet.hit.instID[0][k]), packet.hit.primID[k], {packet.hit.u[k], packet.hit.v[k]},
                        {packet.hit.Ng_x[k], packet.hit.Ng_y[k], packet.hit.Ng_z[k]},
                        {packet.ray.dir_x[k], packet.ray.dir_y[k], packet.ray.dir_z[k]}, sampler->colours());
      const glm::uvec3 lit(point.colour * shading.intensity(point.normal) + 0.5f);
      const size_t at = size_t(py) * camera.width + px;
      view.colour[at] = lit.x << 16 | lit.y << 8 | lit.z;
      view.depth_m[at] = packet.ray.tfar[k];
    }
  });
  return view;
}

}  // namespace telesplat::sampler
