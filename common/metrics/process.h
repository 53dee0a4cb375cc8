// A process as the record of a run knows it.
#pragma once

#include <cstdint>
#include <map>
#include <string>

namespace telesplat::metrics {

struct Process {
  std::string role, name;
  uint64_t pid = 0;
  std::map<std::string, std::string> facts;
  std::map<std::string, double> values;  ///< newest status report
  bool replaced = false;                 ///< it died and another of its name took its place
};

}  // namespace telesplat::metrics
