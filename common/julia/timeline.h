// Change of a scene's parameters in time: key frames, read from the command line or a scene file. Uses only names and
// numbers.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::julia {

/// One parameter's key frames. Between two the value changes smoothly (cosine), so that it rests at each.
struct Track {
  struct Key {
    double t_s, value;
  };
  std::string name;
  std::vector<Key> keys;           ///< at least two, t_s ascending from 0
  double value(double t_s) const;  ///< repeats after the last key
};

struct Timeline {
  std::vector<Track> tracks;  ///< one a name
  bool empty() const { return tracks.empty(); }
  /// Values at t_s seconds after the animation began.
  std::map<std::string, double> values(double t_s) const;
  /// The text that --animate takes.
  std::string text() const;
};

/// Reads "c.y=-0.4:0.4:10s" (from -0.4 to 0.4 in 10 s and back again in 10 s, for ever) or
/// "c.y=@0s:-0.4@5s:0.4@10s:-0.4" (key frames; for ever, so first and last value should be the same); several are
/// separated by ";". Error: names the part that cannot be read, the value and the limit; a name twice; times that do
/// not rise; not finite; more than 4096 key frames.
Result<Timeline> parse_timeline(std::string_view text);

}  // namespace telesplat::julia
