#include "tools/telesplat/compare/sheet.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::launcher {
namespace {

constexpr uint32_t kPaper = 0x101214, kInk = 0xe8e8e8, kFaint = 0x9aa4ae, kFrame = 0xffd23f;
constexpr int kGap = 8, kZoom = 4, kTextScale = 2, kLine = image::kGlyphHeight * kTextScale + 8;
constexpr int kPoseWidth = 480, kStripWidth = 280;

struct Size {
  int width, height;
};

// As large as the sheet has room for, in the picture's proportions, never enlarged.
Size small_size(const image::View& v, int width) {
  const int w = std::min(width, v.width);
  return {w, std::clamp(int(std::lround(double(w) * v.height / v.width)), 1, v.height)};
}

// Side of the square to look at closer: as high as the small pictures once magnified.
int square_side(const Size& small) { return std::max(8, small.height / kZoom); }

int widest(const std::vector<std::string>& lines) {
  int width = 0;
  for (const auto& l : lines) width = std::max(width, image::text_width(l, kTextScale));
  return width;
}

image::View small_with_frame(const image::View& v, const Size& size, const geometry::Rect& square) {
  image::Canvas canvas(size.width, size.height, kPaper);
  canvas.place(image::shrink(v, size.width, size.height), 0, 0);
  const double scale = double(size.width) / v.width;
  canvas.outline({int(square.x * scale), int(square.y * scale), std::max(3, int(square.width * scale)),
                  std::max(3, int(square.height * scale))},
                 kFrame);
  return canvas.view();
}

void magma_bar(image::Canvas& canvas, int x, int y, int width) {
  std::vector<float> bar(size_t(width) * kLine);
  for (size_t i = 0; i < bar.size(); ++i) bar[i] = float(i % width) / float(width - 1);
  canvas.place(image::picture_of_errors(bar, width, kLine), x, y);
}

}  // namespace

std::string cell_label(const Cell& c) {
  return fmt::format("{} {}  PSNR {:.2f} dB  SSIM {:.4f}  FLIP {:.4f}  holes {:.2f} %  {:.2f} ms",
                     splat::kernel_name(c.kernel), c.renderer, c.quality.psnr_db, c.quality.ssim, c.flip,
                     100 * c.quality.hole_fraction, c.times.frame_ms);
}

image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions) {
  const Size small = small_size(reference, kPoseWidth);
  const int side = square_side(small), zoomed = side * kZoom, row = std::max(small.height, zoomed) + kLine + kGap;
  std::vector<std::string> labels;
  for (const Cell& c : cells) labels.push_back(cell_label(c));
  const int text_x = small.width + 2 * kGap;
  const int head = std::max(small.height + kLine, int(captions.size() + 2) * kLine) + kGap;
  const int width =
      std::max({2 * small.width + 2 * zoomed + 5 * kGap, widest(labels) + 2 * kGap, widest(captions) + text_x + kGap});
  image::Canvas canvas(width, kGap + head + int(cells.size()) * row, kPaper);

  int y = kGap;
  canvas.text(kGap, y, "reference", kInk);
  canvas.place(image::shrink(reference, small.width, small.height), kGap, y + kLine);
  for (const auto& line : captions) {
    canvas.text(text_x, y, line, kFaint);
    y += kLine;
  }
  canvas.text(text_x, y + kLine / 2, "FLIP 0", kFaint);
  magma_bar(canvas, text_x + 84, y + kLine / 4, std::min(256, std::max(16, width - text_x - 120)));
  canvas.text(text_x + 84 + std::min(256, std::max(16, width - text_x - 120)) + kGap, y + kLine / 2, "1", kFaint);

  y = kGap + head;
  for (size_t i = 0; i < cells.size(); ++i, y += row) {
    const Cell& c = cells[i];
    const auto square = image::worst_square(c.flip_map, reference.width, reference.height, side);
    canvas.text(kGap, y, labels[i], kInk);
    int x = kGap;
    const auto place = [&](const image::View& picture) {
      canvas.place(picture, x, y + kLine);
      x += picture.width + kGap;
    };
    place(small_with_frame(c.view, small, square));
    place(small_with_frame(image::picture_of_errors(c.flip_map, reference.width, reference.height), small, square));
    place(image::magnify(c.view, square, kZoom));
    place(image::magnify(reference, square, kZoom));
  }
  return canvas.view();
}

PoseStrip make_strip(const image::View& reference, const std::vector<Cell>& cells, const std::string& pose_name) {
  const Size small = small_size(reference, kStripWidth);
  std::vector<float> sum(reference.colour.size());
  for (const Cell& c : cells)
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += c.flip_map[i];
  const auto square = image::worst_square(sum, reference.width, reference.height, square_side(small));
  PoseStrip out;
  out.pictures.push_back(
      {small_with_frame(reference, small, square), image::magnify(reference, square, kZoom), {}, pose_name});
  for (const Cell& c : cells) {
    const image::View errors = image::picture_of_errors(c.flip_map, reference.width, reference.height);
    out.pictures.push_back({small_with_frame(c.view, small, square), image::magnify(c.view, square, kZoom),
                            small_with_frame(errors, small, square),
                            fmt::format("{:.2f} dB  FLIP {:.4f}  holes {:.2f} %", c.quality.psnr_db, c.flip,
                                        100 * c.quality.hole_fraction)});
  }
  return out;
}

image::View run_sheet(const std::vector<PoseStrip>& strips, const std::vector<std::string>& row_labels,
                      const std::vector<std::string>& captions) {
  int height = kGap + int(captions.size()) * kLine + kGap, picture_height = 0;
  std::vector<int> column_x;
  int width = kGap;
  for (const PoseStrip& s : strips) {
    CHECK(s.pictures.size() == row_labels.size());
    column_x.push_back(width);
    int content = 0;
    for (const auto& p : s.pictures) {
      content = std::max({content, p.small.width + p.square.width + p.errors.width + 2 * kGap,
                          image::text_width(p.label, kTextScale)});
      picture_height = std::max({picture_height, p.small.height, p.square.height});
    }
    width += content + 3 * kGap;
  }
  const int row = 2 * kLine + picture_height + 2 * kGap;
  width = std::max({width, widest(captions) + 2 * kGap, widest(row_labels) + 2 * kGap});
  image::Canvas canvas(width, height + int(row_labels.size()) * row, kPaper);
  for (size_t i = 0; i < captions.size(); ++i) canvas.text(kGap, kGap + int(i) * kLine, captions[i], kFaint);
  for (size_t r = 0; r < row_labels.size(); ++r) {
    const int y = height + int(r) * row;
    canvas.text(kGap, y, row_labels[r], kInk);
    for (size_t s = 0; s < strips.size(); ++s) {
      const auto& p = strips[s].pictures[r];
      canvas.place(p.small, column_x[s], y + kLine);
      canvas.place(p.square, column_x[s] + p.small.width + kGap, y + kLine);
      canvas.place(p.errors, column_x[s] + p.small.width + p.square.width + 2 * kGap, y + kLine);
      canvas.text(column_x[s], y + kLine + picture_height + 4, p.label, kFaint);
    }
  }
  return canvas.view();
}

}  // namespace telesplat::launcher
