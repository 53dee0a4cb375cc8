// Golden figures: what standard walks cost and show, the same on every machine (tests/simulation/figures.json).
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/lab/simulation/checks.h"

namespace telesplat::simulation {

struct Walk {
  std::string name;
  Scenario scenario;
};

/// Walks that are always there, then walks through real meshes, whose files may be missing (has_data).
/// Scenario::file lies in the folder that TELESPLAT_DATA names, else in ~/.cache/telesplat-data.
std::vector<Walk> standard_walks();
bool has_data(const Walk& walk);

/// Digits and tolerance of a figure. It is worse where it is larger, or smaller with `more_is_better`, by more than
/// `tolerance`; 0: by more than 1 % of the golden value.
struct FigureRule {
  const char* name;
  int digits;
  bool more_is_better = false;
  double tolerance = 0;
};
inline constexpr FigureRule kFigureRules[] = {
    {"bytes", 0},                           // that the packer sent to viewers
    {"digests_equal", 0, true},             // 1: each viewer found its points equal to the packer's, and none unequal
    {"first_bytes", 0},                     // that viewer 0 had when its first view was complete,
    {"first_s", 3},                         // and how long after its start that was
    {"holes_percent", 2, false, 0.1},       // last frame of viewer 0: Compared::holes
    {"holes_walk_percent", 2, false, 0.1},  // mean over a frame of each second
    {"latency_ms", 1},                      // mean time of an update, from its request on
    {"leases", 0},                          // leases of tiles or slabs
    {"messages", 0},                        // that arrived
    {"points", 0},                          // the packer's model at the end
    {"psnr_db", 2, true, 0.1},              // last frame of viewer 0
    {"psnr_walk_db", 2, true, 0.1},         // mean over a frame of each second
    {"rays", 0},                            // that leases named
    {"updates", 0, true},                   // that viewers received complete
};

/// By name; those that the scene does not have are left out.
using WalkFigures = std::map<std::string, double>;

struct WalkResult {
  WalkFigures figures;  ///< rounded to their rules' digits
  Outcome outcome;      ///< its failure: no figure counts
};

/// Precondition: has_data(walk). Error: the mesh cannot be opened.
Result<WalkResult> run_walk(const Walk& walk);

/// A walk a line, in order of their names.
std::string json_of(const std::map<std::string, WalkFigures>& walks);

/// Figures of `now` that are worse than `golden`, and better ones: a line each names walk, figure and both values.
struct Comparison {
  std::vector<std::string> worse, better;
};
Comparison compare_figures(const std::string& walk, const WalkFigures& now, const WalkFigures& golden);

}  // namespace telesplat::simulation
