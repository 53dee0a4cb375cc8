#include "services/data/volume/formats/header.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "common/volume/grid.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/refusal.h"
#include "services/data/volume/formats/dicom.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/inflater.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

constexpr uint64_t kBestPacking = 1032;  // deflate's best ratio, to 1

std::string extension_of(const std::string& path) { return lower(std::filesystem::path(path).extension().string()); }

std::string claim_of(const VolumeFileHeader& h) {
  return fmt::format("{} x {} x {} voxels of {} ({} bytes)", h.size[0], h.size[1], h.size[2], name_of(h.stored),
                     h.voxel_bytes());
}

// Unpacks the beginning of a gzip stream, up to kHeaderBytes.
std::string unpack_start(std::string_view packed) {
  std::string out(kHeaderBytes, '\0');
  size_t have = 0;
  or_error([&] {
    Inflater inflater(packed, "");
    while (const size_t n = inflater.read(out.data() + have, out.size() - have)) have += n;
  }).ok();  // an error leaves the bytes unpacked before it
  out.resize(have);
  return out;
}

bool is_nifti(std::string_view start) {
  if (start.size() < 348) return false;
  const std::string_view one = start.substr(344, 4), two = start.substr(4, 4);
  using namespace std::string_view_literals;
  return one == "n+1\0"sv || one == "ni1\0"sv || two == "n+2\0"sv || two == "ni2\0"sv;
}

void check(const VolumeFileHeader& h, uint64_t data_bytes, const std::string& path) {
  for (const int64_t n : h.size)
    if (n < 1 || n > volume::kMaxSide)
      refuse("{}: claims {} x {} x {} voxels; limits are 1 and {} on each axis", path, h.size[0], h.size[1], h.size[2],
             volume::kMaxSide);
  const volume::Grid grid{{int(h.size[0]), int(h.size[1]), int(h.size[2])}, h.index_to_data};
  if (const Status status = volume::validate(grid); !status) refuse("{}: {}", path, status.error().text);
  if (!std::isfinite(h.scale) || !std::isfinite(h.offset) || h.scale == 0)
    refuse("{}: its values are scaled by {} and shifted by {}", path, h.scale, h.offset);
  const std::string where = h.data_path == path || h.data_path.empty() ? "the file" : h.data_path;
  if (!h.data_at_end && h.data_at >= data_bytes)
    refuse("{}: claims {} from byte {} on, but {} has {} bytes", path, claim_of(h), h.data_at, where, data_bytes);
  const uint64_t there = data_bytes - (h.data_at_end ? 0 : h.data_at);
  const uint64_t needed = h.voxel_bytes() / h.parts() + h.skip_unpacked;
  const bool fits = h.encoding == Encoding::kRaw    ? needed <= there
                    : h.encoding == Encoding::kGzip ? needed / kBestPacking <= there
                                                    : 2 * (h.voxels() / h.parts()) - 1 <= there;
  if (!fits)
    refuse("{}: claims {}, but {} has {} bytes{}", path, claim_of(h), where, there,
           h.encoding == Encoding::kGzip   ? " of compressed ones"
           : h.encoding == Encoding::kText ? " of text"
                                           : " for them");
  if (h.format == "raw" && needed != there) refuse("{}: has {} bytes; --raw says {}", path, there, claim_of(h));
}

VolumeFileHeader parse(const FileStart& start, const std::string& path, const std::string& raw,
                       const std::string& array, uint64_t& data_bytes) {
  if (!raw.empty()) return need(parse_raw_spec(raw, path));
  const std::string format = volume_format(start, path);
  if (format == "nrrd") return need(parse_nrrd(start.bytes, path));
  if (format == "metaimage") return need(parse_metaimage(start.bytes, path));
  if (format == "nifti") return need(parse_nifti(start.bytes, path));
  if (format == "vti" || format == "vtk") return need(parse_vtk_image(path, array, data_bytes));
  if (format == "dicom") refuse("{}: is a DICOM file, whose voxels may lie in others, too", path);
  refuse(
      "{}: is no volume; supported are NRRD, MetaImage, NIfTI, VTK's images (VTI, PVTI, VTK), folders of DICOM slices, "
      "and raw files with --raw",
      path);
}

