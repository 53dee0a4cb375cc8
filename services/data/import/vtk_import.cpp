#include "services/data/import/vtk_import.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellArrayIterator.h>
#include <vtkCompositeDataIterator.h>
#include <vtkDataArray.h>
#include <vtkDataReader.h>
#include <vtkFieldData.h>
#include <vtkGLTFDocumentLoader.h>
#include <vtkGLTFReader.h>
#include <vtkGeometryFilter.h>
#include <vtkMultiBlockDataSet.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
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

#include "services/data/base/mapped_file.h"
#include "services/data/import/vtk_arrays.h"
#include "services/data/import/vtk_complaint.h"
#include "services/data/texture/bake.h"
#include "services/data/texture/gltf_textures.h"

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

// The glTF material of a block, from the field data that vtkGLTFReader leaves.
struct Material {
  Linear factor{1, 1, 1};
  uint32_t texture = kNoTexture;

  Material(vtkPolyData* block, const GltfTextures& textures) {
    vtkFieldData* fields = block->GetFieldData();
    if (vtkDataArray* a = fields->GetArray("BaseColorMultiplier");
        a && a->GetNumberOfComponents() >= 3 && a->GetNumberOfTuples() > 0)
      for (int k = 0; k < 3; ++k) factor[k] = a->GetComponent(0, k);
    vtkDataArray* index = fields->GetArray("BaseColorTextureIndex");
    if (!index || index->GetNumberOfTuples() == 0) return;
    const double i = index->GetTuple1(0);
    if (i >= 0 && i < double(textures.all.size()) && textures.all[size_t(i)]) texture = uint32_t(i);
  }
};

class Collector {
 public:
  /// array: what the mesh is coloured by; empty: nothing.
  Collector(const std::string& format, std::string array) : array_(std::move(array)) { mesh_.format = format; }

  /// Of a format that holds one block: with its arrays. Error: array is not one of them.
  Status add_alone(vtkPolyData* block, const std::string& path) {
    add(block, nullptr);
    if (mesh_.positions.empty()) return ok_status();
    return take_arrays(*block, array_, cells_, path, mesh_);
  }

  void add(vtkPolyData* block, const Material* material) {
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
    add_colours(block, material);
    const vtkIdType before_polys = block->GetNumberOfVerts() + block->GetNumberOfLines();
    add_cells(block->GetPolys(), base, points, false, before_polys);
    add_cells(block->GetStrips(), base, points, true, before_polys + block->GetNumberOfPolys());
  }

  /// Of all blocks added so far, which have these textures.
  void bake(GltfTextures textures, uint64_t most_triangles, const std::string& path) {
    mesh_.notes = std::move(textures.notes);
    use_.textures = std::move(textures.all);
    const bool any = std::any_of(use_.texture.begin(), use_.texture.end(), [](uint32_t t) { return t != kNoTexture; });
    const bool sound =
        std::all_of(mesh_.indices.begin(), mesh_.indices.end(), [&](uint32_t i) { return i < mesh_.positions.size(); });
    if (!any || !sound) return;
    any_normals_ = true;
    if (std::string note = bake_textures(mesh_, std::move(use_), most_triangles); !note.empty())
      mesh_.notes.push_back(path + ": " + note);
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

  void add_colours(vtkPolyData* block, const Material* material) {
    const vtkIdType points = block->GetNumberOfPoints();
    vtkDataArray* colours = find_colours(block->GetPointData());
    if (colours && colours->GetNumberOfTuples() != points) colours = nullptr;
    vtkDataArray* uv = block->GetPointData()->GetTCoords();
    if (uv && (uv->GetNumberOfTuples() != points || uv->GetNumberOfComponents() < 2)) uv = nullptr;
    const uint32_t texture = material && uv ? material->texture : kNoTexture;
    const bool tinted = material && (texture != kNoTexture || material->factor != Linear{1, 1, 1});
    any_colours_ |= colours || tinted;
    const double scale = colours ? channel_scale(colours) : 0;
    for (vtkIdType i = 0; i < points; ++i) {
      use_.texture.push_back(texture);
      use_.uv.push_back(texture == kNoTexture ? glm::vec2(0)
                                              : glm::vec2(uv->GetComponent(i, 0), uv->GetComponent(i, 1)));
      if (!colours && !tinted) {
        mesh_.colours.push_back(kNeutralAlbedo);
        continue;
      }
      Linear c{1, 1, 1};
      // glTF says that its vertex colours are linear; everyone else's are what the screen shall show.
      if (colours)
        for (int k = 0; k < 3; ++k)
          c[k] = colours->GetComponent(i, k) * scale, c[k] = material ? c[k] : to_linear(c[k]);
      if (material)
        for (int k = 0; k < 3; ++k) c[k] *= material->factor[k];
      mesh_.colours.push_back(to_rgb(c));
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
  TextureUse use_;
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

// Reads the geometry alone. Pictures are read elsewhere: with their samplers, and without an end if one is missing.
class GltfReader : public vtkGLTFReader {
 public:
  static GltfReader* New() { VTK_STANDARD_NEW_BODY(GltfReader); }

  void read() {
    UpdateInformation();
    if (const auto model = Loader ? Loader->GetInternalModel() : nullptr)
      for (auto& image : model->Images) {
        image.BufferView = -1;
        image.MimeType = "image/png";
        image.Uri =  // one grey pixel
            "data:image/png;base64,iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAAAAAA6fptVAAAACklEQVR4nGM4"
            "AQAAygDJmcpdfgAAAABJRU5ErkJggg==";
      }
    Update();
  }
};

Status read_gltf(const std::string& path, uint64_t texture_detail, Collector& collector) {
  const auto file = MappedFile::open(path);
  if (!file) return file.error();
  auto textures = read_gltf_textures((*file)->text(), path);
  if (!textures) return textures.error();
  vtkNew<GltfReader> reader;
  reader->SetFileName(path.c_str());
  reader->ApplyDeformationsToGeometryOn();
  reader->read();
  auto* blocks = vtkMultiBlockDataSet::SafeDownCast(reader->GetOutputDataObject(0));
  if (!blocks) return ok_status();
  const auto iterator = vtk::TakeSmartPointer(blocks->NewIterator());
  for (iterator->InitTraversal(); !iterator->IsDoneWithTraversal(); iterator->GoToNextItem())
    if (auto* block = vtkPolyData::SafeDownCast(iterator->GetCurrentDataObject())) {
      const Material material(block, *textures);
      collector.add(block, &material);
    }
  collector.bake(std::move(*textures), texture_detail, path);
  return ok_status();
}

}  // namespace

Result<Mesh> import_with_vtk(const std::string& path, const std::string& format, const std::string& array,
                             uint64_t texture_detail) {
  vtkNew<vtkStringOutputWindow> output;
  vtkOutputWindow::SetInstance(output);
  Collector collector(format, array);
  Status read = ok_status();
  if (format == "gltf")
    read = read_gltf(path, texture_detail, collector);
  else
    read = read_vtk(path, format, collector);
  const std::string complaint = first_complaint(output->GetOutput());
  if (!complaint.empty()) return Error{fmt::format("{}: {}", path, complaint)};
  if (!read) return read.error();
  return collector.finish();
}

}  // namespace telesplat::data
