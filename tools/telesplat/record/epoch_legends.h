// What the legends of a recorded run told, by epoch.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/image/legend.h"

namespace telesplat::launcher {

class EpochLegends {
 public:
  /// Reads epochs.csv, if there is one. Error: it cannot be read.
  static Result<EpochLegends> read(const std::string& run_directory);
  /// Null: there was nothing to tell.
  const image::Legend* at(EpochId epoch) const;

 private:
  std::map<uint64_t, std::shared_ptr<const image::Legend>> legends_;  // shared by the epochs that told the same
};

}  // namespace telesplat::launcher
