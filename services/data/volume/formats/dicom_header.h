// What one DICOM file says of its slice.
#pragma once

#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "common/core/result.h"

namespace telesplat::data {

struct DicomSlice {
  std::string path;
  std::string series;        ///< Series Instance UID
  std::string series_text;   ///< Series Description; often empty
  double series_number = 0;  ///< Series Number
  std::string modality;      ///< "CT", "MR", ...
  double instance = 0;       ///< Instance Number
  int rows = 0, columns = 0, components = 1, frames = 1;
  int bits_allocated = 0, bits_stored = 0;
  bool is_signed = false, big_endian = false;
  double slope = 1, intercept = 0;
  std::optional<glm::dvec3> position;  ///< of the first pixel's centre, patient space (left, posterior, superior), mm
  glm::dvec3 along_row{1, 0, 0};       ///< direction in which the column index grows
  glm::dvec3 along_column{0, 1, 0};    ///< direction in which the row index grows
  glm::dvec2 spacing{1, 1};            ///< mm along a row, along a column
  double thickness = 0, slice_spacing = 0;  ///< mm; 0: not said
  uint64_t data_at = 0, data_bytes = 0;     ///< of the pixels; 0 bytes: a file without (a directory, a report)
};

/// Reads the elements up to the pixels. Explicit and implicit little-endian and explicit big-endian transfer syntaxes.
/// Error: no DICOM file, cut, compressed pixels, elements nested deeper than 16. Source: DICOM PS3.5 chapter 7, PS3.3
/// C.7.6.2.
Result<DicomSlice> parse_dicom(std::string_view content, const std::string& path);

}  // namespace telesplat::data
