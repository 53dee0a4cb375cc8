// What a run tells the person when it is over.
#pragma once

#include <string>

namespace telesplat::launcher {

/// Prints the main figures of DIR/summary.json; nothing if there is none.
void print_report(const std::string& directory);

}  // namespace telesplat::launcher
