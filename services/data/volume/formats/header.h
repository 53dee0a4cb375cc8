// Headers of volume files, read before any voxel: one parser per format. Headers are checked here, so that no memory is
// allocated by a file's mere claims.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/mat4x4.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/result.h"
#include "common/scene/placement.h"
#include "services/data/base/progress.h"
#include "services/data/base/stored_type.h"
#include "services/data/base/volume.h"

namespace telesplat::data {

enum class Encoding { kRaw, kGzip, kText };

struct VolumeFileHeader {
  std::string format;  ///< as Volume::format
  std::array<int64_t, 3> size{};
  glm::dmat4 index_to_data{1.0};
  std::string unit;                           ///< unit of that placement's lengths: "mm", "m", ...; empty: not given
  scene::Space space = scene::Space::kPlain;  ///< kind of its axes
  StoredType stored = StoredType::kU8;
  double scale = 1, offset = 0;
  bool ct = false;                  ///< the file says that it is a CT
  std::string array;                ///< the array that is read, if the file names arrays
  std::vector<std::string> arrays;  ///< all arrays of such a file
  // Location of the voxels. kGzip: a gzip or zlib stream from data_at on.
  std::string data_path;  ///< a file; often the header's own
  /// Further files with voxels, if there are several: all have equally many, and begin like the first.
  std::vector<std::string> more_paths;
  uint32_t line_skip = 0;      ///< lines to skip at a file's beginning; data_at counts from there
  uint64_t data_at = 0;        ///< offset in that file, bytes
  bool data_at_end = false;    ///< instead: the voxels are the file's last bytes
  uint64_t skip_unpacked = 0;  ///< bytes to skip after decompression
  Encoding encoding = Encoding::kRaw;
  bool big_endian = false;

  uint64_t voxels() const { return uint64_t(size[0]) * uint64_t(size[1]) * uint64_t(size[2]); }
  uint64_t voxel_bytes() const { return voxels() * stored_bytes(stored); }
  size_t parts() const { return 1 + more_paths.size(); }
};

// Parsers of one format. `content`: the header's file from its beginning, at least its first kHeaderBytes or all of it.
// `path`: for errors, and to find detached data beside it. They check syntax and supported features; check_header()
// checks sizes. No memory is allocated by a claim.

inline constexpr size_t kHeaderBytes = 1 << 18;
inline constexpr const char* kSupportedTypes =
    "supported are 8 to 64-bit integers and 32 and 64-bit floating point numbers, one a voxel";

/// Parses NRRD 1..5, attached and detached: encodings raw, gzip, text; spacings or space directions; spaces with
/// left-handed axes are mirrored at x, so that the picture is not; lists and patterns of files; axis mins and maxs.
/// Error: other encodings, more than three axes longer than one. Source: teem.sourceforge.net/nrrd/format.html.
Result<VolumeFileHeader> parse_nrrd(std::string_view content, const std::string& path);
/// Parses MetaImage (.mha, .mhd): TransformMatrix, ElementSpacing, Offset; zlib; lists and patterns of files. Error:
/// several channels.
Result<VolumeFileHeader> parse_metaimage(std::string_view content, const std::string& path);
/// Parses NIfTI 1 and 2, single files and .hdr/.img pairs, in either byte order. `content` is unpacked. Uses the sform
/// if present, else the qform, else the spacing. Error: time steps, colours, Analyze files. Source:
/// nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h.
Result<VolumeFileHeader> parse_nifti(std::string_view content, const std::string& path);
/// Reads VTK's images: XML ones, those in pieces (which must lie beside the file), and legacy structured points. array:
/// the wanted one; empty: chosen as in vtk::read_image_header(). data_bytes becomes the size of all its files.
Result<VolumeFileHeader> parse_vtk_image(const std::string& path, const std::string& array, uint64_t& data_bytes);
/// Reads the voxels of a checked header from parse_vtk_image().
Result<std::vector<std::byte>> read_vtk_image(const VolumeFileHeader& header, const std::string& path);

/// Types of --raw, for help texts and errors.
inline constexpr const char* kRawTypes =
    "u8, i8, u16, i16, u32, i32, u64, i64, f32, f64, little-endian, or big-endian with be behind them (u16be)";
/// Parses --raw for the file at `path`: "WxHxD:TYPE[:SX,SY,SZ][:skip=BYTES]", TYPE one of kRawTypes.
Result<VolumeFileHeader> parse_raw_spec(std::string_view spec, const std::string& path);
/// Returns possible --raw values for a file of `bytes` bytes, likeliest first, at most three: by its name
/// (tooth_103x94x161_uint16.raw), else cubes and stacks of square slices that are nearly cubes. Each fits the size
/// exactly.
std::vector<std::string> raw_guesses(const std::string& path, uint64_t bytes);

/// Refuses sizes outside [1, volume::kMaxSide] and beyond kMaxVoxels, placements that are not a grid's, and claims that
/// data of `data_bytes` cannot hold (compressed: at 1032 to 1, deflate's best). For raw files, also data longer than
/// the claim.
Status check_header(const VolumeFileHeader& header, uint64_t data_bytes, const std::string& path);

/// The beginning of a file; if gzipped, of its unpacked content.
struct FileStart {
  std::string bytes;  ///< at most kHeaderBytes
  bool packed = false;
  uint64_t file_bytes = 0;
};
/// Error: not a regular file, empty, not readable.
Result<FileStart> read_start(const std::string& path);

/// Returns the format of a volume file: "nrrd", "metaimage", "nifti", "vti", "vtk", "dicom"; "": another. By content
/// first, then by name.
std::string volume_format(const FileStart& start, const std::string& path);
/// Reads and checks the header of a volume file that is not a DICOM slice (dicom.h). With `raw`: reads no header, but
/// checks that the file fits `raw`. array: the wanted one of several; empty: the marked one, else the first. Error:
/// unreadable, not a volume, no such array; errors of the parsers and of check_header.
Result<VolumeFileHeader> read_volume_header(const std::string& path, const std::string& raw,
                                            const std::string& array = {});

/// Reads the voxels that a checked header describes, as stored (type and byte order of the file; text: native order).
/// Memory grows with the data, not by the claim. Error: data end too early, damaged streams, text that is not numbers.
Result<std::vector<std::byte>> read_payload(const VolumeFileHeader& header, const std::string& path,
                                            const ReadProgress& progress);

/// Makes a volume of stored voxels: native byte order; u32, i32, u64, i64, f64 become f32, scaled if f32 has too few
/// steps in their range; range; Hounsfield guess. `bytes`: header.voxel_bytes() bytes.
Result<Volume> make_volume(const VolumeFileHeader& header, std::vector<std::byte> bytes, const std::string& path);

/// Refuses data larger than this machine's free memory.
Status check_memory(uint64_t bytes, const std::string& path);

}  // namespace telesplat::data
