// What `telesplat bench thesis` found: the thesis's tables 7.1 to 7.4 and figures 6.1 to 6.3 beside ours.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/telesplat/bench/thesis/steps.h"

namespace telesplat::launcher {

struct ThesisTable {
  std::string title;
  std::vector<std::string> notes;  ///< sentences: what stands for what, what is simulated
  std::vector<std::string> head;
  std::vector<std::vector<std::string>> rows;
};

struct ThesisFigure {
  std::string title, file, svg;
  std::vector<std::string> notes;
};

struct ThesisReport {
  std::vector<std::string> about;  ///< sentences: machine, version, date
  std::vector<ThesisTable> tables;
  std::vector<ThesisFigure> figures;
};

/// Reads what the steps of these parts left in `directory`. What is not there yet is "-". cores: of this machine.
ThesisReport read_results(const std::string& directory, const std::vector<std::string>& parts, bool quick, int cores);

std::string to_markdown(const ThesisReport& report);
std::string to_html(const ThesisReport& report);
std::string to_text(const ThesisReport& report);

}  // namespace telesplat::launcher
