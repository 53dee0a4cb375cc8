// Letters and colours of the panel, for any pixel density.
#pragma once

namespace telesplat::viewer {

class GuiStyle {
 public:
  /// Fits Dear ImGui's style and font, between its frames. scale: size relative to a plain display; pixels_a_unit:
  /// pixels of the framebuffer a unit of screen coordinates, so that letters are sharp. True: they changed, and the
  /// font's texture must be made anew.
  bool fit(double scale, double pixels_a_unit);

 private:
  double scale_ = 0, pixels_a_unit_ = 0;
};

}  // namespace telesplat::viewer