// Returns the size of the smallest file with detached voxels.
uint64_t smallest_part(const VolumeFileHeader& h, const std::string& path) {
  uint64_t out = ~uint64_t{0};
  for (size_t i = 0; i < h.parts(); ++i) {
    const std::string& part = i == 0 ? h.data_path : h.more_paths[i - 1];
    std::error_code error;
    if (!std::filesystem::is_regular_file(part, error)) refuse("{}: its data file is missing: {}", path, part);
    out = std::min<uint64_t>(out, std::filesystem::file_size(part, error));
    if (error) refuse("{}: {}: {}", path, part, error.message());
  }
  return out;
}

}  // namespace

Status check_header(const VolumeFileHeader& h, uint64_t data_bytes, const std::string& path) {
  return or_error([&] { check(h, data_bytes, path); });
}

Result<FileStart> read_start(const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const std::string_view content = (*file)->text();
  FileStart out{std::string(content.substr(0, kHeaderBytes)), false, content.size()};
  if (out.bytes.starts_with("\x1f\x8b")) out.packed = true, out.bytes = unpack_start(content);
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
  return or_error([&] {
    const FileStart start = need(read_start(path));
    uint64_t data_bytes = start.file_bytes;
    VolumeFileHeader h = parse(start, path, raw, array, data_bytes);
    if (h.data_path != path) data_bytes = smallest_part(h, path);
    if (h.format == "nifti" && (start.packed || lower(h.data_path).ends_with(".gz"))) {
      h.encoding = Encoding::kGzip;  // the whole file is packed, header included
      h.skip_unpacked = h.data_at;
      h.data_at = 0;
    }
    const Status fits = check_header(h, data_bytes, path);
    if (const std::string own = fits || raw.empty() ? "" : volume_format(start, path); !own.empty())
      refuse("{}; it is a {} file, which tells its layout itself: leave out --raw", fits.error().text, own);
    need(fits);
    return h;
  });
}

Result<VolumeFileHeader> parse_vtk_image(const std::string& path, const std::string& array, uint64_t& data_bytes) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  const std::string_view content = (*file)->text();
  FolderCompanions companions(path);
  const auto image = vtk::read_image_header(content, path, companions, array);
  if (!image) return image.error();
  VolumeFileHeader h;
  h.format = vtk::kind_of(content) == "vtk" ? "vtk" : "vti";
  h.data_path = path;
  for (const std::string& named : vtk::named_files(content, path, companions))
    h.more_paths.push_back((std::filesystem::path(path).parent_path() / named).string());
  h.array = image->array, h.arrays = image->arrays;
  h.stored = image->type;
  h.index_to_data = image->index_to_data;
  for (size_t a = 0; a < 3; ++a) {
    h.size[a] = std::max<int64_t>(image->extent[2 * a + 1] - image->extent[2 * a] + (image->of_cells ? 0 : 1), 1);
    h.index_to_data[3] += h.index_to_data[int(a)] * (double(image->extent[2 * a]) + (image->of_cells ? 0.5 : 0));
  }
  h.encoding = image->packed ? Encoding::kGzip : image->text ? Encoding::kText : Encoding::kRaw;
  data_bytes = image->bytes;
  return h;
}

Result<std::vector<std::byte>> read_vtk_image(const VolumeFileHeader& header, const std::string& path) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  FolderCompanions companions(path);
  const auto image = vtk::read_image_header((*file)->text(), path, companions, header.array);
  if (!image) return image.error();
  auto bytes = vtk::read_image(*image, (*file)->text(), path, companions);
  if (bytes && bytes->size() != header.voxel_bytes()) return Error{path + ": has changed while it was read"};
  return bytes;
}

}  // namespace telesplat::data
