// How a command line program tells its user what is wrong.
#pragma once

#include "common/options/complain.h"

namespace telesplat::tools {

using telesplat::complain;

}  // namespace telesplat::tools
