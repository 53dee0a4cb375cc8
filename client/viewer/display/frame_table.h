// frames.csv (docs/metrics.md): one row for each displayed frame; frame_table.cpp has one line for each column.
#pragma once

#include <string>
#include <vector>

#include "client/viewer/display/frame_figures.h"

namespace telesplat::viewer {

/// Counts the refreshes between two moments, both presented, that showed nothing new; 0 if there are no refreshes.
int refreshes_missed(double previous_s, double presented_s, double refresh_s);

std::vector<std::string> frame_columns();
std::vector<double> frame_row(const MeasuredFrame& frame);

}  // namespace telesplat::viewer
