// The array that a VTK file itself marks for colouring: its active scalars.
#pragma once

#include <string>
#include <string_view>

namespace telesplat::data {

/// Name of the active scalars of a VTP, VTU or legacy VTK file: of its points, else of its cells. Read from the file's
/// words alone, not its arrays. Empty: it marks none, or what it marks are colours.
std::string active_array(std::string_view text);
/// The same of the file at `path`; empty also where it cannot be read or is of another format.
std::string active_array_of(const std::string& path);

}  // namespace telesplat::data
