// What `telesplat top` shows, as lines of styled text: a pure function of the session's state, for a screen and for
// plain text alike.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "tools/telesplat/top/state.h"

namespace telesplat::launcher {

enum class TopStyle { kPlain, kTitle, kHead, kDim, kGood, kAlarm, kCurve };

struct TopSpan {
  std::string text;
  TopStyle style = TopStyle::kPlain;
};
using TopLine = std::vector<TopSpan>;

enum class TopSort { kName, kBusy, kRate };
/// For people: "name", "busy", "tiles/s". next: the one that key s goes to.
const char* name_of(TopSort sort);
TopSort next(TopSort sort);

struct TopLayout {
  int width = 80;  ///< places of a line; at least 40 are used
  TopSort sort = TopSort::kName;
  bool unicode = false;     ///< curves have Unicode's blocks; else letters
  double wall_s = 0;        ///< wall clock, seconds since 1970
  double now_s = 0;         ///< the clock of TopHistory
  double unanswered_s = 0;  ///< so long the master has said nothing
};

/// No line is wider than layout.width. Columns for which there is no room are left out, the least important first.
std::vector<TopLine> top_lines(const TopState& state, const TopHistory& history, const TopLayout& layout);

/// The newest `width` values as a curve from 0 to `most`, the newest at the right; NaN is a gap.
std::string curve(std::span<const double> values, size_t width, double most, bool unicode);

std::string plain_text(const TopLine& line);

}  // namespace telesplat::launcher
