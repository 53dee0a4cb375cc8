// The figures of a record from its files: of one that several masters wrote, none of them has all in memory.
#pragma once

#include <string>
#include <vector>

#include "common/metrics/lives/lives.h"
#include "common/metrics/measured.h"

namespace telesplat::metrics {

/// What the tables in `directory` add up to. Rows that cannot be read are left out, and those of what began before
/// from_s: frames, requests, leases and plans, since the run's beginning.
Measured read_back(const std::string& directory, const std::vector<Life>& lives, double from_s = -1e300);
/// Columns of a table's header; none if it has no whole one.
std::vector<std::string> header_of(const std::string& path);

}  // namespace telesplat::metrics
