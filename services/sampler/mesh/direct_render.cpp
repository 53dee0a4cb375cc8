// Direct rendering: the reference that reconstructed views are measured against.
#include "services/sampler/mesh/ray_packets.h"
#include "services/sampler/mesh/ray_sampler.h"

namespace telesplat::sampler {

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
          surface_point(scene.chunk(packet.hit.instID[0][k]), packet.hit.primID[k], packet.hit.u[k], packet.hit.v[k],
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
