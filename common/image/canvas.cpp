#include "common/image/canvas.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "common/image/glyphs.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::image {

int text_width(std::string_view text, int scale) {
  int characters = 0;
  for (; !text.empty(); ++characters) take_character(text);
  return characters == 0 ? 0 : (characters * kGlyphAdvance - 1) * scale;
}

Canvas::Canvas(int width, int height, uint32_t background)
    : view_{width, height, std::vector<uint32_t>(size_t(width) * height, background), {}} {}

void Canvas::set(int x, int y, uint32_t colour) {
  if (x >= 0 && y >= 0 && x < view_.width && y < view_.height) view_.colour[size_t(y) * view_.width + x] = colour;
}

void Canvas::place(const View& picture, int x, int y) {
  const int x0 = std::max(0, -x), x1 = std::min(picture.width, view_.width - x);
  if (x0 >= x1) return;
  for (int row = std::max(0, -y); row < std::min(picture.height, view_.height - y); ++row)
    std::copy_n(&picture.colour[size_t(row) * picture.width + x0], x1 - x0,
                &view_.colour[size_t(y + row) * view_.width + x + x0]);
}

void Canvas::text(int x, int y, std::string_view text, uint32_t colour, int scale) {
  while (!text.empty()) {
    const Glyph& glyph = glyph_of(take_character(text));
    for (int row = 0; row < kGlyphHeight * scale; ++row)
      for (int column = 0; column < kGlyphWidth * scale; ++column)
        if (glyph[row / scale] >> (kGlyphWidth - 1 - column / scale) & 1) set(x + column, y + row, colour);
    x += kGlyphAdvance * scale;
  }
}

void Canvas::outline(const geometry::Rect& r, uint32_t colour) {
  for (int x = r.x; x < r.x + r.width; ++x) set(x, r.y, colour), set(x, r.y + r.height - 1, colour);
  for (int y = r.y; y < r.y + r.height; ++y) set(r.x, y, colour), set(r.x + r.width - 1, y, colour);
}

void blend(View& onto, const View& picture, int x, int y) {
  const int x0 = std::max(0, -x), x1 = std::min(picture.width, onto.width - x);
  for (int row = std::max(0, -y); row < std::min(picture.height, onto.height - y); ++row)
    for (int column = x0; column < x1; ++column) {
      const uint32_t over = picture.colour[size_t(row) * picture.width + column], alpha = over >> 24;
      uint32_t& under = onto.colour[size_t(y + row) * onto.width + x + column];
      uint32_t mixed = 0;
      for (int shift = 16; shift >= 0; shift -= 8) {
        const uint32_t a = over >> shift & 255, b = under >> shift & 255;
        mixed = mixed << 8 | (a * alpha + b * (255 - alpha) + 127) / 255;
      }
      under = (alpha + ((under >> 24) * (255 - alpha) + 127) / 255) << 24 | mixed;
    }
}

View shrink(const View& picture, int width, int height) {
  CHECK(width >= 1 && height >= 1 && width <= picture.width && height <= picture.height);
  View out{width, height, std::vector<uint32_t>(size_t(width) * height), {}};
  const double step_x = double(picture.width) / width, step_y = double(picture.height) / height;
  in_parallel(0, height, [&](int y) {
    const double top = y * step_y, bottom = (y + 1) * step_y;
    for (int x = 0; x < width; ++x) {
      const double left = x * step_x, right = (x + 1) * step_x;
      double sum[3] = {}, area = 0;
      for (int v = int(top); v < std::min(picture.height, int(std::ceil(bottom))); ++v)
        for (int u = int(left); u < std::min(picture.width, int(std::ceil(right))); ++u) {
          const double share = (std::min<double>(u + 1, right) - std::max<double>(u, left)) *
                               (std::min<double>(v + 1, bottom) - std::max<double>(v, top));
          const uint32_t c = picture.colour[size_t(v) * picture.width + u];
          for (int i = 0; i < 3; ++i) sum[i] += share * (c >> (16 - 8 * i) & 255);
          area += share;
        }
      uint32_t mean = 0;
      for (const double s : sum) mean = mean << 8 | static_cast<uint32_t>(std::clamp(s / area + 0.5, 0.0, 255.0));
      out.colour[size_t(y) * width + x] = mean;
    }
  });
  return out;
}

View magnify(const View& picture, const geometry::Rect& part, int factor) {
  CHECK(part.x >= 0 && part.y >= 0 && part.x + part.width <= picture.width && part.y + part.height <= picture.height);
  CHECK(factor >= 1);
  View out{part.width * factor, part.height * factor, {}, {}};
  out.colour.resize(size_t(out.width) * out.height);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x)
      out.colour[size_t(y) * out.width + x] =
          picture.colour[size_t(part.y + y / factor) * picture.width + part.x + x / factor];
  return out;
}

geometry::Rect worst_square(const std::vector<float>& errors, int width, int height, int side) {
  CHECK(errors.size() == size_t(width) * height && width > 0 && height > 0 && side > 0);
  const int w = std::min(side, width), h = std::min(side, height);
  // Sums columns over the h rows above, then slides a window of w columns along them.
  std::vector<double> columns(width, 0.0);
  geometry::Rect best{0, 0, w, h};
  double most = -1;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      columns[x] += errors[size_t(y) * width + x];
      if (y >= h) columns[x] -= errors[size_t(y - h) * width + x];
    }
    if (y < h - 1) continue;
    double sum = 0;
    for (int x = 0; x < width; ++x) {
      sum += columns[x];
      if (x >= w) sum -= columns[x - w];
      if (x >= w - 1 && sum > most + 1e-6) most = sum, best = {x - w + 1, y - h + 1, w, h};
    }
  }
  return best;
}

}  // namespace telesplat::image
