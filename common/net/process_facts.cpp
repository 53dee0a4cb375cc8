#include "common/net/process_facts.h"

#include <fmt/format.h>

#include <cstdlib>

#include "common/core/machine.h"
#include "common/core/version.h"
#include "common/net/service.h"

namespace telesplat::net {

std::map<std::string, std::string> process_facts() {
  const Machine machine = this_machine();
  std::map<std::string, std::string> out{{"host", host_name()}, {"version", version()}, {"command", command_line()}};
  if (!machine.processor.empty()) out["processor"] = machine.processor;
  if (machine.cores > 0) out["cores"] = std::to_string(machine.cores);
  if (machine.memory_mb > 0) out["memory_mb"] = fmt::format("{:.0f}", machine.memory_mb);
  if (const char* launcher = std::getenv(kLaunchedByVariable); launcher && *launcher) out["launched_by"] = launcher;
  return out;
}

}  // namespace telesplat::net
