// What a run tells the person: live figures while it goes on, and what came of it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace telesplat::launcher {

/// One line of live figures from two of the master's status answers: those of all viewers together, frames a second of one.
class LiveFigures {
 public:
  std::string update(const nlohmann::json& status, double now_s);

 private:
  double last_s_ = 0, updates_ = 0, bytes_ = 0, frames_ = 0;
  std::string text_;
};

/// Prints the main figures of DIR/summary.json; nothing if there is none.
void print_report(const std::string& directory);

}  // namespace telesplat::launcher
