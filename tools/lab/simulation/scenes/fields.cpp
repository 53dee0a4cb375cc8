#include "tools/lab/simulation/scenes/fields.h"

#include <glm/geometric.hpp>

#include "common/core/check.h"
#include "services/data/julia/served_julia.h"
#include "services/data/volume/served_volume.h"

namespace telesplat::simulation {
namespace {

constexpr double kRoom_m = 0.8;
constexpr int kSide = 32, kSideOfSeries = 24, kSteps = 3;  // voxels
constexpr double kSteps_hz = 1;
constexpr const char* kTransfer = "0:#204080:0, 40:#204080:0, 41:#40a0c0:0.05, 160:#f0c060:0.3, 255:#ffffff:0.9";

void ignore_progress(const char*, double) {}

// 255 (1 - (1 + step / 2) |p|^2), p from -1 to 1 on each axis.
data::Volume ball(int side, size_t step) {
  data::Volume out;
  out.size = {side, side, side};
  out.format = "ball";
  const auto at = [side](int n) { return (2 * n + 1 - side) / double(side); };
  for (int k = 0; k < side; ++k)
    for (int j = 0; j < side; ++j)
      for (int i = 0; i < side; ++i) {
        const double squares = at(i) * at(i) + at(j) * at(j) + at(k) * at(k);
        const double value = 255 * (1 - (1 + 0.5 * double(step)) * squares);
        out.stored.push_back(std::byte(int(std::max(value, 0.0) + 0.5)));
        out.hi = std::max(out.hi, double(std::to_integer<int>(out.stored.back())));
      }
  return out;
}

}  // namespace

std::unique_ptr<data::Served> serve_julia_set() {
  julia::SceneOptions options;
  options.preset = "cocoon";
  for (auto& [name, text] : options.values) {
    if (name == "iterations") text = "12";
    if (name == "bailout") text = "4";
    if (name == "ambient") text = "0";
    if (name == "bound") text = "1.2";  // given, it need not be searched for
  }
  auto served = data::serve_julia(options, kRoom_m, ignore_progress);
  CHECK(served.ok());
  return *std::move(served);
}

std::unique_ptr<data::Served> serve_ball_volume(bool series, int part, int parts) {
  data::VolumeOptions options;
  options.transfer = kTransfer;
  options.part = std::to_string(part) + "/" + std::to_string(parts);
  if (series) options.steps_per_s = kSteps_hz;
  data::PlacementOptions placement;
  placement.room_size_m = kRoom_m;
  const auto read = [side = series ? kSideOfSeries : kSide](size_t step, const data::ReadProgress&) {
    return Result<data::Volume>(ball(side, step));
  };
  auto store = data::VolumeStore::make(read, series ? kSteps : 1, "ball", options, placement, ignore_progress);
  CHECK(store.ok());
  return data::serve_volume(std::move(*store), series ? "series" : "ball", data::VolumeWorker::kCaller);
}

}  // namespace telesplat::simulation
