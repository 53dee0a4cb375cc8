// Which program this is.
#pragma once

#include <string>

namespace telesplat {

/// "0.2.0-dev (5ad84a7, 2026-11-22)": version, commit and the commit's date; without commit and date where the sources
/// do not tell them. Link telesplat::version, whose one file is compiled again when the commit changes.
std::string version();

}  // namespace telesplat
