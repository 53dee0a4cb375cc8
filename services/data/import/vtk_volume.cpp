#include "services/data/import/vtk_volume.h"

#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkMatrix3x3.h>
#include <vtkNIFTIImageReader.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStringOutputWindow.h>
#include <vtkXMLImageDataReader.h>

#include <algorithm>
#include <optional>

#include "services/data/import/vtk_complaint.h"

namespace telesplat::data {
namespace {

std::optional<StoredType> type_of(int vtk, size_t bytes) {
  switch (vtk) {
    case VTK_FLOAT:
      return StoredType::kF32;
    case VTK_DOUBLE:
      return StoredType::kF64;
    case VTK_CHAR:
    case VTK_SIGNED_CHAR:
      return StoredType::kI8;
    case VTK_UNSIGNED_CHAR:
      return StoredType::kU8;
    case VTK_SHORT:
      return StoredType::kI16;
    case VTK_UNSIGNED_SHORT:
      return StoredType::kU16;
    case VTK_INT:
    case VTK_LONG:
    case VTK_LONG_LONG:
    case VTK_ID_TYPE:
      return bytes == 4 ? StoredType::kI32 : StoredType::kI64;
    case VTK_UNSIGNED_INT:
    case VTK_UNSIGNED_LONG:
    case VTK_UNSIGNED_LONG_LONG:
      return bytes == 4 ? StoredType::kU32 : StoredType::kU64;
    default:
      return std::nullopt;
  }
}

// Reads, and tells how far it is, at steps of a hundredth.
void update(vtkAlgorithm* reader, const ReadProgress& progress) {
  struct State {
    const ReadProgress& progress;
    double told;
  } state{progress, -1};
  vtkNew<vtkCallbackCommand> callback;
  callback->SetClientData(&state);
  callback->SetCallback([](vtkObject* caller, unsigned long, void* data, void*) {
    auto& s = *static_cast<State*>(data);
    const double done = static_cast<vtkAlgorithm*>(caller)->GetProgress();
    if (s.progress && done >= s.told + 0.01) s.progress(done), s.told = done;
  });
  reader->AddObserver(vtkCommand::ProgressEvent, callback);
  reader->Update();
  reader->RemoveObservers(vtkCommand::ProgressEvent);
}

// The array that holds the voxels: the active scalars, or the first array of one component.
vtkDataArray* voxels_of(vtkDataSetAttributes* data) {
  if (vtkDataArray* scalars = data->GetScalars()) return scalars;
  for (int i = 0; i < data->GetNumberOfArrays(); ++i)
    if (vtkDataArray* array = data->GetArray(i); array && array->GetNumberOfComponents() == 1) return array;
  return data->GetNumberOfArrays() > 0 ? data->GetArray(0) : nullptr;
}

// The image in index space over `array`, which it shares.
vtkSmartPointer<vtkImageData> index_image(const std::array<int64_t, 3>& size, vtkDataArray* array) {
  auto image = vtkSmartPointer<vtkImageData>::New();
  image->SetDimensions(int(size[0]), int(size[1]), int(size[2]));
  image->GetPointData()->SetScalars(array);
  return image;
}

Result<VtkVolume> volume_of(vtkDataArray* array, const VolumeFileHeader& header, const std::string& path) {
  if (!array) return Error{path + ": has no values that VTK finds"};
  if (array->GetNumberOfComponents() != 1)
    return Error{fmt::format("{}: has {} components a voxel, supported is 1", path, array->GetNumberOfComponents())};
  const auto stored = type_of(array->GetDataType(), size_t(array->GetDataTypeSize()));
  if (!stored)
    return Error{fmt::format("{}: its voxels are of type {}; {}", path, array->GetDataTypeAsString(), kSupportedTypes)};
  if (array->GetNumberOfTuples() != vtkIdType(header.voxels()))
    return Error{fmt::format("{}: has {} values for {} x {} x {} voxels", path, array->GetNumberOfTuples(),
                             header.size[0], header.size[1], header.size[2])};
  if (header.format != "vti" && *stored != header.stored)
    return Error{
        fmt::format("{}: has voxels of {} where its header says {}", path, name_of(*stored), name_of(header.stored))};
  VtkVolume out{index_image(header.size, array), header};
  out.header.stored = *stored;
  out.header.big_endian = false;
  return out;
}

Result<VtkVolume> read_nifti(const VolumeFileHeader& header, const std::string& path, const ReadProgress& progress) {
  vtkNew<vtkNIFTIImageReader> reader;
  reader->SetFileName(path.c_str());
  update(reader, progress);
  vtkImageData* image = reader->GetOutput();
  int size[3];
  image->GetDimensions(size);
  for (size_t a = 0; a < 3; ++a)
    if (size[a] != header.size[a])
      return Error{fmt::format("{}: VTK finds {} x {} x {} voxels, its header says {} x {} x {}", path, size[0],
                               size[1], size[2], header.size[0], header.size[1], header.size[2])};
  auto volume = volume_of(image->GetPointData()->GetScalars(), header, path);
  if (volume && reader->GetQFac() < 0) {
    // VTK turns the order of slices round then: index k there is n - 1 - k here.
    glm::dmat4& m = volume->header.index_to_data;
    m[3] += m[2] * double(header.size[2] - 1);
    m[2] = -m[2];
  }
  return volume;
}

Result<VtkVolume> read_vti(const VolumeFileHeader& header, const std::string& path, const ReadProgress& progress) {
  vtkNew<vtkXMLImageDataReader> reader;
  reader->SetFileName(path.c_str());
  update(reader, progress);
  vtkImageData* image = reader->GetOutput();
  vtkDataArray* array = voxels_of(image->GetPointData());
  const bool cells = !array;
  if (cells) array = voxels_of(image->GetCellData());
  VolumeFileHeader h = header;
  int extent[6];
  double origin[3], spacing[3];
  image->GetExtent(extent);
  image->GetOrigin(origin);
  image->GetSpacing(spacing);
  glm::dvec3 begin, axis[3];
  for (int a = 0; a < 3; ++a) {
    h.size[size_t(a)] = std::max(extent[2 * a + 1] - extent[2 * a] + (cells ? 0 : 1), cells ? 1 : 0);
    begin[a] = extent[2 * a] + (cells ? 0.5 : 0);
  }
  const vtkMatrix3x3* turn = image->GetDirectionMatrix();
  glm::dvec3 at(origin[0], origin[1], origin[2]);
  for (int a = 0; a < 3; ++a) {
    for (int r = 0; r < 3; ++r) axis[a][r] = turn->GetElement(r, a) * spacing[a];
    at += axis[a] * begin[a];
  }
  for (int c = 0; c < 3; ++c) h.index_to_data[c] = glm::dvec4(axis[c], 0);
  h.index_to_data[3] = glm::dvec4(at, 1);
  return volume_of(array, h, path);
}

}  // namespace

Result<VtkVolume> read_vtk_volume(const VolumeFileHeader& header, const std::string& path,
                                  const ReadProgress& progress) {
  vtkNew<vtkStringOutputWindow> output;
  vtkOutputWindow::SetInstance(output);
  auto volume = header.format == "nifti" ? read_nifti(header, path, progress) : read_vti(header, path, progress);
  const std::string complaint = first_complaint(output->GetOutput());
  if (!complaint.empty())
    return Error{fmt::format("{}: is damaged or cut: its {} x {} x {} voxels cannot be read: {}", path, header.size[0],
                             header.size[1], header.size[2], complaint)};
  return volume;
}

}  // namespace telesplat::data
