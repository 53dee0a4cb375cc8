// What a run tells the person when it is over, and telesplat inspect of its folder.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "services/data/description.h"

namespace telesplat::launcher {

/// The main figures of a run.
struct RunReport {
  std::string head;                                        ///< what was shown, and how
  std::vector<std::pair<std::string, std::string>> lines;  ///< what, figure
  void line(const std::string& what, const std::string& value) { lines.emplace_back(what, value); }
};

/// Of DIR/summary.json; figures that were not measured say so. Error: there is none, or a figure is missing.
Result<RunReport> read_report(const std::string& directory, double skip_s = 0);

/// Prints it; nothing if there is no summary.
void print_report(const std::string& directory);
/// The same of a viewer that joined a session. master_folder: of the session's record; empty: it is not known.
void print_joined(const std::string& directory, const std::string& master_folder);

/// Main figures, the scene as it was recorded, files by name with their sizes. Its JSON has all of summary.json. Error:
/// it is no folder of a finished run.
Result<data::Description> inspect_run(const std::string& directory, double skip_s = 0);

}  // namespace telesplat::launcher
