#include "client/stereo/autostereo/interleaver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "client/stereo/autostereo/rows.h"
#include "common/core/check.h"
#include "common/parallel/in_parallel.h"

namespace telesplat::stereo {
namespace {

constexpr int kRowsOfTask = 16;

constexpr size_t kSpare = 48;  // pixels that rows.h writes beyond a row, and the part of a cell beyond it

// Maps pixel n of `of` to a picture of `among` pixels: a whole pixel and 256ths of the way to the next one.
std::array<uint32_t, 2> place_among(int n, int of, int among) {
  const double at = std::clamp((n + 0.5) * among / of - 0.5, 0.0, double(among - 1));
  const double whole = std::floor(at);
  return {uint32_t(whole), uint32_t(std::lround((at - whole) * 256))};
}

// Integrates the open width from line 0 to `line`, in lines.
double opened(double line, double half_opening) {
  const double nearest = std::nearbyint(line);
  return 2 * half_opening * nearest + std::clamp(line - nearest, -half_opening, half_opening);
}

}  // namespace

// The plate refracts light differently at each place, but very evenly: within a cell lines are straight to a few
// thousandths of a line.
void Interleaver::find_lines(const Eyes& eyes) {
  if (lines_known_ && eyes == eyes_) return;
  eyes_ = eyes;
  lines_known_ = true;
  const int columns = panel_.width / kCell + 2, rows = panel_.height / kCell + 2;
  for (size_t eye = 0; eye < 2; ++eye) {
    auto& lines = lines_[eye];
    lines.resize(size_t(columns) * size_t(rows));
    in_parallel(0, rows, [&](int row) {
      for (int column = 0; column < columns; ++column)
        lines[size_t(row) * size_t(columns) + size_t(column)] =
            line_at(panel_.lines, through(panel_.lines, eyes[eye], place_of(panel_, column * kCell, row * kCell, 0)));
    });
  }
}

void Interleaver::share_out(int row, uint32_t* left, uint32_t* right) const {
  const size_t columns = size_t(panel_.width / kCell + 2), above = size_t(row / kCell) * columns;
  const double down = double(row % kCell) / kCell;
  const bool whole = panel_.subpixels == Subpixels::kWhole;
  detail::Sharing sharing{.guard = float(panel_.lines.guard), .parts = whole ? 1 : 3};
  const auto shifts = shifts_of(panel_.subpixels);
  for (size_t part = 0; part < 3; ++part) sharing.bits[part] = whole ? 0xffffffu : 0xffu << shifts[part];
  for (int x0 = 0; x0 < panel_.width; x0 += kCell) {
    const size_t at = above + size_t(x0 / kCell);
    for (size_t eye = 0; eye < 2; ++eye) {
      const double* u = lines_[eye].data();
      const double begin = u[at] + (u[at + columns] - u[at]) * down;
      const double end = u[at + 1] + (u[at + 1 + columns] - u[at + 1]) * down;
      // Only the fraction counts; half a line is added, so that cutting off finds the nearest line.
      sharing.eyes[eye] = {float(begin - std::floor(begin) + 0.5), float((end - begin) / kCell)};
    }
    detail::share_pixels(sharing, kCell, left + x0, right + x0);
  }
}

void Interleaver::masks(const Eyes& eyes, int row, std::vector<uint32_t>& left, std::vector<uint32_t>& right) {
  find_lines(eyes);
  left.resize(size_t(panel_.width) + kSpare);
  right.resize(size_t(panel_.width) + kSpare);
  share_out(row, left.data(), right.data());
  left.resize(size_t(panel_.width));
  right.resize(size_t(panel_.width));
}

void Interleaver::prepare_stretch(int width) {
  if (stretched_width_ == width) return;
  stretched_width_ = width;
  column_.resize(size_t(panel_.width));
  beside_.resize(size_t(panel_.width) + kSpare);
  for (int x = 0; x < panel_.width; ++x) {
    const auto place = place_among(x, panel_.width, width);
    column_[size_t(x)] = place[0];
    beside_[size_t(x)] = place[1];
  }
}

// Stretches one row of the picture to the panel's width.
void Interleaver::stretch(const image::View& from, int row, uint32_t* to) const {
  const auto [y, below] = place_among(row, panel_.height, from.height);
  const uint32_t* a = from.colour.data() + size_t(y) * size_t(from.width);
  if (from.width == panel_.width && from.height == panel_.height) {
    std::copy_n(a, from.width, to);
    return;
  }
  const uint32_t* b = y + 1 < uint32_t(from.height) ? a + from.width : a;
  thread_local std::vector<uint32_t> line, pairs, ends;
  line.resize(size_t(from.width) + kSpare);
  pairs.resize(2 * (size_t(panel_.width) + kSpare));
  // Whole vectors are read: the last pixels of a row come from a copy.
  const size_t sure = size_t(from.width) / kSpare * kSpare, rest = size_t(from.width) - sure;
  ends.resize(4 * kSpare);
  std::copy_n(a + sure, rest, ends.data());
  std::copy_n(b + sure, rest, ends.data() + 2 * kSpare);
  detail::mix(a, b, below, sure, line.data());
  detail::mix(ends.data(), ends.data() + 2 * kSpare, below, rest, line.data() + sure);
  line[size_t(from.width)] = line[size_t(from.width) - 1];
  const uint32_t *columns = column_.data(), *pixels = line.data();
  for (int x = 0; x < panel_.width; ++x) std::memcpy(pairs.data() + 2 * x, pixels + columns[x], 2 * sizeof(uint32_t));
  detail::mix_pairs(pairs.data(), beside_.data(), size_t(panel_.width), to);
}

void Interleaver::compose(const Eyes& eyes, const image::View& left, const image::View& right, image::View& out) {
  CHECK(left.width == right.width && left.height == right.height && left.width > 0 && left.height > 0);
  find_lines(eyes);
  prepare_stretch(left.width);
  const size_t width = size_t(panel_.width);
  out.width = panel_.width, out.height = panel_.height;
  out.colour.resize(width * size_t(panel_.height));
  out.depth_m.clear();
  in_parallel(tbb::blocked_range<int>(0, panel_.height, kRowsOfTask), [&](const tbb::blocked_range<int>& rows) {
    thread_local std::vector<uint32_t> buffer;
    const size_t room = width + kSpare;
    buffer.resize(4 * room);
    uint32_t *mask_l = buffer.data(), *mask_r = mask_l + room, *row_l = mask_r + room, *row_r = row_l + room;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      share_out(y, mask_l, mask_r);
      stretch(left, y, row_l);
      stretch(right, y, row_r);
      uint32_t* to = out.colour.data() + size_t(y) * width;
      for (size_t x = 0; x < width; ++x) to[x] = 0xff000000u | (row_l[x] & mask_l[x]) | (row_r[x] & mask_r[x]);
    }
  });
}

