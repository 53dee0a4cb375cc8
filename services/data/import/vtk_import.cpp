#include "services/data/import/vtk_import.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkDataArray.h>
#include <vtkDataReader.h>
#include <vtkGeometryFilter.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkSmartPointer.h>
#include <vtkStringOutputWindow.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkUnstructuredGridReader.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "services/data/import/vtk_arrays.h"
#include "services/data/import/vtk_complaint.h"

namespace telesplat::data {
namespace {

using Linear = std::array<double, 3>;  // linear light, 0..1

double to_linear(double srgb) { return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4); }
uint32_t to_srgb8(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);  // NaN becomes 0 below
  const double v = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
  return v > 0 ? static_cast<uint32_t>(v * 255 + 0.5) : 0;
}
uint32_t to_rgb(const Linear& c) { return pack_rgb(to_srgb8(c[0]), to_srgb8(c[1]), to_srgb8(c[2])); }

// A point data array that holds colours, or null.
vtkDataArray* find_colours(vtkPointData* data) {
  vtkDataArray* scalars = data->GetScalars();
  const auto fits = [](vtkDataArray* a) {
    return a && (a->GetNumberOfComponents() == 3 || a->GetNumberOfComponents() == 4);
  };
  if (fits(scalars) && scalars->GetDataType() == VTK_UNSIGNED_CHAR) return scalars;
  for (const char* name :
       {"RGB", "RGBA", "rgb", "rgba", "Color", "color", "Colors", "colors", "Colours", "colours", "COLOR_0", "color_0"})
    if (vtkDataArray* array = data->GetArray(name); fits(array)) return array;
  return nullptr;
}

// What a channel must be multiplied with to lie in 0..1.
double channel_scale(vtkDataArray* colours) {
  switch (colours->GetDataType()) {
    case VTK_UNSIGNED_CHAR:
      return 1 / 255.0;
    case VTK_UNSIGNED_SHORT:
      return 1 / 65535.0;
    default:
      return colours->GetMaxNorm() > 2.0 ? 1 / 255.0
                                         : 1.0;  // of three fractions, the norm is at most 1.73 (with alpha, 2)
  }
}

class Collector {
 public:
  /// array: what the mesh is coloured by; empty: nothing.
  Collector(const std::string& format, std::string array) : array_(std::move(array)) { mesh_.format = format; }

  /// Of a format that holds one block: with its arrays. Error: array is not one of them.
  Status add_alone(vtkPolyData* block, const std::string& path) {
    add(block);
    if (mesh_.positions.empty()) return ok_status();
    return take_arrays(*block, array_, cells_, path, mesh_);
  }

  void add(vtkPolyData* block) {
    const auto base = static_cast<uint32_t>(mesh_.positions.size());
    const vtkIdType points = block->GetNumberOfPoints();
    if (points <= 0 || static_cast<uint64_t>(points) + base > kMaxVertices) return;
    mesh_.positions.reserve(base + static_cast<size_t>(points));
    for (vtkIdType i = 0; i < points; ++i) {
      double p[3];
      block->GetPoint(i, p);
      mesh_.positions.emplace_back(p[0], p[1], p[2]);
    }
    add_normals(block->GetPointData()->GetNormals(), points);
    add_colours(block);
    const vtkIdType before_polys = block->GetNumberOfVerts() + block->GetNumberOfLines();
    add_cells(block->GetPolys(), base, points, false, before_polys);
    add_cells(block->GetStrips(), base, points, true, before_polys + block->GetNumberOfPolys());
  }

  Mesh finish() {
    if (!any_normals_) mesh_.normals = {};
    if (!any_colours_) mesh_.colours = {};
    return std::move(mesh_);
  }

 private:
  void add_normals(vtkDataArray* normals, vtkIdType points) {
    const bool fits = normals && normals->GetNumberOfComponents() == 3 && normals->GetNumberOfTuples() == points;
    any_normals_ |= fits;
    for (vtkIdType i = 0; i < points; ++i) {
      double n[3] = {};
      if (fits) normals->GetTuple(i, n);
      mesh_.normals.emplace_back(n[0], n[1], n[2]);
    }
  }

