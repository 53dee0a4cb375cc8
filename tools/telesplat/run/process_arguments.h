// The command lines of a session's processes, from the launcher's options. Master's address, name and log level are added by whoever
// starts them.
#pragma once

#include <string>
#include <vector>

#include "tools/telesplat/run/run_command.h"

namespace telesplat::launcher {

std::vector<std::string> master_arguments(const RunOptions& options);
/// part: 0 to options.data_servers - 1.
std::vector<std::string> data_arguments(const RunOptions& options, int part);
std::vector<std::string> packer_arguments(const RunOptions& options);
std::vector<std::string> sampler_arguments(const RunOptions& options);
/// number: 1 to options.viewers. Only the first one's frames are verified. clock_from_s: when the trajectory of a wall begins, on the
/// monotonic clock; 0: each viewer's begins with its first frame.
std::vector<std::string> viewer_arguments(const RunOptions& options, int number, double clock_from_s);

}  // namespace telesplat::launcher
