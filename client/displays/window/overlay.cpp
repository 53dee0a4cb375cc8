#include "client/displays/window/overlay.h"

#include <algorithm>
#include <utility>

#include "common/core/within.h"
#include "common/image/canvas.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kGround = 0xc0101418, kInk = 0xfff0f0f0;
constexpr int kMargin = 12;                // pixels, from the window's edge
constexpr int kPadding = 4, kLeading = 3;  // dots of a letter

}  // namespace

void Overlays::show(const std::string& name, Overlay overlay) {
  if (overlay.picture.width == 0) return hide(name);
  all_.insert_or_assign(name, std::move(overlay));
  ++version_;
}

void Overlays::hide(const std::string& name) { version_ += all_.erase(name); }

image::View text_panel(const std::vector<std::string>& lines, int scale) {
  int width = 1;
  for (const auto& line : lines) width = std::max(width, image::text_width(line, scale));
  const int step = (image::kGlyphHeight + kLeading) * scale, padding = kPadding * scale;
  image::Canvas canvas(width + 2 * padding, std::max(1, int(lines.size())) * step - kLeading * scale + 2 * padding,
                       kGround);
  int y = padding;
  for (const auto& line : lines) {
    canvas.text(padding, y, line, kInk, scale);
    y += step;
  }
  return canvas.view();
}

geometry::Rect place_overlay(const Overlay& overlay, int window_width, int window_height, int hidden) {
  using Corner = Overlay::Corner;
  if (overlay.corner == Corner::kNone) return {overlay.x, overlay.y, overlay.picture.width, overlay.picture.height};
  const int margin = std::min({kMargin, window_width / 8, window_height / 8});
  const int left = within(hidden, 0, std::max(0, window_width - 4 * margin - 1));
  const double room_x = window_width - left - 2 * margin, room_y = window_height - 2 * margin;
  const double scale = std::min({1.0, room_x / overlay.picture.width, room_y / overlay.picture.height});
  const int width = std::max(1, int(overlay.picture.width * scale));
  const int height = std::max(1, int(overlay.picture.height * scale));
  const bool right = overlay.corner == Corner::kUpperRight || overlay.corner == Corner::kLowerRight;
  const bool low = overlay.corner == Corner::kLowerLeft || overlay.corner == Corner::kLowerRight;
  return {right ? window_width - margin - width : left + margin, low ? window_height - margin - height : margin, width,
          height};
}

}  // namespace telesplat::viewer
