// What a sweep found, as tables: for programs and for people.
#pragma once

#include <string>

#include "tools/telesplat/sweep/record.h"

namespace telesplat::launcher {

/// sweep.csv: a row a run, those that failed or have not ended included. Columns: the run, its flags ("flag.NAME"), the
/// machine's load, then every number of its summary by name; empty where a run has none.
std::string to_csv(const SweepRecord& record);

/// Appends a line of comma-separated values.
void add_line(std::string& out, const std::vector<std::string>& cells);

/// A row a configuration: median, and least..most where runs differ, of the main figures that were measured. "!" behind
/// a value: its runs differ too much (noises()).
std::string to_text(const SweepRecord& record);

/// "16.7 (16.6..18.2)"; without the brackets where all are the same to the last digit that is shown.
std::string text_of(const Measure& figure, const Spread& spread);

}  // namespace telesplat::launcher
