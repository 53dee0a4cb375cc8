#include "common/volume/histogram.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/core/check.h"

namespace telesplat::volume {
namespace {

// Takes a number off the front of a text, and the character `after` behind it, if present.
template <class Number>
bool take(std::string_view& text, Number& value, char after) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), value);
  if (read.ec != std::errc()) return false;
  text.remove_prefix(size_t(read.ptr - text.data()));
  if (text.empty()) return after == ',';
  if (text.front() != after) return false;
  text.remove_prefix(1);
  return after != ',' || !text.empty();
}

}  // namespace

Histogram histogram_of(std::span<const uint64_t> level_counts, const Levels& levels, int bins) {
  CHECK(level_counts.size() == size_t(levels.count));
  const int count = std::clamp(std::min(bins, levels.count), 1, kMostBins);
  Histogram out{levels.lo - levels.step / 2, levels.value(levels.count) - levels.step / 2, {}};
  out.counts.assign(size_t(count), 0);
  for (size_t l = 0; l < level_counts.size(); ++l)
    out.counts[l * size_t(count) / level_counts.size()] += level_counts[l];
  return out;
}

std::string to_text(const Histogram& h) { return fmt::format("{}:{}:{}", h.lo, h.hi, fmt::join(h.counts, ",")); }

Result<Histogram> histogram_from_text(std::string_view text) {
  const Error error{fmt::format("\"{}\" is no histogram LO:HI:COUNT,COUNT,...", text.substr(0, 40))};
  Histogram out;
  if (!take(text, out.lo, ':') || !take(text, out.hi, ':')) return error;
  if (!std::isfinite(out.lo) || !std::isfinite(out.hi) || !(out.lo < out.hi)) return error;
  while (!text.empty()) {
    uint64_t count = 0;
    if (!take(text, count, ',')) return error;
    if (out.counts.size() == size_t(kMostBins))
      return Error{fmt::format("a histogram of more than {} bins", kMostBins)};
    out.counts.push_back(count);
  }
  if (out.counts.empty()) return error;
  return out;
}

}  // namespace telesplat::volume
