#include "tools/lab/scaling/rows.h"

#include <algorithm>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "services/sampler/julia/sampler.h"

namespace telesplat::lab {

Result<sampler::Replay> measure_rows(const julia::Scene& scene, double room_size_m, const geometry::Camera& camera,
                                     int passes, const std::function<void(int, int)>& progress,
                                     const std::function<bool()>& stop) {
  const auto placement = julia::place(scene, room_size_m);
  if (!placement) return placement.error();
  const sampler::JuliaScene set(scene.parameters, *placement);
  sampler::JuliaSampler sampler(1);
  sampler::Replay out{{camera.width, camera.height}, {}};
  std::vector<std::vector<double>> costs(camera.height);
  for (int pass = 0; pass < passes; ++pass)
    for (int y = 0; y < camera.height; ++y) {
      if (stop()) return Error{"interrupted"};
      const double begin_s = monotonic_s();
      const auto row = sampler.sample(set, camera, {0, y, camera.width, 1}, 1);
      const auto stream = codec::encode(row);
      costs[y].push_back(monotonic_s() - begin_s);
      const size_t at = size_t(y) * camera.width;
      std::copy(row.depth.begin(), row.depth.end(), out.frame.depth.begin() + at);
      std::copy(row.colour.begin(), row.colour.end(), out.frame.colour.begin() + at);
      std::copy(row.normal.begin(), row.normal.end(), out.frame.normal.begin() + at);
      progress(pass * camera.height + y + 1, passes * camera.height);
    }
  for (auto& c : costs) {
    std::nth_element(c.begin(), c.begin() + c.size() / 2, c.end());
    out.row_cost_s.push_back(c[c.size() / 2]);
  }
  return out;
}

}  // namespace telesplat::lab
