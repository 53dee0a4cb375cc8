// Test pictures by which a person sees that each eye gets its own.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/file.h"

namespace telesplat::stereo {

enum class Pattern {
  kNone,
  kCalibration,  ///< the left eye's picture is red, the right one's blue; a white cross in the middle of both
  kTest  ///< a grid, numbered rows, and the eye's name, in the colours of each eye's own half of a fusable frame
};

/// "off", "calibration", "test": in the order of Pattern.
const std::vector<std::string>& pattern_names();
std::optional<Pattern> pattern_named(std::string_view name);

/// The pictures of the left and the right eye, of this size. Precondition: the pattern is not kNone.
std::array<image::View, 2> eye_patterns(Pattern pattern, int width, int height);

}  // namespace telesplat::stereo
