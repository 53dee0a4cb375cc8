// Contact sheets of a comparison: what was drawn, where it errs, and a closer look at the worst of it, each with its
// figures.
#pragma once

#include "common/image/canvas.h"
#include "tools/telesplat/compare/measure.h"

namespace telesplat::launcher {

/// "ellipse cpu  PSNR 31.20 dB  SSIM 0.9431  FLIP 0.0412  holes 0.12 %  8.31 ms"
std::string cell_label(const Cell& cell);

/// One pose: the reference and `captions` on top, then a row for each cell with its picture, its FLIP map, the square
/// where it differs most (4 times as large), and the same square of the reference.
image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions);

/// What the sheet of a whole run keeps of a pose: small pictures of the reference and of each cell, with its error map,
/// and the square in which the cells together differ most from the reference.
struct PoseStrip {
  struct Picture {
    image::View small, square, errors;  ///< errors: its FLIP map, as small; none for the reference
    std::string label;                  ///< what is written below it
  };
  std::vector<Picture> pictures;  ///< the reference, then the cells in their order
};
PoseStrip make_strip(const image::View& reference, const std::vector<Cell>& cells, const std::string& pose_name);

/// The whole run: a row for the reference and for each cell of `row_labels`, a column for each strip.
/// Precondition: every strip holds row_labels.size() pictures.
image::View run_sheet(const std::vector<PoseStrip>& strips, const std::vector<std::string>& row_labels,
                      const std::vector<std::string>& captions);

}  // namespace telesplat::launcher
