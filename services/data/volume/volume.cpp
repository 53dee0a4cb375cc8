#include "services/data/volume/volume.h"

#include <fmt/format.h>

#include <filesystem>
#include <glm/geometric.hpp>
#include <new>

#include "services/data/volume/dicom_reader.h"
#include "services/data/volume/formats/header_text.h"
#include "services/data/volume/formats/import_stream.h"
#include "services/data/volume/formats/payload.h"
#include "services/data/volume/formats/stack.h"

namespace telesplat::data {

namespace {

// Gives voxels the spacing that people say, in the directions that they have. Error: it is no spacing.
Status space_out(const std::string& spacing, glm::dmat4& index_to_data) {
  if (spacing.empty()) return ok_status();
  const auto s = numbers(spacing, true);
  if (!s || s->size() != 3 || !((*s)[0] > 0 && (*s)[1] > 0 && (*s)[2] > 0))
    return Error{fmt::format("--spacing {}: is not three numbers above 0, as in 0.5,0.5,2", in_quotes(spacing))};
  for (int a = 0; a < 3; ++a) index_to_data[a] *= (*s)[size_t(a)] / glm::length(index_to_data[a]);
  return ok_status();
}

// Checked against the size of all its files.
Result<VolumeFileHeader> read_stack_header(const std::vector<std::string>& slices) {
  auto header = stack_header(slices);
  if (!header) return header;
  uint64_t bytes = 0;
  std::error_code error;
  for (const std::string& slice : slices) bytes += std::filesystem::file_size(slice, error);
  if (header->data_at == 0) header->encoding = Encoding::kGzip;  // as much as the best of packers
  if (const Status s = check_header(*header, bytes, slices[0]); !s) return s.error();
  return header;
}

// The checked header of a step, a DICOM series' included; its size is that of the first step.
Result<VolumeFileHeader> read_step_header(const VolumeSource& source, size_t step) {
  if (step >= source.steps.size())
    return Error{fmt::format("{}: has no step {}, it has {}", source.name, step, source.steps.size())};
  if (source.dicom) return source.dicom->header;
  if (!source.slices.empty()) return read_stack_header(source.slices);
  const auto read = [&](const std::string& path) {
    return read_volume_header(path, source.layout.raw, source.layout.array);
  };
  auto header = read(source.steps[step]);
  if (!header || step == 0) return header;
  const auto first = read(source.steps[0]);
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
  if (!source.slices.empty() && header.data_at == 0) {
    const std::string layout =
        fmt::format("{}x{}x{}:{}", header.size[0], header.size[1], header.size[2], name_of(header.stored));
    auto streamed =
        import_volume({"stack", path, layout}, source.slices, header.voxel_bytes(), "GDAL's picture", progress);
    if (!streamed) return streamed.error();
    VolumeFileHeader native = header;
    native.big_endian = streamed->header.big_endian;
    return make_volume(native, std::move(streamed->bytes), path);
  }
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
    if (volume)
      if (const Status s = space_out(source.layout.spacing, volume->index_to_data); !s) return s.error();
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