double visible_share(const Panel& panel, const glm::dvec3& eye, int x, int y, int subpixel) {
  const double half_m = 0.5 * panel.pixel_m / (panel.subpixels == Subpixels::kWhole ? 1 : 3);
  const double half_opening = 0.5 * panel.lines.opening;
  const glm::dvec2 middle = place_of(panel, x, y, subpixel);
  const auto line = [&](double aside_m) {
    return line_at(panel.lines, through(panel.lines, eye, middle + glm::dvec2(aside_m, 0)));
  };
  const double from = line(-half_m), to = line(half_m);
  return (opened(to, half_opening) - opened(from, half_opening)) / (to - from);
}

image::View seen_by(const Panel& panel, const glm::dvec3& eye, const image::View& picture) {
  CHECK(picture.width == panel.width && picture.height == panel.height);
  image::View out{picture.width, picture.height, std::vector<uint32_t>(picture.colour.size()), {}};
  const auto shifts = shifts_of(panel.subpixels);
  const int reach = std::max(1, int(std::ceil(panel.lines.pitch_m / panel.pixel_m)));
  const auto width = size_t(panel.width);
  in_parallel(0, panel.height, [&](int y) {
    // Running sums of each channel, from the row's beginning.
    std::vector<double> light(width + 1), visible(width + 1);
    const uint32_t* row = picture.colour.data() + size_t(y) * width;
    uint32_t* to = out.colour.data() + size_t(y) * width;
    std::fill_n(to, width, 0xff000000u);
    for (int s = 0; s < 3; ++s) {
      const int shift = shifts[size_t(s)];
      for (size_t x = 0; x < width; ++x) {
        const double share = visible_share(panel, eye, int(x), y, s);
        light[x + 1] = light[x] + share * (row[x] >> shift & 255);
        visible[x + 1] = visible[x] + share;
      }
      for (int x = 0; x < panel.width; ++x) {
        const auto from = size_t(std::max(0, x - reach)), end = size_t(std::min(panel.width, x + reach + 1));
        const double sum = visible[end] - visible[from];
        if (sum > 0) to[x] |= uint32_t(std::lround((light[end] - light[from]) / sum)) << shift;
      }
    }
  });
  return out;
}

SeenShares seen_shares(const Panel& panel, const Eyes& eyes) {
  Interleaver interleaver(panel);
  const auto shifts = shifts_of(panel.subpixels);
  std::vector<uint32_t> of_left, of_right;
  double seen = 0, wrong = 0;
  uint64_t dark = 0, all = 0;
  const int middle = panel.height / 2, first = std::max(0, middle - 4), end = std::min(panel.height, middle + 4);
  for (int y = first; y < end; ++y) {
    interleaver.masks(eyes, y, of_left, of_right);
    for (int x = 0; x < panel.width; ++x)
      for (int s = 0; s < 3; ++s) {
        const bool left = of_left[size_t(x)] >> shifts[size_t(s)] & 1,
                   right = of_right[size_t(x)] >> shifts[size_t(s)] & 1;
        dark += !left && !right;
        ++all;
        const double by_left = left || right ? visible_share(panel, eyes[0], x, y, s) : 0;
        const double by_right = left || right ? visible_share(panel, eyes[1], x, y, s) : 0;
        seen += by_left + by_right;
        wrong += left ? by_right : by_left;
      }
  }
  return {seen > 0 ? wrong / seen : 0, all > 0 ? double(dark) / double(all) : 0};
}

}  // namespace telesplat::stereo