  void add_colours(vtkPolyData* block) {
    const vtkIdType points = block->GetNumberOfPoints();
    vtkDataArray* colours = find_colours(block->GetPointData());
    if (colours && colours->GetNumberOfTuples() != points) colours = nullptr;
    any_colours_ |= colours != nullptr;
    const double scale = colours ? channel_scale(colours) : 0;
    for (vtkIdType i = 0; i < points; ++i) {
      Linear c{};
      for (int k = 0; colours && k < 3; ++k) c[k] = to_linear(colours->GetComponent(i, k) * scale);
      mesh_.colours.push_back(colours ? to_rgb(c) : kNeutralAlbedo);
    }
  }

  // Polygons as fans, strips with alternating orientation. An index that is out of range stays so, for validate_mesh to
  // name. first_cell: the number of the first of these cells in the block.
  void add_cells(vtkCellArray* cells, uint32_t base, vtkIdType points, bool strips, vtkIdType first_cell) {
    if (!cells) return;
    const auto corner = [&](vtkIdType i) {
      return i >= 0 && i < points ? base + static_cast<uint32_t>(i) : ~uint32_t{0};
    };
    const auto iterator = vtk::TakeSmartPointer(cells->NewIterator());
    vtkIdType cell = first_cell;
    for (iterator->GoToFirstCell(); !iterator->IsDoneWithTraversal(); iterator->GoToNextCell(), ++cell) {
      vtkIdType count = 0;
      const vtkIdType* ids = nullptr;
      iterator->GetCurrentCell(count, ids);
      if (count < 3) ++mesh_.degenerate_dropped;
      for (vtkIdType k = 2; k < count; ++k) {
        const bool odd = strips && k % 2 == 1;
        const vtkIdType a = strips ? ids[k - 2] : ids[0];
        mesh_.indices.insert(mesh_.indices.end(),
                             {corner(a), corner(ids[odd ? k : k - 1]), corner(ids[odd ? k - 1 : k])});
        if (!array_.empty()) cells_.push_back(uint32_t(cell));
      }
    }
  }

  Mesh mesh_;
  const std::string array_;
  std::vector<uint32_t> cells_;  // of each triangle, where array_ may be of cells
  bool any_normals_ = false, any_colours_ = false;
};

// Legacy files have several arrays of a kind; the readers take the first unless told otherwise.
void read_all_arrays(vtkDataReader& reader) {
  reader.ReadAllScalarsOn();
  reader.ReadAllVectorsOn();
  reader.ReadAllTensorsOn();
  reader.ReadAllFieldsOn();
  reader.ReadAllColorScalarsOn();
}

template <class Reader>
Status read_poly_data(const std::string& path, Collector& collector) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  if constexpr (requires { reader->ReadAllScalarsOn(); }) read_all_arrays(*reader);
  reader->Update();
  return reader->GetOutput() ? collector.add_alone(reader->GetOutput(), path) : ok_status();
}

// The outer faces of an unstructured grid's cells.
template <class Reader>
Status read_grid(const std::string& path, Collector& collector) {
  vtkNew<Reader> reader;
  reader->SetFileName(path.c_str());
  if constexpr (requires { reader->ReadAllScalarsOn(); }) read_all_arrays(*reader);
  vtkNew<vtkGeometryFilter> surface;
  surface->SetInputConnection(reader->GetOutputPort());
  surface->Update();
  return surface->GetOutput() ? collector.add_alone(surface->GetOutput(), path) : ok_status();
}

Status read_vtk(const std::string& path, const std::string& format, Collector& collector) {
  if (format == "vtp") return read_poly_data<vtkXMLPolyDataReader>(path, collector);
  if (format == "vtu") return read_grid<vtkXMLUnstructuredGridReader>(path, collector);
  vtkNew<vtkDataReader> legacy;
  legacy->SetFileName(path.c_str());
  if (legacy->IsFileUnstructuredGrid()) return read_grid<vtkUnstructuredGridReader>(path, collector);
  return read_poly_data<vtkPolyDataReader>(path, collector);
}

}  // namespace

Result<Mesh> import_with_vtk(const std::string& path, const std::string& format, const std::string& array) {
  vtkNew<vtkStringOutputWindow> output;
  vtkOutputWindow::SetInstance(output);
  Collector collector(format, array);
  const Status read = read_vtk(path, format, collector);
  const std::string complaint = first_complaint(output->GetOutput());
  if (!complaint.empty()) return Error{fmt::format("{}: {}", path, complaint)};
  if (!read) return read.error();
  return collector.finish();
}

}  // namespace telesplat::data
