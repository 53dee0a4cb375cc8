// A row of plans.csv: what the packer was asked, and what came of it.
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
  uint64_t tiles = 0, rays = 0;       ///< of the answer
  uint64_t mask_bytes = 0;
  std::map<std::string, double> figures;  ///< wire::Plan::figures

  /// That samplers would cast without plans: of extra rays none; and were asked to cast.
  uint64_t rays_full() const;
  uint64_t rays_cast() const;
};

/// Of a plan that came.
PlanRow row_of(const wire::PlanRequest& asked, double asked_s, const wire::Plan& plan, double planned_s);
/// plans.csv: its header, and a row of it. viewer: its name; begin_s: of the run, on the master's clock.
std::vector<std::string> plan_columns();
std::vector<std::string> plan_cells(const std::string& viewer, const PlanRow& row, double begin_s);

}  // namespace telesplat::metrics
