#include "client/displays/window/legend.h"

#include <functional>
#include <tuple>

namespace telesplat::viewer {

void WindowLegend::on_legend(const std::shared_ptr<const image::Legend>& legend) {
  if (legend_ == legend && width_ == window_.width() && height_ == window_.height()) return;
  legend_ = legend;
  width_ = window_.width();
  height_ = window_.height();
  show();
}

bool WindowLegend::built() const {
  const bool on_wall = display_.wall.described || display_.wall.tiles() > 1;
  return legend_ && display_.legend && !on_wall;
}

void WindowLegend::build(ColourControls& colours, double now_s, double hidden) {
  image::Legend shown = *legend_;
  const bool editable = colours.colouring() && shown.opacity.empty();
  if (editable) std::tie(shown.lo, shown.hi) = colours.range();
  const std::function<void(double, double)> change = [&](double lo, double hi) { colours.choose_range(now_s, lo, hi); };
  part_ = show_legend(shown, view_, hidden, editable ? change : nullptr);
}

// As an overlay, it is in the wall's tile at the lower right.
void WindowLegend::show() {
  const WallTile& wall = display_.wall;
  const int tiles = wall.described ? int(wall.described->screens.size()) : wall.columns * wall.rows;
  if (!legend_ || !display_.legend || built() || wall.tile != tiles - 1) return overlays_.hide("legend");
  overlays_.show("legend", {image::legend_picture(*legend_, width_, height_), Overlay::Corner::kLowerRight});
}

void WindowLegend::draw_into(image::View& picture, const WallTile& wall) const {
  if (legend_ && display_.legend)
    image::draw_legend(picture, *legend_, part_of_wall(picture.width, picture.height, wall));
}

}  // namespace telesplat::viewer
