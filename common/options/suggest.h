// "Did you mean": suggests the word that a person may have wanted to type.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace telesplat::options {

/// "; did you mean --duration?" if a candidate resembles `word`, or is the only one that begins with it; else empty.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace telesplat::options
