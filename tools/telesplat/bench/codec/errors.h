// How far a decoded depth image is from the one that was encoded.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"
#include "common/image/file.h"

namespace telesplat::launcher {

struct ErrorFigure {
  double largest = 0, sum = 0;
  void add(double error) {
    largest = error > largest ? error : largest;
    sum += error;
  }
  void merge(const ErrorFigure& other) {
    largest = other.largest > largest ? other.largest : largest;
    sum += other.sum;
  }
  double mean(size_t count) const { return count > 0 ? sum / double(count) : 0; }
};

/// Over the pixels that both images cover.
struct CodecErrors {
  size_t pixels = 0;         ///< covered in both
  size_t uncovered = 0;      ///< covered in one of them alone
  ErrorFigure depth_px;      ///< |z' - z| over the size of a pixel at depth z, z / focal_px
  ErrorFigure normal_codes;  ///< the larger one of both coordinates (normal_distance)
  ErrorFigure normal_deg;    ///< the angle
  ErrorFigure colour_codes;  ///< the largest one of red, green and blue
  void merge(const CodecErrors& other) {
    pixels += other.pixels, uncovered += other.uncovered;
    depth_px.merge(other.depth_px), normal_codes.merge(other.normal_codes);
    normal_deg.merge(other.normal_deg), colour_codes.merge(other.colour_codes);
  }
  bool none() const {
    return uncovered == 0 && depth_px.largest == 0 && normal_codes.largest == 0 && colour_codes.largest == 0;
  }
};

/// focal_px: of the camera that saw it, Camera::focal_x(). Precondition: same size.
void add_errors(const image::DepthImage& original, const image::DepthImage& decoded, double focal_px, CodecErrors& to);

/// Error of a depth code as a part of a pixel's size at that depth: focal_px |c - c'| / c', because a code is the
/// depth's reciprocal. Precondition: codes are not 0.
double depth_error_px(uint32_t original, uint32_t decoded, double focal_px);
/// Steps of the 16-bit normal's coordinates from one code to the other, on the octahedron: its map's rim is a seam,
/// which is crossed where that is shorter, and two codes of one direction are 0 apart.
int normal_distance(uint16_t a, uint16_t b);
double normal_angle_deg(uint16_t a, uint16_t b);
int colour_distance(uint32_t a, uint32_t b);

/// Error maps beside each other, 8 times: depth (white is an eighth of a pixel and more), normals (in red codes, in
/// green degrees, each of which is 8 of 255), colours (channel by channel). A pixel that only one image covers is
/// magenta in the first. Precondition: same size.
image::View error_maps(const image::DepthImage& original, const image::DepthImage& decoded, double focal_px);
/// Pictures one below the other. Error: it would be larger than pictures may be.
Result<image::View> stacked(const std::vector<image::View>& pictures);

}  // namespace telesplat::launcher
