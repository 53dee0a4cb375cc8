// Orders of people to the launcher (scene::Keeper::kLauncher), as the master's status tells them.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace telesplat::launcher {

struct Wish {
  uint64_t number = 0;  ///< the master's
  uint64_t master = 0;  ///< process id: another one counts from 1 again
  std::string order, value;
};

/// Those without an answer yet. What is strange is left out.
std::vector<Wish> wishes_of(const nlohmann::json& status);

}  // namespace telesplat::launcher
