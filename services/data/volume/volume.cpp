#include "services/data/volume/volume.h"

#include <fmt/format.h>

#include <new>

#include "services/data/volume/dicom_reader.h"
#include "services/data/volume/formats/payload.h"

namespace telesplat::data {

namespace {

// The checked header of a step, a DICOM series' included; its size is that of the first step.
Result<VolumeFileHeader> read_step_header(const VolumeSource& source, size_t step) {
  if (step >= source.steps.size())
    return Error{fmt::format("{}: has no step {}, it has {}", source.name, step, source.steps.size())};
  if (source.dicom) return source.dicom->header;
  auto header = read_volume_header(source.steps[step], source.raw, source.array);
  if (!header || step == 0) return header;
  const auto first = read_volume_header(source.steps[0], source.raw, source.array);
  if (first && first->size != header->size)
    return Error{fmt::format("{}: has {} x {} x {} voxels, the first of its series, {}, has {} x {} x {}",
                             source.steps[step], header->size[0], header->size[1], header->size[2], source.steps[0],
                             first->size[0], first->size[1], first->size[2])};
  return header;
}

Result<Volume> read_voxels(const VolumeFileHeader& header, const VolumeSource& source, size_t step,
                           const ReadProgress& progress) {
  const std::string& path = source.steps[step];
  if (source.dicom) return read_dicom(*source.dicom, step, path, progress);
  const bool image = header.format == "vti" || header.format == "vtk";
  auto bytes = image ? read_vtk_image(header, path) : read_payload(header, path, progress);
  if (!bytes) return bytes.error();
  return make_volume(header, std::move(*bytes), path);
}

}  // namespace

Result<Volume> read_volume(const VolumeSource& source, size_t step, const ReadProgress& progress) {
  const auto header = read_step_header(source, step);
  if (!header) return header.error();
  const std::string& path = source.steps[step];
  if (auto status = check_memory(header->voxel_bytes(), path); !status) return status.error();
  if (progress) progress(0.0);
  try {
    auto volume = read_voxels(*header, source, step, progress);
    if (volume && progress) progress(1.0);
    return volume;
  } catch (const std::bad_alloc&) {
    return Error{fmt::format("{}: this machine's memory does not suffice for its {} bytes of voxels", path,
                             header->voxel_bytes())};
  }
}

Status check_steps(const VolumeSource& source) {
  for (size_t step = 0; step < source.steps.size(); ++step)
    if (const auto header = read_step_header(source, step); !header) return header.error();
  return ok_status();
}

}  // namespace telesplat::data
