#include "services/data/volume/formats/header.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "common/volume/grid.h"
#include "services/data/volume/formats/dicom_header.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

constexpr uint64_t kBestPacking = 1032;  // of deflate, to 1

std::string extension_of(const std::string& path) { return lower(std::filesystem::path(path).extension().string()); }

std::string claim_of(const VolumeFileHeader& h) {
  return fmt::format("{} x {} x {} voxels of {} ({} bytes)", h.size[0], h.size[1], h.size[2], name_of(h.stored),
                     h.voxel_bytes());
}

// As much as fits of what a gzip stream's beginning holds.
std::string unpack_start(std::string_view packed) {
  std::string out(kHeaderBytes, '\0');
  z_stream stream{};
  if (inflateInit2(&stream, 15 + 32) != Z_OK) return {};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  inflate(&stream, Z_SYNC_FLUSH);  // what it returns does not matter: what it gave is what there is
  out.resize(out.size() - stream.avail_out);
  inflateEnd(&stream);
  return out;
}

bool is_nifti(std::string_view start) {
  if (start.size() < 348) return false;
  const std::string_view one = start.substr(344, 4), two = start.substr(4, 4);
  using namespace std::string_view_literals;
  return one == "n+1\0"sv || one == "ni1\0"sv || two == "n+2\0"sv || two == "ni2\0"sv;
}

}  // namespace

Status check_header(const VolumeFileHeader& h, uint64_t data_bytes, const std::string& path) {
  for (const int64_t n : h.size)
    if (n < 1 || n > volume::kMaxSide)
      return Error{fmt::format("{}: claims {} x {} x {} voxels; limits are 1 and {} on each axis", path, h.size[0],
                               h.size[1], h.size[2], volume::kMaxSide)};
  const volume::Grid grid{{int(h.size[0]), int(h.size[1]), int(h.size[2])}, h.index_to_data};
  if (auto status = volume::validate(grid); !status) return Error{path + ": " + status.error().text};
  if (!std::isfinite(h.scale) || !std::isfinite(h.offset) || h.scale == 0)
    return Error{fmt::format("{}: its values are scaled by {} and shifted by {}", path, h.scale, h.offset)};
  const std::string where = h.data_path == path || h.data_path.empty() ? "the file" : h.data_path;
  if (!h.data_at_end && h.data_at >= data_bytes)
    return Error{fmt::format("{}: claims {} from byte {} on, but {} has {} bytes", path, claim_of(h), h.data_at, where,
                             data_bytes)};
  const uint64_t there = data_bytes - (h.data_at_end ? 0 : h.data_at);
  const uint64_t needed = h.voxel_bytes() / h.parts() + h.skip_unpacked;
  const bool fits = h.encoding == Encoding::kRaw    ? needed <= there
                    : h.encoding == Encoding::kGzip ? needed / kBestPacking <= there
                                                    : 2 * (h.voxels() / h.parts()) - 1 <= there;
  if (!fits)
    return Error{fmt::format("{}: claims {}, but {} has {} bytes{}", path, claim_of(h), where, there,
                             h.encoding == Encoding::kGzip   ? " of compressed ones"
                             : h.encoding == Encoding::kText ? " of text"
                                                             : " for them")};
  if (h.format == "raw" && needed != there)
    return Error{fmt::format("{}: has {} bytes; --raw says {}", path, there, claim_of(h))};
  return ok_status();
}

Result<FileStart> read_start(const std::string& path) {
  const int descriptor = open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
  if (descriptor < 0) return Error{fmt::format("{}: cannot be opened: {}", path, std::strerror(errno))};
  struct stat status {};
  FileStart out;
  const auto problem = [&]() -> std::string {
    if (fstat(descriptor, &status) != 0) return std::strerror(errno);
    if (S_ISDIR(status.st_mode)) return "is a directory, not a volume file";
    if (!S_ISREG(status.st_mode)) return "is not a regular file";
    if (status.st_size <= 0) return "is empty (0 bytes)";
    out.file_bytes = static_cast<uint64_t>(status.st_size);
    out.bytes.resize(std::min<uint64_t>(out.file_bytes, kHeaderBytes));
    const ssize_t n = pread(descriptor, out.bytes.data(), out.bytes.size(), 0);
    if (n < 0) return fmt::format("cannot be read: {}", std::strerror(errno));
    out.bytes.resize(static_cast<size_t>(n));
    return "";
  }();
  close(descriptor);
  if (!problem.empty()) return Error{fmt::format("{}: {}", path, problem)};
  if (out.bytes.starts_with("\x1f\x8b")) out.packed = true, out.bytes = unpack_start(out.bytes);
  return out;
}

