// ParaView's colour maps as it exports them (vtkPVTransferFunction presets): a list of maps, each with "RGBPoints"
// (value, r, g, b for each point) and, sometimes, "Points" (value, opacity, midpoint, sharpness for each point).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/colour/colour_map.h"

namespace telesplat::colour {

inline constexpr double kMaxMapValue = 1e30;

/// One map of a file, in its own values.
struct ParaviewMap {
  struct Colour {
    double value, r, g, b;  ///< r, g, b: 0 to 1; linear between points, for any ColorSpace of the file
  };
  struct Opacity {
    double value, opacity, midpoint, sharpness;  ///< as in vtkPiecewiseFunction; midpoint within (0, 1)
  };
  std::string name;              ///< empty if it has none
  std::vector<Colour> colours;   ///< at least one, values ascending
  std::vector<Opacity> opacity;  ///< values ascending; empty if it has none
  std::optional<uint32_t> missing;
};

/// The file's content; at most 4 MiB. Errors name the path.
Result<std::string> read_map_file(const std::string& path);
/// Reads the map `wanted` from a file's content, the first one if `wanted` is empty. Refuses texts that are no JSON or
/// nested too deeply, names that the file lacks (lists those it has), values or colours beyond their limits, maps of
/// categories, unknown colour spaces. Errors begin with `path`.
Result<ParaviewMap> parse_paraview_map(std::string_view content, const std::string& path, std::string_view wanted = {});
/// The same with values scaled to 0..1, and at most kMaxStops of its stops.
Result<ColourMap> parse_colour_map(std::string_view content, const std::string& path, std::string_view wanted = {});

}  // namespace telesplat::colour
