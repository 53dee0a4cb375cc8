// Contact sheets of a comparison: what was drawn, where it errs, and a closer look at the worst of it, each with its
// figures.
#pragma once

#include "tools/telesplat/compare/measure.h"
#include "tools/telesplat/movie/contact_sheet.h"

namespace telesplat::launcher {

/// One pose: the reference, then a row for each cell with its picture, its FLIP map, the square where it differs most,
/// 4 times as large, and the same square of the reference.
image::View pose_sheet(const image::View& reference, const std::vector<Cell>& cells,
                       const std::vector<std::string>& captions);

/// What the sheet of a whole run has of a pose, the reference and then the cells in their order: small pictures with
/// their error maps, and the square in which the cells together differ most from the reference.
std::vector<SheetCell> pose_column(const image::View& reference, const std::vector<Cell>& cells,
                                   const std::string& pose_name);

}  // namespace telesplat::launcher