std::string volume_format(const FileStart& start, const std::string& path) {
  const std::string_view content = start.bytes;
  if (is_nifti(content)) return "nifti";
  const std::string extension = extension_of(path);
  const std::string lower_path = lower(path);
  if (extension == ".nii" || lower_path.ends_with(".nii.gz")) return "nifti";
  if (!start.packed) {
    if (content.starts_with("NRRD000")) return "nrrd";
    if (is_dicom(content)) return "dicom";
    if (const std::string kind = vtk::kind_of(content); !kind.empty())
      return !vtk::is_image(content) ? "" : kind == "vtk" ? "vtk" : "vti";
    if (content.starts_with("ObjectType") && content.substr(0, 100).find("Image") != content.npos) return "metaimage";
  }
  if (extension == ".nrrd" || extension == ".nhdr") return "nrrd";
  if (extension == ".mha" || extension == ".mhd") return "metaimage";
  if (extension == ".vti" || extension == ".pvti") return "vti";
  if (extension == ".dcm") return "dicom";
  return "";
}

Result<VolumeFileHeader> read_volume_header(const std::string& path, const std::string& raw, const std::string& array) {
  const auto start = read_start(path);
  if (!start) return start.error();
  uint64_t data_bytes = start->file_bytes;
  const auto header = [&]() -> Result<VolumeFileHeader> {
    if (!raw.empty()) return parse_raw_spec(raw, path);
    const std::string format = volume_format(*start, path);
    if (format == "nrrd") return parse_nrrd(start->bytes, path);
    if (format == "metaimage") return parse_metaimage(start->bytes, path);
    if (format == "nifti") return parse_nifti(start->bytes, path);
    if (format == "vti" || format == "vtk") return parse_vtk_image(path, array, data_bytes);
    if (format == "dicom") return Error{path + ": is a DICOM file, whose voxels may lie in others, too"};
    return Error{
        path +
        ": is no volume; supported are NRRD, MetaImage, NIfTI, VTK's images (VTI, PVTI, VTK), folders of DICOM slices, "
        "and raw files with --raw"};
  }();
  if (!header) return header;
  VolumeFileHeader h = *header;
  const bool detached = h.data_path != path;
  if (detached) data_bytes = ~uint64_t{0};  // of the smallest file
  for (size_t i = 0; detached && i < h.parts(); ++i) {
    const std::string& part = i == 0 ? h.data_path : h.more_paths[i - 1];
    std::error_code error;
    if (!std::filesystem::is_regular_file(part, error))
      return Error{fmt::format("{}: its data file is missing: {}", path, part)};
    const uint64_t bytes = std::filesystem::file_size(part, error);
    if (error) return Error{fmt::format("{}: {}: {}", path, part, error.message())};
    data_bytes = std::min(data_bytes, bytes);
  }
  if (h.format == "nifti" && (start->packed || lower(h.data_path).ends_with(".gz"))) {
    h.encoding = Encoding::kGzip;  // all of the file is packed, header included
    h.skip_unpacked = h.data_at;
    h.data_at = 0;
  }
  if (auto status = check_header(h, data_bytes, path); !status) {
    const std::string own = raw.empty() ? "" : volume_format(*start, path);
    if (own.empty()) return status.error();
    return Error{
        fmt::format("{}; it is a {} file, which tells its layout itself: leave out --raw", status.error().text, own)};
  }
  return h;
}

}  // namespace telesplat::data
