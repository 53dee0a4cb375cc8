#include "tools/lab/scaling/number_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

namespace telesplat::lab {

options::Text number_list(std::vector<int>& value, int least, int most) {
  const auto read = [&value, least, most](const std::string& text) -> Status {
    value.clear();
    for (size_t begin = 0; begin <= text.size();) {
      const size_t comma = std::min(text.find(',', begin), text.size());
      int n = 0;
      const auto [stop, error] = std::from_chars(text.data() + begin, text.data() + comma, n);
      if (error != std::errc() || stop != text.data() + comma || n < least || n > most)
        return Error{fmt::format("\"{}\" is not in {}..{}", text.substr(begin, comma - begin), least, most)};
      value.push_back(n);
      begin = comma + 1;
    }
    return ok_status();
  };
  return {.read = read, .write = [&value] { return fmt::format("{}", fmt::join(value, ",")); }};
}

}  // namespace telesplat::lab
