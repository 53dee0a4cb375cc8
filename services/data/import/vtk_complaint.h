// What VTK prints, for error texts.
#pragma once

#include <string>

namespace telesplat::data {

/// The first thing that VTK complained of in its output window, without its file names and addresses; empty if it did
/// not.
std::string first_complaint(const std::string& output);

}  // namespace telesplat::data
