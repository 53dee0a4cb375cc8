// A row of plans.csv: a question to the packer, and its outcome.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/wire/tile_messages.h"

namespace telesplat::metrics {

struct PlanRow {
  enum class Outcome {
    kTiles,  ///< its tiles were leased
    kEmpty,  ///< nothing had to be cast
    kFull,   ///< the packer knew too little: the whole view was sampled
    kLate    ///< no answer in time: the whole view was sampled, or no extra rays were
  };
  wire::PlanRequest asked;
  Outcome outcome = Outcome::kLate;
  double asked_s = 0, planned_s = 0;  ///< the master's clock; planned_s: the answer came, or was given up
  uint64_t tiles = 0, rays = 0;       ///< in the answer
  uint64_t mask_bytes = 0;
  std::map<std::string, double> figures;  ///< wire::Plan::figures

  /// Rays that samplers would cast without plans (0 for extra rays), and rays that they were asked to cast.
  uint64_t rays_full() const;
  uint64_t rays_cast() const;
};

/// Makes the row of a plan that came.
PlanRow row_of(const wire::PlanRequest& asked, double asked_s, const wire::Plan& plan, double planned_s);
/// Return the header of plans.csv, and a row. viewer: its name; begin_s: the run's begin on the master's clock.
std::vector<std::string> plan_columns();
std::vector<std::string> plan_cells(const std::string& viewer, const PlanRow& row, double begin_s);

}  // namespace telesplat::metrics
