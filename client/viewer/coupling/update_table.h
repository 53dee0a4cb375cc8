// updates.csv (docs/metrics.md): a row for each complete view update, a line of update_table.cpp for each column.
#pragma once

#include <string>
#include <vector>

#include "client/viewer/coupling/view_requester.h"

namespace telesplat::viewer {

/// last: the part that made the update complete.
struct MeasuredUpdate {
  const ViewRequester::Update& update;
  const ViewPart& last;
};

std::vector<std::string> update_columns();
std::vector<double> update_row(const MeasuredUpdate& measured);

}  // namespace telesplat::viewer
