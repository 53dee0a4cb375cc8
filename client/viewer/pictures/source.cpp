#include "client/viewer/pictures/source.h"

#include <algorithm>
#include <cmath>

#include "common/core/clock.h"

namespace telesplat::viewer {
namespace {

constexpr uint32_t kColour = 0xffffff;

// Between a and b, share of b in 1/256.
uint32_t mixed(uint32_t a, uint32_t b, uint32_t share) {
  const auto channel = [&](int shift) {
    return ((a >> shift & 255) * (256 - share) + (b >> shift & 255) * share + 128) >> 8 << shift;
  };
  return channel(16) | channel(8) | channel(0);
}

// Where a pixel's centre lies between those of `from` pixels.
struct Place {
  int before, after;
  uint32_t share;
};
Place place_of(int at, int to, int from) {
  const double middle = std::clamp((at + 0.5) * from / to - 0.5, 0.0, double(from - 1));
  const int before = int(middle);
  return {before, std::min(before + 1, from - 1), uint32_t(std::lround((middle - before) * 256))};
}

}  // namespace

void scale_into(const image::View& from, image::View& to) {
  if (from.width == to.width && from.height == to.height) {
    std::ranges::transform(from.colour, to.colour.begin(), [](uint32_t c) { return c & kColour; });
    return;
  }
  std::vector<Place> columns(size_t(to.width));
  for (int x = 0; x < to.width; ++x) columns[size_t(x)] = place_of(x, to.width, from.width);
  for (int y = 0; y < to.height; ++y) {
    const Place row = place_of(y, to.height, from.height);
    const uint32_t* upper = &from.colour[size_t(row.before) * size_t(from.width)];
    const uint32_t* lower = &from.colour[size_t(row.after) * size_t(from.width)];
    for (int x = 0; x < to.width; ++x) {
      const Place& c = columns[size_t(x)];
      to.colour[size_t(y) * size_t(to.width) + size_t(x)] = mixed(
          mixed(upper[c.before], upper[c.after], c.share), mixed(lower[c.before], lower[c.after], c.share), row.share);
    }
  }
}

DrawnFrame PictureSource::draw(const FrameInput& input, image::View& view) {
  const DisplayedPicture shown = shelf_.displayed();
  DrawnFrame out;
  out.chosen_s = monotonic_s();
  out.empty = !shown.picture;
  if (out.empty) {
    if (input.even_empty) std::ranges::fill(view.colour, input.look.background);
    return out;
  }
  const ShownPicture& picture = *shown.picture;
  out.still = drawn_ == shown.picture;
  out.changed = !input.intact || !out.still;
  if (out.changed) scale_into(picture.view, view);
  drawn_ = shown.picture;
  // A picture has no depth: who compares it takes that of the data (kPictureOnly of the spool).
  if (input.with_depth) std::ranges::fill(view.depth_m, 1.0f);
  out.picture_of = picture.camera;
  out.selected = out.drawn = out.cached = picture.view.colour.size();
  out.items = 1;
  out.sequence = picture.frame.value;
  out.epoch = picture.epoch;
  out.update = shown.update;
  return out;
}

DrawnFrame PictureSource::draw_pair(const FrameInput& input, const std::array<geometry::Camera, 2>&,
                                    const std::array<splat::FrameTarget, 2>& targets) {
  image::View view{targets[0].width, targets[0].height, {}, {}};
  view.colour.resize(size_t(view.width) * size_t(view.height));
  FrameInput one = input;
  one.with_depth = one.intact = false;
  DrawnFrame out = draw(one, view);
  for (const auto& target : targets) std::ranges::copy(view.colour, target.colour);
  return out;
}

}  // namespace telesplat::viewer
