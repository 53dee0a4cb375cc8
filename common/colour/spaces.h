// Colour spaces in which ParaView interpolates. Private to common/colour.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace telesplat::colour {

using Rgb = std::array<double, 3>;  ///< sRGB, 0 to 1

enum class Space { kRgb, kHsv, kHsvNoWrap, kLab, kDiverging, kStep };

/// Finds the space that ParaView calls `word`; nothing if it is unknown. "Lab/CIEDE2000" counts as Lab.
std::optional<Space> space_of(std::string_view word);

/// The colour at t, 0 to 1, from a to b.
Rgb between(Space space, const Rgb& a, const Rgb& b, double t);

}  // namespace telesplat::colour
