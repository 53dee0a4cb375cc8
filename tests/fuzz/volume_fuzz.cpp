// The parsers of all volume headers: whatever a header says, what passes the checks must be a grid whose voxels the
// data can hold.
#include <cstdint>
#include <cstdlib>

#include "common/volume/grid.h"
#include "services/data/volume/formats/dicom_header.h"
#include "services/data/volume/formats/header.h"

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
  if (header->encoding == Encoding::kRaw && header->voxel_bytes() > data_bytes) std::abort();
}

}  // namespace
}  // namespace telesplat::data

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace telesplat::data;
  const std::string_view content(reinterpret_cast<const char*>(data), size);
  use(parse_nrrd(content, "fuzz"), size);
  use(parse_metaimage(content, "fuzz"), size);
  use(parse_nifti(content, "fuzz"), size);
  use(parse_vti(content, "fuzz"), size);
  use(parse_raw_spec(content, "fuzz"), size);
  const auto slice = parse_dicom(content, "fuzz");
  if (slice.ok() && (slice->data_at > size || slice->data_bytes > size - slice->data_at)) std::abort();
  volume_format({std::string(content), false, size}, "fuzz.nii");
  return 0;
}
