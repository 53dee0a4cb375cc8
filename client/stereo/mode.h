// Ways to show the pictures of two eyes on one display.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace telesplat::stereo {

enum class Mode {
  kOff,             ///< one picture, for both eyes
  kSideBySide,      ///< the left eye's picture in the left half of the display
  kSideBySideHalf,  ///< the same, each squeezed to half of its width: the display stretches them
  kTopBottom,       ///< the left eye's picture in the upper half
  kTopBottomHalf,   ///< the same, each squeezed to half of its height
  kAnaglyphGrey,    ///< red and cyan glasses; both pictures as grey
  kAnaglyphColour,  ///< the left picture's red, the right one's green and blue
  kAnaglyphDubois,  ///< colours as near as the glasses allow (Dubois 2009)
  kRows,            ///< even rows (from the top, counted from 0) are the left eye's
  kColumns,         ///< even columns are the left eye's
  kChecker,         ///< pixels where row + column is even are the left eye's
  kAutostereo,      ///< each subpixel belongs to the eye that sees it through a line screen (autostereo/)
  kQuadBuffer       ///< each eye has a frame buffer of its own; composed as kSideBySide of a display twice as wide
};

/// Values of --stereo, in the order of Mode.
const std::vector<std::string>& mode_names();
std::string_view name_of(Mode mode);
std::optional<Mode> mode_named(std::string_view name);

struct Size {
  int width = 0, height = 0;
  bool operator==(const Size&) const = default;
};
/// Returns the size of one eye's picture, in pixels, for a display of this size; at least 1 a side. With kAutostereo
/// any other size will do as well.
Size eye_size(Mode mode, Size display);
/// Returns the size of the picture that is composed of two of size `eye`.
Size composed_size(Mode mode, Size eye);

}  // namespace telesplat::stereo
