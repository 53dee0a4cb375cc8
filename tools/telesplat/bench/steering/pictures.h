// Pictures of `telesplat bench steering`: which rays were cast along a walk, and how still views converge.
#pragma once

#include <string>
#include <vector>

#include "common/image/measures/reference.h"
#include "common/image/pixel_mask.h"

namespace telesplat::launcher {

/// A scene's name as a part of a file name: letters, digits, dots and dashes.
std::string file_stem(const std::string& scene);

/// What was cast, over the view in grey: white: a ray that the model lacked; red: cast though the model had it; blue:
/// lacked, not cast. needed: empty if it is not known; then what was cast is white. Precondition: the masks have the
/// view's size.
image::View cast_picture(const image::View& truth, const image::PixelMask& cast, const image::PixelMask& needed);

/// Four pictures: direct rendering, what is displayed, how far they differ, what was cast.
Status write_plan_sheet(const std::string& path, const image::View& truth, const image::View& displayed,
                        const image::PixelMask& cast, const image::PixelMask& needed);

/// A row a mode: the whole view, where it differs from the reference, and the place where the first mode differs most,
/// enlarged; below them the reference. Precondition: equal sizes.
Status write_still_sheet(const std::string& path, const image::Reference& reference,
                         const std::vector<image::View>& views, const std::vector<std::string>& names);

}  // namespace telesplat::launcher
