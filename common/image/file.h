// Image files: our own through libpng and OpenEXR, those of others through OpenImageIO.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::image {

/// A displayed frame. colour: 0x00RRGGBB row-major from the upper left, with anything in the upper byte unless somebody
/// says that it has the coverage (background.h); depth_m: metres along the view axis, +infinity
/// where nothing is, empty if the frame has no depth.
struct View {
  int width = 0, height = 0;
  std::vector<uint32_t> colour;
  std::vector<float> depth_m;
};

enum class Alpha { kNone, kCoverage };  ///< coverage: in the upper byte of colours over black

/// 8-bit RGB or RGBA PNG. The file appears whole or not at all. Errors name the path.
Status write_png(const std::string& path, const View& view, Alpha alpha = Alpha::kNone);
/// R, G, B (and A; then premultiplied) as linearised half floats and Z as float (depth_m; +infinity = nothing).
/// Precondition: view has depth.
Status write_exr(const std::string& path, const View& view, Alpha alpha = Alpha::kNone);
/// The same without alpha, with the normals in N.X, N.Y, N.Z, half floats; one a pixel.
Status write_exr(const std::string& path, const View& view, std::span<const glm::vec3> normals);
/// Reads a PNG or EXR file, as the ending of its name says: colours over black; channel Z becomes depth_m. At most
/// 16384 pixels a side.
Result<View> read_view(const std::string& path);
/// Reads a PNG, JPEG, WebP, TIFF, BMP, GIF, TGA, EXR, HDR or PNM picture of at most `most_pixels` from memory: its
/// colours without its alpha, which changes nothing of them. name: for error texts; its ending says what it is, unless
/// its first bytes do.
Result<View> read_picture(std::span<const std::byte> bytes, const std::string& name, uint64_t most_pixels);

}  // namespace telesplat::image
