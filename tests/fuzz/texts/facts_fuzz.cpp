// Reads any lines "name=value" as a data server's facts: gives an error, or a scene that is written the same way again.
#include <cmath>
#include <cstdlib>
#include <map>
#include <string>

#include "common/julia/parameters.h"
#include "common/scene/legend.h"
#include "common/volume/session.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat;
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::map<std::string, double> parameters;
  std::map<std::string, std::string> facts;
  while (!rest.empty()) {
    const std::string line(rest.substr(0, rest.find('\n')));
    rest.remove_prefix(std::min(rest.size(), line.size() + 1));
    const size_t equals = line.find('=');
    if (equals == std::string::npos) continue;
    const std::string name = line.substr(0, equals), value = line.substr(equals + 1);
    char* end = nullptr;
    const double number = std::strtod(value.c_str(), &end);
    if (!value.empty() && *end == 0)
      parameters[name] = number;
    else
      facts[name] = value;
  }
  if (const auto session = volume::read_session(parameters, facts); session.ok()) {
    const auto again = volume::read_session(volume::to_parameters(*session), volume::to_facts(*session));
    if (!again.ok() || !(*again == *session)) std::abort();
    (void)volume::validate(session->grid);
  }
  if (const auto set = julia::from_map(parameters); set.ok() && julia::validate(*set).ok()) {
    const auto again = julia::from_map(julia::to_map(*set));
    if (!again.ok()) std::abort();
    julia::slice(*set);
  }
  (void)julia::placement_from_map(parameters, {{-1, -1, -1}, {1, 1, 1}});
  (void)scene::legend_of(facts, parameters);
  return 0;
}
