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

constexpr size_t kSpare = 48;  // pixels that rows.h writes beyond a row, and a cell that ends there

// Where the n-th of `of` pixels lies among `among`: a whole pixel and 256ths of the way to the next one.
std::array<uint32_t, 2> place_among(int n, int of, int among) {
  const double at = std::clamp((n + 0.5) * among / of - 0.5, 0.0, double(among - 1));
  const double whole = std::floor(at);
  return {uint32_t(whole), uint32_t(std::lround((at - whole) * 256))};
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
      // Whole lines do not matter; half of one more, so that cutting off finds the nearest.
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

// A row of the panel.
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
  // Whole vectors are read: the last pixels of a picture come from a copy.
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

}  // namespace telesplat::stereo
