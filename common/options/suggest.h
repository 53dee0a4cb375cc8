// "Did you mean": what a person may have wanted to type.
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace telesplat::options {

/// "; did you mean --duration?" where a candidate is like `word`, or the only one that `word` begins; else empty.
std::string did_you_mean(std::string_view word, const std::vector<std::string>& candidates);

}  // namespace telesplat::options
