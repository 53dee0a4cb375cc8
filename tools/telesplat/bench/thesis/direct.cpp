#include "tools/telesplat/bench/thesis/direct.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/clock.h"
#include "common/geometry/trajectory.h"
#include "common/metrics/statistics.h"
#include "common/net/service.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {
namespace {

constexpr double kFov_deg = 90, kTurn_s = 20;  // as `telesplat run` has them

}  // namespace

Status measure_direct(const std::string& file, int width, int height, int frames, const std::string& directory,
                      tools::ProgressLine& progress) {
  data::DataOptions options;
  options.scene = file;
  const auto scene = scene_of(options);
  if (!scene) return scene.error();
  if (const Status s = (*scene)->check(); !s) return s;
  auto direct = (*scene)->open_direct(0, [&](const char* stage, double fraction) { progress.show(stage, fraction); });
  if (!direct) return direct.error();
  const auto orbit = geometry::Trajectory::orbit();
  std::vector<double> times_ms;
  for (int i = 0; i <= frames; ++i) {
    if (net::stop_requested()) return Error{"interrupted"};
    const auto camera = geometry::make_camera(orbit.at(kTurn_s * i / (frames + 1)), kFov_deg, width, height);
    const double begin_s = monotonic_s();
    const auto drawn = (*direct)->draw(camera, image::ShadingParameters{}, EpochId{1});
    if (!drawn) return drawn.error();
    if (i > 0) times_ms.push_back((monotonic_s() - begin_s) * 1e3);
    progress.show(fmt::format("{} drawn directly: picture {} of {}", file, i + 1, frames + 1));
  }
  const std::string path = directory + "/direct.json";
  std::ofstream out(path);
  out << nlohmann::ordered_json{{"fps", 1e3 / metrics::distribution(times_ms).median}, {"frame_ms", times_ms}}.dump(2)
      << "\n";
  out.close();
  return out ? ok_status() : Status(Error{path + ": cannot be written"});
}

}  // namespace telesplat::launcher
