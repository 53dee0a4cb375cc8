// Pictures composed from pictures and text: contact sheets. No font files, no GL.
#pragma once

#include <string_view>

#include "common/geometry/camera.h"
#include "common/image/file.h"

namespace telesplat::image {

/// Built-in letters: 5 x 7 pixels, one pixel between them; printable ASCII and common signs of units in UTF-8; any
/// other character is a hollow box.
inline constexpr int kGlyphWidth = 5, kGlyphHeight = 7, kGlyphAdvance = 6;

/// Width of a line of text in pixels. scale: pixels a side of a letter's dot.
int text_width(std::string_view text, int scale);

class Canvas {
 public:
  Canvas(int width, int height, uint32_t background);

  /// Copies a picture so that its upper left pixel lies at (x, y); cuts off parts outside.
  void place(const View& picture, int x, int y);
  /// Writes one line; (x, y): upper left corner of its first letter. Cuts off parts outside.
  void text(int x, int y, std::string_view text, uint32_t colour, int scale = 2);
  /// A frame of one pixel just inside the rectangle.
  void outline(const geometry::Rect& rect, uint32_t colour);

  const View& view() const { return view_; }

 private:
  void set(int x, int y, uint32_t colour);
  View view_;
};

/// Lays a picture of 0xAARRGGBB (not premultiplied; alpha 255 is opaque) over another one, its upper left pixel at (x,
/// y); cuts off parts outside. The upper byte gets the coverage of both.
void blend(View& onto, const View& picture, int x, int y);

/// A smaller picture of `width` x `height` pixels: each is the mean of the area that it covers, on sRGB codes. Without
/// depth. Preconditions: 1 <= width <= picture.width, the same for the height.
View shrink(const View& picture, int width, int height);

/// A part of a picture, enlarged: each pixel becomes a square of `factor` pixels. Precondition: the part lies inside.
View magnify(const View& picture, const geometry::Rect& part, int factor);

/// The square of `side` pixels with the largest sum of `errors` (row-major, width x height); of equals, the first. Its
/// sides are shorter if the picture is smaller. Finds the place where two pictures differ most.
geometry::Rect worst_square(const std::vector<float>& errors, int width, int height, int side);

}  // namespace telesplat::image
