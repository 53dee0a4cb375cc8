// Lines of comma-separated values, with texts in quotes where they hold commas (RFC 4180, within one line).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::launcher {

/// The fields of a line; those in quotes without them, "" standing for a quote. Nothing: a quote that does not end, or text after one.
inline std::optional<std::vector<std::string>> csv_fields(std::string_view line) {
  std::vector<std::string> out(1);
  enum { kBegin, kPlain, kQuoted, kAfterQuote } state = kBegin;
  for (const char c : line) {
    if (state == kQuoted) {
      if (c == '"')
        state = kAfterQuote;
      else
        out.back() += c;
    } else if (c == ',') {
      out.emplace_back();
      state = kBegin;
    } else if (c == '"' && state != kPlain) {
      if (state == kAfterQuote) out.back() += '"';
      state = kQuoted;
    } else if (state == kAfterQuote) {
      return std::nullopt;
    } else {
      out.back() += c;
      state = kPlain;
    }
  }
  if (state == kQuoted) return std::nullopt;
  return out;
}

}  // namespace telesplat::launcher
