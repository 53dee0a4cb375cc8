// Letters and colours of the panel, for any density of pixels.
#pragma once

namespace telesplat::viewer {

class GuiStyle {
 public:
  /// Makes Dear ImGui's style and font fit. scale: how much larger than on a plain display; pixels_a_unit: pixels of
  /// the framebuffer a unit of screen coordinates, so that letters are sharp. True: they changed, and the font's
  /// texture is to be made anew. Between Dear ImGui's frames.
  bool fit(double scale, double pixels_a_unit);

 private:
  double scale_ = 0, pixels_a_unit_ = 0;
};

}  // namespace telesplat::viewer
