#include "services/master/record/plan_row.h"

#include <fmt/format.h>

#include "common/metrics/columns.h"
#include "common/scene/session.h"
#include "services/master/record/text_file.h"

namespace telesplat::metrics {
namespace {

const char* name_of(PlanRow::Outcome outcome) {
  switch (outcome) {
    case PlanRow::Outcome::kTiles:
      return "tiles";
    case PlanRow::Outcome::kEmpty:
      return "empty";
    case PlanRow::Outcome::kFull:
      return "full";
    case PlanRow::Outcome::kLate:
      break;
  }
  return "late";
}

struct PlanLine {
  const std::string& viewer;
  const PlanRow& row;
  double begin_s;  // the run's begin, on the master's clock

  std::string moment(double master_s) const { return fmt::format("{:.9f}", master_s - begin_s); }
  // Returns one of the packer's figures; empty: it did not send it.
  std::string figure(const char* name) const {
    const auto found = row.figures.find(name);
    return found == row.figures.end() ? std::string() : fmt::format("{}", found->second);
  }
  // Returns the time of the answer without the planning: two ways, and the packer's queue.
  std::string wait_ms() const {
    const auto plan_ms = row.figures.find("plan_ms");
    if (plan_ms == row.figures.end()) return {};
    return fmt::format("{:.6f}", (row.planned_s - row.asked_s) * 1e3 - plan_ms->second);
  }
};

constexpr Column<PlanLine, std::string> kPlanColumns[] = {
    {"viewer", [](const PlanLine& l) { return csv_quoted(l.viewer); }},
    {"request", [](const PlanLine& l) { return whole_cell(l.row.asked.request.value); }},
    {"frame", [](const PlanLine& l) { return whole_cell(l.row.asked.frame.value); }},
    {"epoch", [](const PlanLine& l) { return whole_cell(l.row.asked.epoch.value); }},
    {"extra", [](const PlanLine& l) { return whole_cell(l.row.asked.extra); }},
    {"round", [](const PlanLine& l) { return whole_cell(l.row.asked.round); }},
    {"still", [](const PlanLine& l) { return whole_cell(l.row.asked.still); }},
    {"outcome", [](const PlanLine& l) { return std::string(name_of(l.row.outcome)); }},
    {"asked_s", [](const PlanLine& l) { return l.moment(l.row.asked_s); }},
    {"planned_s", [](const PlanLine& l) { return l.moment(l.row.planned_s); }},
    {"plan_ms", [](const PlanLine& l) { return l.figure("plan_ms"); }},
    {"wait_ms", [](const PlanLine& l) { return l.wait_ms(); }},
    {"tiles", [](const PlanLine& l) { return whole_cell(l.row.tiles); }},
    {"mask_bytes", [](const PlanLine& l) { return whole_cell(l.row.mask_bytes); }},
    {"rays_cast", [](const PlanLine& l) { return whole_cell(l.row.rays_cast()); }},
    {"rays_full", [](const PlanLine& l) { return whole_cell(l.row.rays_full()); }},
    {"rays_nothing", [](const PlanLine& l) { return l.figure("rays.nothing"); }},
    {"rays_sparse", [](const PlanLine& l) { return l.figure("rays.sparse"); }},
    {"rays_edge", [](const PlanLine& l) { return l.figure("rays.edge"); }},
    {"rays_stale", [](const PlanLine& l) { return l.figure("rays.stale"); }},
    {"rays_unproven", [](const PlanLine& l) { return l.figure("rays.unproven"); }},
    {"rays_validation", [](const PlanLine& l) { return l.figure("rays.validation"); }},
    {"rays_refinement", [](const PlanLine& l) { return l.figure("rays.refinement"); }},
    {"rays_cell", [](const PlanLine& l) { return l.figure("rays.cell"); }},
    {"rays_put_off", [](const PlanLine& l) { return l.figure("rays.put_off"); }},
    {"pixels_nothing", [](const PlanLine& l) { return l.figure("pixels.nothing"); }},
    {"pixels_sparse", [](const PlanLine& l) { return l.figure("pixels.sparse"); }},
    {"pixels_edge", [](const PlanLine& l) { return l.figure("pixels.edge"); }},
    {"pixels_stale", [](const PlanLine& l) { return l.figure("pixels.stale"); }},
    {"pixels_unproven", [](const PlanLine& l) { return l.figure("pixels.unproven"); }},
    {"pixels_good", [](const PlanLine& l) { return l.figure("pixels.good"); }},
    {"pixels_known_empty", [](const PlanLine& l) { return l.figure("pixels.known_empty"); }},
};

}  // namespace

uint64_t PlanRow::rays_full() const {
  return asked.extra ? 0 : uint64_t(asked.camera.width) * uint64_t(asked.camera.height);
}

uint64_t PlanRow::rays_cast() const {
  return outcome == Outcome::kFull || outcome == Outcome::kLate ? rays_full() : rays;
}

PlanRow row_of(const wire::PlanRequest& asked, double asked_s, const wire::Plan& plan, double planned_s) {
  PlanRow out{.asked = asked,
              .outcome = plan.full            ? PlanRow::Outcome::kFull
                         : plan.tiles.empty() ? PlanRow::Outcome::kEmpty
                                              : PlanRow::Outcome::kTiles,
              .asked_s = asked_s,
              .planned_s = planned_s,
              .mask_bytes = plan.masks.size() * sizeof(uint32_t),
              .figures = plan.figures};
  if (plan.full) return out;
  out.tiles = plan.tiles.size() / wire::kPlanNumbers;
  for (size_t i = 4; i < plan.tiles.size(); i += wire::kPlanNumbers) out.rays += plan.tiles[i];
  return out;
}

std::vector<std::string> plan_columns() { return names(kPlanColumns); }

std::vector<std::string> plan_cells(const std::string& viewer, const PlanRow& row, double begin_s) {
  return values(kPlanColumns, PlanLine{viewer, row, begin_s});
}

}  // namespace telesplat::metrics
