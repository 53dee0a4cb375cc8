#include "services/master/control.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

namespace telesplat::master {

Result<double> read_number(const std::string& name, const std::string& text) {
  double value = 0;
  const auto end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, value);
  if (text.empty() || read.ec != std::errc() || read.ptr != end || !std::isfinite(value))
    return Error{fmt::format("{} is \"{}\", not a finite number", name.substr(0, 64), text.substr(0, 40))};
  return value;
}

}  // namespace telesplat::master
