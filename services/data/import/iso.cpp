#include "services/data/import/iso.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkDataArray.h>
#include <vtkFloatArray.h>
#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkShortArray.h>
#include <vtkSignedCharArray.h>
#include <vtkSmartPointer.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>

#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>

#include "services/data/base/volume.h"

namespace telesplat::data {
namespace {

template <class Array, class T>
vtkSmartPointer<vtkDataArray> in_place(void* voxels, vtkIdType count) {
  auto array = vtkSmartPointer<Array>::New();
  array->SetArray(static_cast<T*>(voxels), count, 1);  // 1: the memory stays ours
  return array;
}

vtkSmartPointer<vtkDataArray> scalars(int32_t type, void* voxels, vtkIdType count) {
  switch (VoxelType(type)) {
    case VoxelType::kU8:
      return in_place<vtkUnsignedCharArray, unsigned char>(voxels, count);
    case VoxelType::kI8:
      return in_place<vtkSignedCharArray, signed char>(voxels, count);
    case VoxelType::kU16:
      return in_place<vtkUnsignedShortArray, unsigned short>(voxels, count);
    case VoxelType::kI16:
      return in_place<vtkShortArray, short>(voxels, count);
    case VoxelType::kF32:
      return in_place<vtkFloatArray, float>(voxels, count);
  }
  return nullptr;
}

Mesh to_mesh(vtkPolyData& surface, const glm::dmat4& index_to_data) {
  Mesh mesh;
  mesh.format = "isosurface";
  const glm::dmat3 linear(index_to_data), of_normals = glm::transpose(glm::inverse(linear));
  const bool mirrored = glm::determinant(linear) < 0;
  vtkDataArray* normals = surface.GetPointData()->GetNormals();
  const vtkIdType points = surface.GetNumberOfPoints();
  mesh.positions.reserve(size_t(points));
  for (vtkIdType i = 0; i < points; ++i) {
    double p[3];
    surface.GetPoint(i, p);
    mesh.positions.emplace_back(index_to_data * glm::dvec4(p[0], p[1], p[2], 1));
    if (!normals) continue;
    double n[3];
    normals->GetTuple(i, n);
    const glm::dvec3 turned = of_normals * glm::dvec3(n[0], n[1], n[2]);
    const double length = glm::length(turned);
    mesh.normals.emplace_back(length > 0 ? glm::vec3(turned / length) : glm::vec3(0));
  }
  const auto cell = vtk::TakeSmartPointer(surface.GetPolys()->NewIterator());
  mesh.indices.reserve(size_t(surface.GetNumberOfPolys()) * 3);
  for (cell->GoToFirstCell(); !cell->IsDoneWithTraversal(); cell->GoToNextCell()) {
    vtkIdType count = 0;
    const vtkIdType* ids = nullptr;
    cell->GetCurrentCell(count, ids);
    if (count != 3) continue;
    mesh.indices.insert(mesh.indices.end(),
                        {uint32_t(ids[0]), uint32_t(ids[mirrored ? 2 : 1]), uint32_t(ids[mirrored ? 1 : 2])});
  }
  return mesh;
}

}  // namespace

Result<Mesh> flying_edges(int descriptor, const std::string& name) {
  struct stat status {};
  VolumeHeader header;
  if (fstat(descriptor, &status) != 0 || size_t(status.st_size) < sizeof header)
    return Error{fmt::format("{}: the volume did not arrive", name)};
  const auto bytes = size_t(status.st_size);
  void* mapped = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE, descriptor, 0);
  if (mapped == MAP_FAILED) return Error{fmt::format("{}: the volume cannot be mapped", name)};
  std::memcpy(&header, mapped, sizeof header);
  const auto count = vtkIdType(header.size[0]) * header.size[1] * header.size[2];
  const auto array = scalars(header.type, static_cast<std::byte*>(mapped) + sizeof header, count);
  if (header.magic != VolumeHeader{}.magic || !array ||
      bytes != sizeof header + size_t(count) * voxel_bytes(VoxelType(header.type)))
    return Error{fmt::format("{}: the volume arrived damaged", name)};

  vtkNew<vtkImageData> image;
  image->SetDimensions(header.size);
  image->GetPointData()->SetScalars(array);
  vtkNew<vtkFlyingEdges3D> edges;
  edges->SetInputData(image);
  edges->SetValue(0, header.iso);
  edges->ComputeNormalsOn();
  edges->ComputeScalarsOff();
  edges->Update();
  vtkPolyData* surface = edges->GetOutput();
  if (!surface || surface->GetNumberOfPolys() == 0) return Error{fmt::format("{}: has no surface at this value", name)};
  if (uint64_t(surface->GetNumberOfPoints()) > kMaxVertices || uint64_t(surface->GetNumberOfPolys()) > kMaxTriangles)
    return Error{
        fmt::format("{}: its surface has {} triangles, limit {}", name, surface->GetNumberOfPolys(), kMaxTriangles)};
  glm::dmat4 index_to_data;
  std::memcpy(&index_to_data[0][0], header.index_to_data, sizeof header.index_to_data);
  return to_mesh(*surface, index_to_data);
}

}  // namespace telesplat::data
