#include "services/data/import/vtk_arrays.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkDataSetAttributes.h>
#include <vtkInformation.h>
#include <vtkInformationStringKey.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string_view>
#include <vector>

#include "common/scene/colouring.h"

namespace telesplat::data {
namespace {

// component -1: the value, or the vector's length.
double value_of(vtkDataArray& array, vtkIdType tuple, int component) {
  const int components = array.GetNumberOfComponents();
  if (component >= 0) return array.GetComponent(tuple, component);
  if (components == 1) return array.GetComponent(tuple, 0);
  double squares = 0;
  for (int c = 0; c < components; ++c) squares += array.GetComponent(tuple, c) * array.GetComponent(tuple, c);
  return std::sqrt(squares);
}

scene::ArrayInfo info_of(vtkDataArray& array, bool of_cells) {
  const int components = array.GetNumberOfComponents();
  scene::ArrayInfo out{array.GetName() ? array.GetName() : "", "", of_cells, components, {}};
  if (const char* unit = array.HasInformation() ? array.GetInformation()->Get(vtkDataArray::UNITS_LABEL()) : nullptr)
    out.unit = unit;
  out.spans.resize(components == 1 ? 1 : size_t(std::min(components, scene::kMaxComponents)) + 1);
  for (vtkIdType i = 0; i < array.GetNumberOfTuples(); ++i)
    for (size_t s = 0; s < out.spans.size(); ++s) out.spans[s].add(value_of(array, i, int(s) - 1));
  return out;
}

// Those of numbers, one tuple a point or cell. VTK's own marks of ghosts are none.
void list(vtkDataSetAttributes& data, vtkIdType tuples, bool of_cells, std::vector<vtkDataArray*>& arrays,
          std::vector<scene::ArrayInfo>& infos) {
  for (int i = 0; i < data.GetNumberOfArrays() && infos.size() < scene::kMaxArrays; ++i) {
    vtkDataArray* array = data.GetArray(i);
    if (!array || array->GetNumberOfTuples() != tuples || array->GetNumberOfComponents() < 1 ||
        (array->GetName() && std::string_view(array->GetName()) == vtkDataSetAttributes::GhostArrayName()))
      continue;
    arrays.push_back(array);
    infos.push_back(info_of(*array, of_cells));
  }
}

}  // namespace

Status take_arrays(vtkPolyData& surface, const std::string& wanted, std::span<const uint32_t> cells,
                   const std::string& path, Mesh& mesh) {
  std::vector<vtkDataArray*> arrays;
  list(*surface.GetPointData(), surface.GetNumberOfPoints(), false, arrays, mesh.arrays);
  list(*surface.GetCellData(), surface.GetNumberOfCells(), true, arrays, mesh.arrays);
  scene::make_tellable(mesh.arrays);
  if (wanted.empty()) return ok_status();
  const auto choice = scene::choose_array(mesh.arrays, wanted);
  if (!choice) return Error{fmt::format("{}: {}", path, choice.error().text)};
  vtkDataArray& array = *arrays[choice->index];
  const double origin = scene::scalar_origin(scene::span_of(mesh.arrays, *choice));
  mesh.scalars_of_faces = mesh.arrays[choice->index].of_cells;
  const size_t count = mesh.scalars_of_faces ? cells.size() : mesh.positions.size();
  mesh.scalars.reserve(count);
  for (size_t i = 0; i < count; ++i) {
    const auto tuple = vtkIdType(mesh.scalars_of_faces ? cells[i] : i);
    const bool there = tuple < array.GetNumberOfTuples();
    mesh.scalars.push_back(scene::stored_scalar(
        there ? value_of(array, tuple, choice->component) : std::numeric_limits<double>::quiet_NaN(), origin));
  }
  return ok_status();
}

}  // namespace telesplat::data
