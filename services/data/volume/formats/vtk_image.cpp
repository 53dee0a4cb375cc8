// VTK's images as volume files.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "services/data/base/mapped_file.h"
#include "services/data/volume/formats/header.h"
#include "services/data/vtk/image.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {

Result<VolumeFileHeader> parse_vtk_image(const std::string& path, const std::string& array, uint64_t& data_bytes) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  FolderCompanions companions(path);
  const auto image = vtk::read_image_header((*file)->text(), path, companions, array);
  if (!image) return image.error();
  VolumeFileHeader h;
  h.format = vtk::kind_of((*file)->text()) == "vtk" ? "vtk" : "vti";
  h.data_path = path;
  for (const std::string& named : vtk::named_files((*file)->text(), path, companions))
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
