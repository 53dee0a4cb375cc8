// The parsers of all volume headers, of VTK's files and of TIFF directories: a header that passes the checks must
// describe a grid whose voxels the data can hold.
#include <cstdint>
#include <cstdlib>

#include "common/volume/grid.h"
#include "services/data/volume/formats/dicom.h"
#include "services/data/volume/formats/header.h"
#include "services/data/volume/formats/stack.h"
#include "services/data/vtk/reader.h"

namespace telesplat::data {
namespace {

void use(const Result<VolumeFileHeader>& header, uint64_t data_bytes) {
  if (!header) {
    if (header.error().text.find("fuzz") != 0) std::abort();
    return;
  }
  if (!check_header(*header, data_bytes, "fuzz").ok()) return;
  const volume::Grid grid{{int(header->size[0]), int(header->size[1]), int(header->size[2])}, header->index_to_data};
  if (!volume::validate(grid).ok()) std::abort();
  if (header->encoding == Encoding::kRaw && header->voxel_bytes() / header->parts() > data_bytes) std::abort();
}

class NoCompanions final : public Companions {
 public:
  Result<std::string_view> read(const std::string& named) override { return Error{"fuzz: no " + named}; }
};

}  // namespace
}  // namespace telesplat::data

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::data;
  const std::string_view content(reinterpret_cast<const char*>(data), size);
  use(parse_nrrd(content, "fuzz"), size);
  use(parse_metaimage(content, "fuzz"), size);
  use(parse_nifti(content, "fuzz"), size);
  NoCompanions none;
  if (const auto image = vtk::read_image_header(content, "fuzz", none, "");
      image && image->extent[1] < 64 && image->extent[3] < 64 && image->extent[5] < 64)
    if (const auto voxels = vtk::read_image(*image, content, "fuzz", none); !voxels && voxels.error().text.empty())
      std::abort();
  if (const auto mesh = vtk::read_mesh(content, "fuzz", none, ""); !mesh && mesh.error().text.find("fuzz") != 0)
    std::abort();
  if (const auto pages = tiff_pages(content); pages && pages->data_at > size) std::abort();
  use(parse_raw_spec(content, "fuzz"), size);
  const auto slices = parse_dicom(content, "fuzz");
  if (slices.ok() && slices->empty()) std::abort();
  for (size_t i = 0; slices.ok() && i < slices->size(); ++i) {
    const DicomSlice& s = (*slices)[i];
    if (!s.data.deflated && (s.data.at > size || s.data.bytes > size - s.data.at)) std::abort();
  }
  if (slices.ok()) order_slices(*slices, [](auto& a, auto& b) { return a.frame == b.frame; });
  volume_format({std::string(content), false, size}, "fuzz.nii");
  return 0;
}
