// The figures of a comparison as a table, as CSV and as JSON (docs/metrics.md).
#pragma once

#include <nlohmann/json.hpp>

#include "tools/telesplat/compare/measure.h"
#include "tools/telesplat/movie/contact_sheet.h"
#include "tools/telesplat/record/recorded_run.h"

namespace telesplat::launcher {

/// One pose with its cells; their pictures may have been dropped.
struct ComparedPose {
  DisplayedFrame frame;
  uint64_t points_cached = 0;
  std::vector<Cell> cells;
};

/// A row per pose and cell.
std::string comparison_csv(const std::vector<ComparedPose>& poses);

/// Returns `about` with "poses" (each with its "cells") and "medians" (over the poses, a row per kernel and renderer).
nlohmann::ordered_json comparison_json(nlohmann::ordered_json about, const std::vector<ComparedPose>& poses);

/// For a person: a line per pose and cell, then the medians.
std::string comparison_table(const std::vector<ComparedPose>& poses);

/// Writes the medians over poses of cell `i`'s figures in a line.
std::string median_label(const std::vector<ComparedPose>& poses, size_t i);

/// Draws one pose: the reference, then a row for each cell with its picture, its FLIP map, the square where it differs
/// most, 4 times as large, and the same square of the reference.
image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions);

/// Draws a pose's column of the whole run's sheet, the reference and then the cells in their order: small pictures with
/// their error maps, and the square in which the cells together differ most from the reference.
std::vector<SheetCell> pose_column(const image::View& reference, const std::vector<Cell>& cells,
                                   const std::string& pose_name);

}  // namespace telesplat::launcher
