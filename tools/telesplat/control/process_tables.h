// The processes of a session as tables, one a role.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace telesplat::launcher {

/// processes: as "status" tells them. Each table begins with an empty line; those that left are named at the end.
std::string process_tables(const nlohmann::ordered_json& processes);

}  // namespace telesplat::launcher
