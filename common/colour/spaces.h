// Inside common/colour: spaces in which ParaView interpolates colours.
#pragma once

#include <array>
#include <optional>
#include <string_view>

namespace telesplat::colour {

using Rgb = std::array<double, 3>;  ///< sRGB, 0 to 1

enum class Space { kRgb, kHsv, kHsvNoWrap, kLab, kDiverging, kStep };

/// ParaView's word for it; nothing if we know none of that name. "Lab/CIEDE2000" is taken as Lab.
std::optional<Space> space_of(std::string_view word);

/// The colour at t, 0 to 1, from a to b.
Rgb between(Space space, const Rgb& a, const Rgb& b, double t);

}  // namespace telesplat::colour
