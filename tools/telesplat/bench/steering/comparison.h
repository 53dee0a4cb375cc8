// Sessions with and without steering along one walk, and their views beside direct rendering.
#pragma once

#include <functional>
#include <memory>

#include "common/image/measures/reference.h"
#include "tools/telesplat/bench/steering/options.h"
#include "tools/telesplat/bench/steering/timing.h"
#include "tools/telesplat/bench/walk.h"

namespace telesplat::launcher {

/// Error: a name that is none, or none at all.
Status check_modes(const std::string& modes);

class SteeringComparison {
 public:
  /// Keeps references. scene_name: for tables. Precondition: check_modes(options.modes).
  SteeringComparison(const SteeringBenchOptions& options, std::string scene_name, DirectScene& scene, const Walk& walk,
                     std::pair<int, int> size, const TimingConfig& timing);

  /// progress(seconds walked, of). Ends early, with what there is, when the process is told to stop.
  Result<std::vector<ModeReport>> run(const std::function<void(double, double)>& progress);

 private:
  geometry::Camera camera_at(double t_s) const;
  Status sample_walk(double t_s);
  /// still_s: since the head came to rest; below 0: it moves.
  Status compare(double t_s, double still_s);
  Status picture(double t_s);

  const SteeringBenchOptions& o_;
  DirectScene& scene_;
  const Walk& walk_;
  std::pair<int, int> size_;
  double walk_s_ = 0;
  std::string scene_name_;
  std::vector<std::unique_ptr<TimedSession>> sessions_;
  std::vector<ModeReport> reports_;
  double next_compare_s_ = 0.5, next_picture_s_ = 0.5;
};

}  // namespace telesplat::launcher
