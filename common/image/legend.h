// The legend of a picture: a bar of a colour map, with readable numbers beside it.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "common/colour/colour_map.h"
#include "common/core/result.h"
#include "common/image/canvas.h"

namespace telesplat::image {

struct Legend {
  std::string title;      ///< UTF-8: the array and, in brackets, its unit
  double lo = 0, hi = 1;  ///< values at the map's ends; lo <= hi, finite
  colour::ColourMap map;
  std::vector<float> opacity;  ///< 0 to 1, at equal distances from lo to hi; empty: the map has no opacities
  bool operator==(const Legend&) const = default;
};

inline constexpr size_t kMaxLegendText = 20000;  ///< bytes of the text form
inline constexpr size_t kMaxLegendOpacities = 256;

/// Writes lines of text; legend_from_text reads the same legend (control characters of the title become blanks).
std::string to_text(const Legend& legend);
Result<Legend> legend_from_text(std::string_view text);

/// A round number on the bar.
struct Tick {
  double value = 0;
  std::string label;
};
struct Ticks {
  std::vector<Tick> all;  ///< ascending, within the range
  int exponent = 0;       ///< labels count 10 to the power of this; 0 unless numbers are very large or small
};
/// Multiples of 1, 2, 2.5 or 5 times a power of ten within [lo, hi]: at most `most` of them and at least two (one if lo
/// is hi). Labels have just enough digits to differ. Precondition: lo <= hi, both finite; most >= 2.
Ticks nice_ticks(double lo, double hi, int most);

/// The legend as a picture of 0xAARRGGBB, sized for a display of display_width x display_height pixels. Bar and letters
/// have dark rims and stand on a dark translucent plate, so that they are readable on any ground.
View legend_picture(const Legend& legend, int display_width, int display_height);
/// Place of such a picture on a display: in the lower right corner.
geometry::Rect legend_place(const View& legend_picture, int display_width, int display_height);
/// The part of a display that a picture shows: a tile of a wall, or all of it.
struct DisplayPart {
  int width = 0, height = 0;  ///< size of the whole display
  int x = 0, y = 0;           ///< first pixel of the picture
};
/// Draws the legend onto a finished picture, at its place.
void draw_legend(View& picture, const Legend& legend);
/// The same for a picture that is a part of a display: draws the part of the legend that lies in it.
void draw_legend(View& picture, const Legend& legend, const DisplayPart& part);

}  // namespace telesplat::image
