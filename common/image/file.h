// Image files: our own through libpng and OpenEXR, foreign ones through OpenImageIO.
#pragma once

#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::image {

/// A displayed frame. colour: 0x00RRGGBB row-major from the upper left; the upper byte is undefined, except where a
/// function states that it has the coverage (background.h); depth_m: metres along the view axis, +infinity for empty
/// pixels; empty if the frame has no depth.
struct View {
  int width = 0, height = 0;
  std::vector<uint32_t> colour;
  std::vector<float> depth_m;
};

enum class Alpha { kNone, kCoverage };  ///< coverage: in the upper byte of colours over black

/// 8-bit RGB or RGBA PNG. The file appears whole or not at all. Errors name the path.
Status write_png(const std::string& path, const View& view, Alpha alpha = Alpha::kNone);
/// R, G, B (and A; then premultiplied) as linearised half floats and Z as float (depth_m; +infinity: empty).
/// Precondition: view has depth.
Status write_exr(const std::string& path, const View& view, Alpha alpha = Alpha::kNone);
/// The same without alpha, with one normal a pixel in N.X, N.Y, N.Z, half floats.
Status write_exr(const std::string& path, const View& view, std::span<const glm::vec3> normals);
/// Reads a PNG or EXR file, by the ending of its name: colours over black; channel Z becomes depth_m. At most 16384
/// pixels a side.
Result<View> read_view(const std::string& path);
/// Reads a PNG, JPEG, WebP, TIFF, BMP, GIF, TGA, EXR, HDR or PNM picture of at most `most_pixels` from memory: its
/// colours without its alpha, which does not change them. name: for error texts; its ending gives the format if the
/// first bytes do not.
Result<View> read_picture(std::span<const std::byte> bytes, const std::string& name, uint64_t most_pixels);

}  // namespace telesplat::image
