#include "services/sampler/ray_sampler.h"

#include "services/sampler/ray_packets.h"

namespace telesplat::sampler {
namespace {

// Corner attributes, plane and weights of the packet's hits. Lanes without a hit repeat what stood there before.
void gather(const RayScene& scene, const RTCRayHit8& packet, HitPacket& hits) {
  for (int k = 0; k < kPacket; ++k) {
    if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID) continue;
    const geometry::MeshChunkView& chunk = scene.chunk(packet.hit.instID[0][k]);
    const uint32_t* corners = chunk.indices.data() + 3 * size_t{packet.hit.primID[k]};
    for (int c = 0; c < 3; ++c) {
      hits.corner_normal[c][k] = chunk.normals[corners[c]];
      hits.corner_colour[c][k] = chunk.colours[corners[c]];
    }
    hits.u[k] = packet.hit.u[k];
    hits.v[k] = packet.hit.v[k];
    hits.geometric_normal[0][k] = packet.hit.Ng_x[k];
    hits.geometric_normal[1][k] = packet.hit.Ng_y[k];
    hits.geometric_normal[2][k] = packet.hit.Ng_z[k];
    hits.direction[0][k] = packet.ray.dir_x[k];
    hits.direction[1][k] = packet.ray.dir_y[k];
    hits.direction[2][k] = packet.ray.dir_z[k];
  }
}

}  // namespace

Status RaySampler::add_chunk(ChunkId id, geometry::ChunkBytes chunk) {
  std::vector<std::pair<ChunkId, geometry::ChunkBytes>> one;
  one.emplace_back(id, std::move(chunk));
  return scene_.add(std::move(one));
}

image::DepthImage RaySampler::sample(const geometry::Camera& camera, const geometry::Rect& tile) {
  image::DepthImage out(tile.width, tile.height);
  trace_tile(scene_, camera, tile, [&](const RTCRayHit8& packet, int x, int y) {
    HitPacket hits{};
    gather(scene_, packet, hits);
    alignas(32) uint32_t colour[kPacket], normal[kPacket];
    shade_hits(hits, colour, normal);
    for (int k = 0; k < kPacket; ++k) {
      const int px = x + k % kPacketWidth - tile.x, py = y + k / kPacketWidth - tile.y;
      if (packet.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID || px < 0 || py < 0 || px >= tile.width || py >= tile.height) continue;
      const size_t at = size_t(py) * tile.width + px;
      out.depth[at] = image::encode_depth(packet.ray.tfar[k], camera.near_m);
      out.colour[at] = colour[k];
      out.normal[at] = static_cast<uint16_t>(normal[k]);
    }
  });
  return out;
}

std::unique_ptr<Sampler> make_ray_sampler(int threads) { return std::make_unique<RaySampler>(threads); }

}  // namespace telesplat::sampler
