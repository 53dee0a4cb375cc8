// What a volume file's header says, before a voxel is read: one parser a format. Headers are checked here, so that
// nothing is allocated by what a file merely claims.
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
  std::string unit;                           ///< of that placement's lengths: "mm", "m", ...; empty: not said
  scene::Space space = scene::Space::kPlain;  ///< of its axes
  StoredType stored = StoredType::kU8;
  double scale = 1, offset = 0;
  bool ct = false;                  ///< the file says that it is a CT
  std::string array;                ///< the one that is read, of a file that names them
  std::vector<std::string> arrays;  ///< all that such a file has
  // Where the voxels are. kGzip: a gzip or zlib stream from data_at on.
  std::string data_path;  ///< a file; often the header's own
  /// Further files, where the voxels lie in several: each has as many of them, and begins as the first.
  std::vector<std::string> more_paths;
  uint32_t line_skip = 0;      ///< lines to leave out at a file's beginning, before data_at counts
  uint64_t data_at = 0;        ///< byte in that file
  bool data_at_end = false;    ///< instead: as many bytes as the voxels take, at the file's end
  uint64_t skip_unpacked = 0;  ///< bytes to leave out behind the decompression
  Encoding encoding = Encoding::kRaw;
  bool big_endian = false;

  uint64_t voxels() const { return uint64_t(size[0]) * uint64_t(size[1]) * uint64_t(size[2]); }
  uint64_t voxel_bytes() const { return voxels() * stored_bytes(stored); }
  size_t parts() const { return 1 + more_paths.size(); }
};

// Parsers of one format. `content`: the header's file from its beginning, at least its first kHeaderBytes or all of it.
// `path`: for errors, and to find detached data beside it. They check syntax and what we support; check_header() checks
// sizes. Nothing is allocated by a claim.

inline constexpr size_t kHeaderBytes = 1 << 18;
inline constexpr const char* kSupportedTypes =
    "supported are 8 to 64-bit integers and 32 and 64-bit floating point numbers, one a voxel";

/// NRRD 1..5, attached and detached: encodings raw, gzip, text; spacings or space directions; spaces with left-handed
/// axes are mirrored at x, so that what is shown is not; lists and patterns of files; axis mins and maxs. Error: other
/// encodings, more axes than three that are longer than one. Source: teem.sourceforge.net/nrrd/format.html.
Result<VolumeFileHeader> parse_nrrd(std::string_view content, const std::string& path);
/// MetaImage (.mha, .mhd): TransformMatrix, ElementSpacing, Offset; zlib; lists and patterns of files. Error: several
/// channels.
Result<VolumeFileHeader> parse_metaimage(std::string_view content, const std::string& path);
/// NIfTI 1 and 2, single files and .hdr/.img pairs, in either byte order. `content` is unpacked. The sform if there is
/// one, else the qform, else the spacing. Error: time steps, colours, Analyze files. Source:
/// nifti.nimh.nih.gov/pub/dist/src/niftilib/nifti1.h.
Result<VolumeFileHeader> parse_nifti(std::string_view content, const std::string& path);
/// VTK's images: XML ones, those in pieces (which must be beside it), and legacy structured points. array: which one is
/// read; empty: as vtk::read_image_header() chooses. data_bytes becomes the size of all its files.
Result<VolumeFileHeader> parse_vtk_image(const std::string& path, const std::string& array, uint64_t& data_bytes);
/// The voxels of a checked header that parse_vtk_image() gave.
Result<std::vector<std::byte>> read_vtk_image(const VolumeFileHeader& header, const std::string& path);

/// For help texts and errors.
inline constexpr const char* kRawTypes =
    "u8, i8, u16, i16, u32, i32, u64, i64, f32, f64, little-endian, or big-endian with be behind them (u16be)";
/// What --raw says, for the file at `path`: "WxHxD:TYPE[:SX,SY,SZ][:skip=BYTES]", TYPE one of kRawTypes.
Result<VolumeFileHeader> parse_raw_spec(std::string_view spec, const std::string& path);
/// What --raw could say of a file of so many bytes, likeliest first, at most three: what its name says
/// (tooth_103x94x161_uint16.raw), else cubes and stacks of square slices that are nearly cubes. Each has exactly that
/// many bytes.
std::vector<std::string> raw_guesses(const std::string& path, uint64_t bytes);

/// Refuses sizes outside [1, volume::kMaxSide] and beyond kMaxVoxels, placements that are no grid's, and claims that
/// data of `data_bytes` cannot hold (compressed: at 1032 to 1, deflate's best). For raw files, also data that is longer
/// than the claim.
Status check_header(const VolumeFileHeader& header, uint64_t data_bytes, const std::string& path);

/// The beginning of a file; of a gzipped one, of what it unpacks to.
struct FileStart {
  std::string bytes;  ///< at most kHeaderBytes
  bool packed = false;
  uint64_t file_bytes = 0;
};
/// Error: not a regular file, empty, not readable.
Result<FileStart> read_start(const std::string& path);

/// What kind of volume file this is: "nrrd", "metaimage", "nifti", "vti", "vtk", "dicom"; "" if none. By content first,
/// then by name.
std::string volume_format(const FileStart& start, const std::string& path);
/// Reads and checks the header of a volume file that is no DICOM slice (dicom.h). With `raw`: of a raw file that
/// is as it says. array: which one, of a file that has several; empty: the one that it marks, else its first. Error:
/// cannot be read, is no volume, has no such array; those of the parsers and of check_header.
Result<VolumeFileHeader> read_volume_header(const std::string& path, const std::string& raw,
                                            const std::string& array = {});

/// Reads the voxels that a checked header describes, as stored (type and byte order of the file; text: native order).
/// Memory grows with what the file gives, never by the claim. Error: ends too early, damaged streams; text that is no
/// numbers.
Result<std::vector<std::byte>> read_payload(const VolumeFileHeader& header, const std::string& path,
                                            const ReadProgress& progress);

/// Makes a volume of stored voxels: byte order, narrower types (u32, i32, u64, i64, f64 become f32 where that keeps
/// 1/4096 of their range; else an error), range, Hounsfield guess. `bytes`: header.voxel_bytes() of them.
Result<Volume> make_volume(const VolumeFileHeader& header, std::vector<std::byte> bytes, const std::string& path);

/// Refuses what this machine's free memory cannot hold.
Status check_memory(uint64_t bytes, const std::string& path);

}  // namespace telesplat::data
