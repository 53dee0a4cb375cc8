// The figures of a run, printed at its end and by telesplat inspect of its folder.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "services/data/description.h"

namespace telesplat::launcher {

/// The main figures of a run.
struct RunReport {
  std::string head;                                        ///< the scene, and the way it was shown
  std::vector<std::pair<std::string, std::string>> lines;  ///< label, figure
  void line(const std::string& what, const std::string& value) { lines.emplace_back(what, value); }
};

/// Reads DIR/summary.json; figures that were not measured say so. Error: the file or a figure is missing.
Result<RunReport> read_report(const std::string& directory, double skip_s = 0);

/// Prints it; nothing if there is no summary.
void print_report(const std::string& directory);
/// Prints the report of a viewer that joined a session. master_folder: the session's record; empty: unknown.
void print_joined(const std::string& directory, const std::string& master_folder);

/// Returns main figures, the scene as recorded, files by name with their sizes. Its JSON has all of summary.json.
/// Error: the folder holds no finished run.
Result<data::Description> inspect_run(const std::string& directory, double skip_s = 0);

}  // namespace telesplat::launcher
