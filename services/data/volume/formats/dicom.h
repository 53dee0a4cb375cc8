// DICOM: reads the slices of a file, orders the slices of a series, finds the series of a folder.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// Storage of a slice's values: Image Pixel module and rescaling (PS3.3 C.7.6.3, C.11.1).
struct DicomPixels {
  int rows = 0, columns = 0, components = 1;
  int bits_allocated = 0, bits_stored = 0;
  std::optional<int> high_bit;
  bool is_signed = false, is_float = false;
  std::optional<int> padding, padding_limit;  ///< Pixel Padding Value and Range Limit, as 16 bits without sign
  double slope = 1, intercept = 0;
  std::string photometric;  ///< "MONOCHROME2", "RGB", ...

  uint64_t bytes() const {
    return uint64_t(rows) * uint64_t(columns) * (uint64_t(components) * uint64_t(bits_allocated) / 8);
  }
  /// Before any values are cleared of what lies beside their bits.
  StoredType stored_type() const;
  /// Values of both mean the same.
  bool is_stored_as(const DicomPixels& other) const {
    return slope == other.slope && intercept == other.intercept && stored_type() == other.stored_type() &&
           bits_stored == other.bits_stored;
  }
};

/// Where a slice lies: Image Plane module (PS3.3 C.7.6.2).
struct DicomPlane {
  std::optional<glm::dvec3> position;  ///< centre of the first pixel, patient space (left, posterior, superior), mm
  glm::dvec3 along_row{1, 0, 0};       ///< direction in which the column index grows
  glm::dvec3 along_column{0, 1, 0};    ///< direction in which the row index grows
  glm::dvec2 spacing{1, 1};            ///< mm along a row, along a column
  double thickness = 0, slice_spacing = 0;  ///< mm; 0: not given
  bool stacked = false;                     ///< this frame's position is computed from the first one's and a spacing

  glm::dvec3 normal() const { return glm::cross(along_row, along_column); }
  /// Both have a position or none, and are turned and spaced alike.
  bool is_like(const DicomPlane& other) const {
    return position.has_value() == other.position.has_value() && glm::distance(along_row, other.along_row) <= 1e-3 &&
           glm::distance(along_column, other.along_column) <= 1e-3 &&
           glm::distance(spacing, other.spacing) <= 1e-3 * glm::length(other.spacing);
  }
};

/// Where in its file a slice's pixels are, and how they are packed.
struct DicomData {
  std::string syntax;          ///< Transfer Syntax UID; empty: not given
  uint64_t at = 0, bytes = 0;  ///< the pixels; 0 bytes: no pixels (a directory, a report)
  bool big_endian = false;
  bool compressed = false;  ///< pixels lie in fragments, and these are those of all frames
  bool deflated = false;    ///< `at` counts in inflate_dicom()
};

struct DicomSlice {
  std::string path;
  int frame = 0, frames = 1;  ///< number in the file, from 0
  std::string uid;            ///< SOP Instance UID; the same in all frames of a file
  std::string series;         ///< Series Instance UID
  std::string series_text;    ///< Series Description; often empty
  double series_number = 0;   ///< Series Number
  std::string modality;       ///< "CT", "MR", ...
  std::string image_type;     ///< "ORIGINAL\PRIMARY\LOCALIZER"
  double instance = 0;        ///< Instance Number
  /// Values that distinguish slices at one place, see kDicomTimes; 0: not given.
  std::array<double, 6> times{};
  DicomPixels pixels;
  DicomPlane plane;
  DicomData data;
};

/// Names of the values in DicomSlice::times; time steps are ordered by the first that differs.
inline constexpr std::array<const char*, 6> kDicomTimes{"temporal position", "trigger time",    "acquisition", "echo",
                                                        "b-value",           "acquisition time"};

/// True if the first bytes are DICOM's: DICM at byte 128, or elements without a preamble.
bool is_dicom(std::string_view content);

/// Reads the elements up to the pixels, and returns a slice for each frame, with its own position, orientation, spacing
/// and rescaling if the functional groups of an enhanced file give them. Reads all transfer syntaxes, but no pixels.
/// Error: not DICOM, cut off, elements nested deeper than 16, more than 65,536 frames. Source: DICOM PS3.5 chapter 7,
/// PS3.3 C.7.6.2, C.7.6.16.
Result<std::vector<DicomSlice>> parse_dicom(std::string_view content, const std::string& path);

/// Unpacks the elements of a deflated file (transfer syntax 1.2.840.10008.1.2.1.99). Error: damaged; more than 2 GB.
Result<std::string> inflate_dicom(std::string_view content, const std::string& path);

/// A layer of a volume: a slice, or a mixture of two neighbours.
struct DicomLayer {
  size_t below = 0, above = 0;  ///< indices into DicomOrder::slices
  double share = 0;             ///< weight of `above`; 0: `below` alone
};

struct DicomOrder {
  std::vector<DicomSlice> slices;              ///< the used slices
  std::vector<std::vector<DicomLayer>> steps;  ///< time steps with equally many layers, along the slices' normal
  glm::dvec3 origin{0}, step{0};               ///< position of layer 0, and offset from one layer to the next, mm
  std::string remark;                          ///< for users: slices left out, mixed or adjusted; often empty
};

/// Adds a part to a remark.
inline void say(std::string& remark, const std::string& more) { remark += (remark.empty() ? "" : "; ") + more; }

/// Orders the slices of one series (at least one). Takes the slices of the most frequent size, spacing and orientation;
/// localizers only if there are no others. Leaves out copies: the same SOP Instance UID and frame, or a place where
/// same_pixels() finds no difference. Slices at one place become time steps if all places have equally many. A missing
/// layer is mixed from its neighbours by distance; slices at uneven distances are resampled. Slices without positions
/// are ordered by number.
DicomOrder order_slices(std::vector<DicomSlice> slices,
                        const std::function<bool(const DicomSlice&, const DicomSlice&)>& same_pixels);

/// One of the series in a folder, for the user's choice.
struct DicomSeriesName {
  std::string uid, text, modality;
  size_t slices = 0;
  int columns = 0, rows = 0;
};

struct DicomSeries {
  VolumeFileHeader header;  ///< for each step; checked; patient space (left, posterior, superior), mm
  DicomOrder order;         ///< its remark names all slices left out or adjusted, for users
  /// All series of the folder, by Series Number, then by UID; and the index of this one.
  std::vector<DicomSeriesName> all;
  size_t taken = 0;
  /// Returns the files of its slices, by name.
  std::vector<std::string> files() const;
};

/// Returns "2: AXIAL T1, MR, 40 slices of 512 x 512": its place in the folder, from 1, and its description.
std::string text_of(const DicomSeriesName& series, size_t place);

/// True if a folder holds DICOM slices, or if it has none and a folder below holds some.
bool holds_dicom(const std::string& folder);

/// Finds a series among the DICOM files of a folder; also in folders below, if it has a DICOMDIR or no slices of its
/// own (100,000 files, 8 folders deep). `path`: the folder, its DICOMDIR, or one of its slices, which selects its
/// series. `which`: its place in the list, from 1, or its UID; empty: the series with most slices. Error: no slices, no
/// such series; values that are not 8 to 64 bits wide; rescaling by 0. Damaged files are left out with a remark.
Result<std::shared_ptr<const DicomSeries>> find_dicom_series(const std::string& path, const std::string& which = "");

/// True if low values are bright, and have no unit: they are then inverted.
bool is_inverted(const DicomSlice& slice);

}  // namespace telesplat::data
