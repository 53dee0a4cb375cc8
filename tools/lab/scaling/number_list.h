// Flags that take several numbers: "1,2,4".
#pragma once

#include <string>
#include <vector>

#include "common/options/table.h"

namespace telesplat::lab {

/// Each number within least..most.
options::Text number_list(std::vector<int>& value, int least, int most);

}  // namespace telesplat::lab
