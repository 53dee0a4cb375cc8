#include "common/stereo/autostereo/interleaver.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "common/core/check.h"

namespace telesplat::stereo {
namespace {

constexpr int kRowsAtOnce = 16;

// a where weight is 0, b where it is 256; channel by channel.
inline uint32_t between(uint32_t a, uint32_t b, uint32_t weight) {
  const uint32_t rest = 256 - weight;
  const uint32_t red_blue = ((a & 0xff00ff) * rest + (b & 0xff00ff) * weight + 0x800080) >> 8 & 0xff00ff;
  const uint32_t green = ((a >> 8 & 0xff) * rest + (b >> 8 & 0xff) * weight + 0x80) & 0xff00;
  return red_blue | green;
}

// Where the n-th of `of` pixels lies among `among`: a whole pixel and 256ths of the way to the next one.
std::array<uint32_t, 2> place_among(int n, int of, int among) {
  const double at = std::clamp((n + 0.5) * among / of - 0.5, 0.0, double(among - 1));
  const double whole = std::floor(at);
  return {uint32_t(whole), uint32_t(std::lround((at - whole) * 256))};
}

// Of a row of places: the line of the first, and how much of a line it is to the next. Above 0.5.
struct Lines {
  float first, step;
};

// How far the n-th is from the middle of a line, where lines are half of one too large.
inline float off(const Lines& lines, int n) {
  const float line = lines.first + lines.step * float(n);
  return std::abs(line - float(int(line)) - 0.5f);
}

// Gives `bits` of each pixel to the eye that is nearer to a line. Without branches, so that pixels are worked on side
// by side.
void add_part(const Lines& left_lines, const Lines& right_lines, float guard, uint32_t bits, int pixels,
              uint32_t* __restrict left, uint32_t* __restrict right) {
  for (int x = 0; x < pixels; ++x) {
    const float nearer_right = off(left_lines, x) - off(right_lines, x);
    const bool shown = std::abs(nearer_right) >= guard;
    left[x] |= shown && nearer_right <= 0 ? bits : 0;
    right[x] |= shown && nearer_right > 0 ? bits : 0;
  }
}

}  // namespace

// Light is refracted differently in each place, but very evenly: within a cell lines are straight to a few
// thousandths of a line.
void Interleaver::find_lines(const Eyes& eyes) {
  if (lines_known_ && eyes == eyes_) return;
  eyes_ = eyes;
  lines_known_ = true;
  const int columns = panel_.width / kCell + 2, rows = panel_.height / kCell + 2;
  for (size_t eye = 0; eye < 2; ++eye) {
    auto& lines = lines_[eye];
    lines.resize(size_t(columns) * size_t(rows));
    tbb::parallel_for(0, rows, [&](int row) {
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
  const int parts = whole ? 1 : 3;  // of a pixel
  const auto shifts = shifts_of(panel_.subpixels);
  for (int x0 = 0; x0 < panel_.width; x0 += kCell) {
    const size_t at = above + size_t(x0 / kCell);
    float first[2], step[2];
    for (size_t eye = 0; eye < 2; ++eye) {
      const double* u = lines_[eye].data();
      const double begin = u[at] + (u[at + columns] - u[at]) * down;
      const double end = u[at + 1] + (u[at + 1 + columns] - u[at + 1]) * down;
      // Whole lines do not matter; half of one more, so that cutting off finds the nearest.
      first[eye] = float(begin - std::floor(begin) + 0.5);
      step[eye] = float((end - begin) / kCell);
    }
    const int pixels = std::min(kCell, panel_.width - x0);
    std::fill_n(left + x0, pixels, 0);
    std::fill_n(right + x0, pixels, 0);
    for (int part = 0; part < parts; ++part) {
      const float share = float(part) / float(parts);
      const uint32_t bits = whole ? 0xffffff : 0xffu << shifts[size_t(part)];
      add_part({first[0] + share * step[0], step[0]}, {first[1] + share * step[1], step[1]}, float(panel_.lines.guard),
               bits, pixels, left + x0, right + x0);
    }
  }
}

void Interleaver::masks(const Eyes& eyes, int row, std::vector<uint32_t>& left, std::vector<uint32_t>& right) {
  find_lines(eyes);
  left.resize(size_t(panel_.width));
  right.resize(size_t(panel_.width));
  share_out(row, left.data(), right.data());
}

void Interleaver::prepare_stretch(int width) {
  if (stretched_width_ == width) return;
  stretched_width_ = width;
  column_.resize(size_t(panel_.width));
  beside_.resize(size_t(panel_.width));
  for (int x = 0; x < panel_.width; ++x) {
    const auto place = place_among(x, panel_.width, width);
    column_[size_t(x)] = place[0];
    beside_[size_t(x)] = place[1];
  }
}

// A row of the panel.
void Interleaver::stretch(const image::View& from, int row, uint32_t* to) const {
  const auto [y, below] = place_among(row, panel_.height, from.height);
  const uint32_t* a = from.colour.data() + size_t(y) * size_t(from.width);
  if (from.width == panel_.width && from.height == panel_.height) {
    std::copy_n(a, from.width, to);
    return;
  }
  const uint32_t* b = y + 1 < uint32_t(from.height) ? a + from.width : a;
  thread_local std::vector<uint32_t> line;
  line.resize(size_t(from.width) + 1);
  for (int x = 0; x < from.width; ++x) line[size_t(x)] = between(a[x], b[x], below);
  line.back() = line[size_t(from.width) - 1];
  const uint32_t *columns = column_.data(), *beside = beside_.data(), *pixels = line.data();
  for (int x = 0; x < panel_.width; ++x) to[x] = between(pixels[columns[x]], pixels[columns[x] + 1], beside[x]);
}

void Interleaver::compose(const Eyes& eyes, const image::View& left, const image::View& right, image::View& out) {
  CHECK(left.width == right.width && left.height == right.height && left.width > 0 && left.height > 0);
  find_lines(eyes);
  prepare_stretch(left.width);
  const size_t width = size_t(panel_.width);
  out.width = panel_.width, out.height = panel_.height;
  out.colour.resize(width * size_t(panel_.height));
  out.depth_m.clear();
  tbb::parallel_for(tbb::blocked_range<int>(0, panel_.height, kRowsAtOnce), [&](const tbb::blocked_range<int>& rows) {
    thread_local std::vector<uint32_t> buffer;
    buffer.resize(4 * width);
    uint32_t *mask_l = buffer.data(), *mask_r = mask_l + width, *row_l = mask_r + width, *row_r = row_l + width;
    for (int y = rows.begin(); y < rows.end(); ++y) {
      share_out(y, mask_l, mask_r);
      stretch(left, y, row_l);
      stretch(right, y, row_r);
      uint32_t* to = out.colour.data() + size_t(y) * width;
      for (size_t x = 0; x < width; ++x) to[x] = 0xff000000u | (row_l[x] & mask_l[x]) | (row_r[x] & mask_r[x]);
    }
  });
}

}  // namespace telesplat::stereo
