// What one DICOM file says of its slices: one of a file, or all frames of a multi-frame file.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"

namespace telesplat::data {

struct DicomSlice {
  std::string path;
  int frame = 0;             ///< of the file's, from 0
  std::string uid;           ///< SOP Instance UID; the same in all frames of a file
  std::string series;        ///< Series Instance UID
  std::string series_text;   ///< Series Description; often empty
  double series_number = 0;  ///< Series Number
  std::string modality;      ///< "CT", "MR", ...
  std::string image_type;    ///< "ORIGINAL\PRIMARY\LOCALIZER"
  std::string photometric;   ///< "MONOCHROME2", "RGB", ...
  std::string syntax;        ///< Transfer Syntax UID; empty: not said
  double instance = 0;       ///< Instance Number
  /// What tells slices at one place apart, see kDicomTimes; 0 where it is not said.
  std::array<double, 6> times{};
  int rows = 0, columns = 0, components = 1, frames = 1;
  int bits_allocated = 0, bits_stored = 0;
  std::optional<int> high_bit;
  bool is_signed = false, big_endian = false, is_float = false;
  bool compressed = false;  ///< pixels lie in fragments, and data_at and data_bytes are those of all frames
  bool deflated = false;    ///< data_at counts in inflate_dicom()
  bool stacked = false;     ///< this frame's position is made from the first one's and a spacing
  std::optional<int> padding, padding_limit;  ///< Pixel Padding Value and Range Limit, as 16 bits without sign
  double slope = 1, intercept = 0;
  std::optional<glm::dvec3> position;  ///< of the first pixel's centre, patient space (left, posterior, superior), mm
  glm::dvec3 along_row{1, 0, 0};       ///< direction in which the column index grows
  glm::dvec3 along_column{0, 1, 0};    ///< direction in which the row index grows
  glm::dvec2 spacing{1, 1};            ///< mm along a row, along a column
  double thickness = 0, slice_spacing = 0;  ///< mm; 0: not said
  uint64_t data_at = 0, data_bytes = 0;     ///< of the pixels; 0 bytes: a file without (a directory, a report)

  uint64_t pixel_bytes() const {
    return uint64_t(rows) * uint64_t(columns) * (uint64_t(components) * uint64_t(bits_allocated) / 8);
  }
};

/// What DicomSlice::times holds, in the order in which time steps go.
inline constexpr std::array<const char*, 6> kDicomTimes{"temporal position", "trigger time",    "acquisition", "echo",
                                                        "b-value",           "acquisition time"};

/// Whether content is DICOM's by its first bytes: with DICM at byte 128, or without a preamble.
bool is_dicom(std::string_view content);

/// Reads the elements up to the pixels, and makes a slice of each frame, with its own position, orientation, spacing
/// and rescaling where the functional groups of an enhanced file say them. Reads all transfer syntaxes; pixels are left
/// where they are. Error: no DICOM file, cut, elements nested deeper than 16, more than 65,536 frames. Source: DICOM
/// PS3.5 chapter 7, PS3.3 C.7.6.2, C.7.6.16.
Result<std::vector<DicomSlice>> parse_dicom(std::string_view content, const std::string& path);

/// The elements of a deflated file (transfer syntax 1.2.840.10008.1.2.1.99). Error: damaged; more than 2 GB.
Result<std::string> inflate_dicom(std::string_view content, const std::string& path);

}  // namespace telesplat::data
