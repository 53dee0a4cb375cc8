// DICOM: what a file says of its slices, where the slices of a series lie, a series as one volume.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
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

/// A layer of a volume: a slice, or a mixture of two neighbours.
struct DicomLayer {
  size_t below = 0, above = 0;  ///< places in DicomOrder::slices
  double share = 0;             ///< of the one above; 0: the one below alone
};

struct DicomOrder {
  std::vector<DicomSlice> slices;              ///< those that are used
  std::vector<std::vector<DicomLayer>> steps;  ///< time steps of equally many layers, along the slices' normal
  glm::dvec3 origin{0}, step{0};               ///< mm: of layer 0, and from one to the next
  std::string remark;                          ///< for people: what was left out, mixed or evened; often empty
};

/// Adds a part to a remark.
inline void say(std::string& remark, const std::string& more) { remark += (remark.empty() ? "" : "; ") + more; }

/// Orders the slices of one series (at least one). Takes those that have the commonest size, spacing and orientation;
/// localizers only if there is nothing else. Leaves out copies: the same SOP Instance UID and frame, or a place
/// where same_pixels() finds no difference. Slices at one place become time steps if all places have equally many. A
/// layer that is missing is mixed from its neighbours by their distance; slices at uneven distances are resampled.
/// Slices without positions go by number.
DicomOrder order_slices(std::vector<DicomSlice> slices,
                        const std::function<bool(const DicomSlice&, const DicomSlice&)>& same_pixels);

/// One of the series in a folder, for people to choose from.
struct DicomSeriesName {
  std::string uid, text, modality;
  size_t slices = 0;
  int columns = 0, rows = 0;
};

struct DicomSeries {
  VolumeFileHeader header;  ///< of each step; checked; patient space (left, posterior, superior), mm
  DicomOrder order;         ///< its remark tells all that was left out or evened, for people
  /// All series of the folder, by Series Number, then by UID; and which of them this is.
  std::vector<DicomSeriesName> all;
  size_t taken = 0;
  /// The files of its slices, by name.
  std::vector<std::string> files() const;
};

/// "2: AXIAL T1, MR, 40 slices of 512 x 512": its place in the folder, from 1, and what it is.
std::string text_of(const DicomSeriesName& series, size_t place);

/// Whether a folder holds DICOM slices: in itself, or below where it holds none.
bool holds_dicom(const std::string& folder);

/// A series among the DICOM files of a folder; of the folders below, too, if it has a DICOMDIR or no slices of its own
/// (100,000 files, 8 folders deep). `path`: the folder, its DICOMDIR, or one of its slices, whose series it is then.
/// `which`: its place in the list, from 1, or its UID; empty: the one of most slices. Error: no slices, no such series;
/// values that are not 8 to 64 bits wide; rescaling by 0. Files that are cut or damaged are left out with a remark.
Result<std::shared_ptr<const DicomSeries>> find_dicom_series(const std::string& path, const std::string& which = "");

/// How a slice's values are stored, before any are cleared of what lies beside their bits.
StoredType stored_type(const DicomSlice& slice);
/// Whether low values are bright, and have no scale to keep: they are turned round.
bool is_inverted(const DicomSlice& slice);

}  // namespace telesplat::data
