// Reading VTK's files: XML (vti, vtp, vtr, vts, vtu, their parallel forms, multi-block, pvd) and legacy ones (vtk).
// Hostile ones too: nothing is allocated by a claim that the file does not bear out.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// What a file is, by its content: "vti", "vtp", "vtr", "vts", "vtu", those with a p before them, "vtm" (all kinds of
/// composite files), "pvd", "vtk" (legacy); "" if it is none of VTK's, or of a kind that is not known.
std::string kind_of(std::string_view content);
/// Whether it is an image, which is shown as a volume: "vti", "pvti", and legacy structured points.
bool is_image(std::string_view content);
/// Whether kind_of() gives this for files that are shown as meshes.
bool is_mesh_kind(std::string_view kind);

/// The active scalars that an XML file marks: of its points, else of its cells; empty: it marks none, or is a composite
/// file. Its arrays are not read.
std::string active_scalars(std::string_view content);

/// Files that this one names, and those that these name, as they are named from `path`'s folder. None where they
/// cannot be read.
std::vector<std::string> named_files(std::string_view content, const std::string& path, Companions& companions);

/// All data sets that a file holds or names. notes: lines for people, which begin with `path`; of several time steps
/// the first is read. `content` and companions must stay as long as the data sets. For this folder: throws Refusal.
std::vector<DataSet> read_data_sets(std::string_view content, const std::string& path, Companions& companions,
                                    std::vector<std::string>& notes);

/// A file as a mesh: surfaces_of() its data sets; arrays of points and cells, and the values of the one that `array`
/// names (empty: none); normals of points; colours from arrays of points or cells: 8-bit scalars of three or four
/// components, or arrays with names of colours.
Result<Mesh> read_mesh(std::string_view content, const std::string& path, Companions& companions,
                       const std::string& array);

/// What a file's words say of its image.
struct Image {
  std::array<int64_t, 6> extent{};  ///< of points
  glm::dmat4 index_to_data{1.0};    ///< of points
  std::vector<std::string> arrays;  ///< all of numbers, of points first
  std::string array;                ///< the one that is read; empty: the image has no array
  bool of_cells = false;            ///< it has one value a cell
  StoredType type = StoredType::kU8;
  size_t components = 1;
  bool text = false, packed = false;  ///< how its values stand in the file
  uint64_t bytes = 0;                 ///< of all files that it is in
};

/// array: which one; empty: the active scalars, else the first of one component, of points, else of cells.
/// Error, beginning with `path`: it is no image, or has no such array; files that it names cannot be read.
Result<Image> read_image_header(std::string_view content, const std::string& path, Companions& companions,
                                const std::string& array);

/// The values, first axis fastest, native byte order. Error: values are damaged, or missing in part; a piece that is
/// of another type. Precondition: extents that memory holds.
Result<std::vector<std::byte>> read_image(const Image& image, std::string_view content, const std::string& path,
                                          Companions& companions);

}  // namespace telesplat::data::vtk
