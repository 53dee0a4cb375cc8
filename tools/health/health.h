// Whether a process takes part in a session, as its master sees it: what a container's health check asks.
#pragma once

#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::health {

/// Which process: an empty field fits every process. All empty: none in particular, the master's answer is enough.
struct Subject {
  std::string role;  ///< "data", "sampler", "packer", "viewer"
  std::string name;
  std::string host;  ///< fact "host" of its hello
};

/// Processes report every second: who said nothing for so long hangs.
inline constexpr double kSilent_s = 3.0;

/// ok if the master's answer to "status" names a process that fits `subject`, is alive and not silent. The error says
/// who was looked for and what is wrong with who was found, or that the answer is not a status.
Status check(std::string_view status, const Subject& subject);

}  // namespace telesplat::health
