// The version of this program.
#pragma once

#include <string>

namespace telesplat {

/// "0.2.0-dev (5ad84a7, 2026-11-22)": version, commit and the commit's date; no commit and date if the sources do not
/// state them. Link telesplat::version, whose one file is compiled again when the commit changes.
std::string version();

}  // namespace telesplat
