// What every process tells the record of a run about itself.
#pragma once

#include <map>
#include <string>

namespace telesplat::net {

/// Facts of a hello: "host", "version", "processor", "cores", "memory_mb", "command" (its command line), "launched_by"
/// (the command line of the launcher that started it). What the system does not tell is not there.
std::map<std::string, std::string> process_facts();

}  // namespace telesplat::net
