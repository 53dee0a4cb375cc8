// Sheets of small pictures with texts.
#pragma once

#include <string>
#include <vector>

#include "common/image/canvas.h"

namespace telesplat::launcher {

struct SheetCell {
  std::vector<image::View> pictures;  ///< side by side
  std::vector<std::string> texts;     ///< lines below them
};
struct SheetRow {
  std::string label;  ///< above its cells; empty: none
  std::vector<SheetCell> cells;
};

/// Puts captions on top, then the rows. Cells of a column stand below each other.
image::View contact_sheet(const std::vector<std::string>& captions, const std::vector<SheetRow>& rows);

/// Shrinks a picture to `width`, in its proportions; never enlarges it.
image::View small_picture(const image::View& picture, int width);

}  // namespace telesplat::launcher
