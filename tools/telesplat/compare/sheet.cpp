#include "tools/telesplat/compare/sheet.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::launcher {
namespace {

constexpr uint32_t kFrame = 0xffd23f;
constexpr int kZoom = 4, kPoseWidth = 480, kColumnWidth = 280;

// Side of the square to look at closer: as high as the small pictures once magnified.
int square_side(const image::View& reference, int width) {
  return std::max(8, small_picture(reference, width).height / kZoom);
}

image::View small_with_frame(const image::View& v, int width, const geometry::Rect& square) {
  const image::View small = small_picture(v, width);
  image::Canvas canvas(small.width, small.height, 0);
  canvas.place(small, 0, 0);
  const double scale = double(small.width) / v.width;
  canvas.outline({int(square.x * scale), int(square.y * scale), std::max(3, int(square.width * scale)),
                  std::max(3, int(square.height * scale))},
                 kFrame);
  return canvas.view();
}

image::View errors_of(const Cell& cell) {
  return image::picture_of_errors(cell.flip_map, cell.view.width, cell.view.height);
}

std::string label_of(const Cell& c) {
  return fmt::format("{} {}  PSNR {:.2f} dB  SSIM {:.4f}  FLIP {:.4f}  holes {:.2f} %  {:.2f} ms",
                     splat::kernel_name(c.kernel), c.renderer, c.quality.psnr_db, c.quality.ssim, c.flip,
                     100 * c.quality.hole_fraction, c.times.frame_ms);
}

}  // namespace

image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions) {
  const int side = square_side(reference, kPoseWidth);
  std::vector<SheetRow> rows{{"reference", {{{small_picture(reference, kPoseWidth)}, {}}}}};
  for (const Cell& c : cells) {
    const auto square = image::worst_square(c.flip_map, reference.width, reference.height, side);
    SheetCell pictures{
        {small_with_frame(c.view, kPoseWidth, square), small_with_frame(errors_of(c), kPoseWidth, square),
         image::magnify(c.view, square, kZoom), image::magnify(reference, square, kZoom)},
        {}};
    rows.push_back({label_of(c), {std::move(pictures)}});
  }
  return contact_sheet(captions, rows);
}

std::vector<SheetCell> pose_column(const image::View& reference, const std::vector<Cell>& cells,
                                   const std::string& pose_name) {
  std::vector<float> sum(reference.colour.size());
  for (const Cell& c : cells)
    for (size_t i = 0; i < sum.size(); ++i) sum[i] += c.flip_map[i];
  const auto square = image::worst_square(sum, reference.width, reference.height, square_side(reference, kColumnWidth));
  std::vector<SheetCell> out;
  out.push_back(
      {{small_with_frame(reference, kColumnWidth, square), image::magnify(reference, square, kZoom)}, {pose_name}});
  for (const Cell& c : cells)
    out.push_back({{small_with_frame(c.view, kColumnWidth, square), image::magnify(c.view, square, kZoom),
                    small_with_frame(errors_of(c), kColumnWidth, square)},
                   {fmt::format("{:.2f} dB  FLIP {:.4f}  holes {:.2f} %", c.quality.psnr_db, c.flip,
                                100 * c.quality.hole_fraction)}});
  return out;
}

}  // namespace telesplat::launcher
