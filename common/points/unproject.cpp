#include "common/points/unproject.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "common/points/unproject.cpp"
#include <hwy/foreach_target.h>

#include "common/points/unproject-inl.h"

#if HWY_ONCE
namespace telesplat::points {

HWY_EXPORT(unproject_row);

RowRays row_rays(const OctreeGrid& grid, const geometry::Camera& camera, int x, int y) {
  const double scale = 65536.0 / grid.leaf_size;
  const glm::dquat q = camera.pose.orientation;
  const glm::dvec3 origin = (camera.pose.position_room - grid.lo) * scale;
  const glm::dvec3 row = q * glm::dvec3(camera.left, camera.top - (y + 0.5) / camera.focal_y(), -1.0) * scale;
  const glm::dvec3 step = q * glm::dvec3(1.0, 0.0, 0.0) * (scale / camera.focal_x());
  return {{origin.x, origin.y, origin.z},
          {row.x, row.y, row.z},
          {step.x, step.y, step.z},
          camera.near_m * image::kMaxDepthCode,
          x + 0.5,
          65536.0 * (1 << grid.depth)};
}

void unproject_row(const RowRays& rays, const uint32_t* codes, size_t n, ClusterKey* keys,
                   const std::array<uint16_t*, 3>& positions) {
  HWY_DYNAMIC_DISPATCH(unproject_row)(rays, codes, n, keys, positions);
}

void unproject_row_scalar(const RowRays& rays, const uint32_t* codes, size_t n, ClusterKey* keys,
                          const std::array<uint16_t*, 3>& positions) {
  for (size_t i = 0; i < n; ++i) {
    keys[i] = kNoCluster;
    if (codes[i] == 0) continue;
    const double depth = rays.depth_scale / codes[i], column = rays.x_first + static_cast<double>(i);
    double g[3];
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
      g[a] = rays.origin[a] + depth * (rays.row[a] + column * rays.step[a]);
      inside = inside && g[a] >= 0 && g[a] < rays.limit;
    }
    if (!inside) continue;
    ClusterKey key = 0;
    for (int a = 0; a < 3; ++a) {
      const auto q = static_cast<uint32_t>(g[a]);
      key |= q >> 16 << (10 * a);
      positions[a][i] = static_cast<uint16_t>(q & 0xffff);
    }
    keys[i] = key;
  }
}

}  // namespace telesplat::points
#endif
