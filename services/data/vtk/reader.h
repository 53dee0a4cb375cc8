// Reads VTK's files: XML (vti, vtp, vtr, vts, vtu, their parallel forms, multi-block, pvd) and legacy ones (vtk). Safe
// for hostile files: no memory is allocated by a claim beyond the file's size.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/mapped_file.h"
#include "services/data/base/mesh.h"
#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// Returns a file's kind, by its content: "vti", "vtp", "vtr", "vts", "vtu", the same after a p, "vtm" (all kinds of
/// composite files), "pvd", "vtk" (legacy); "": not a VTK file, or of an unknown kind.
std::string kind_of(std::string_view content);
/// True for an image, which is shown as a volume: "vti", "pvti", and legacy structured points.
bool is_image(std::string_view content);
/// True for the results of kind_of() that are shown as meshes.
bool is_mesh_kind(std::string_view kind);

/// Returns the active scalars that an XML file marks: of its points, else of its cells; empty: it marks no scalars, or
/// is a composite file. Does not read its arrays.
std::string active_scalars(std::string_view content);

/// Returns the files that this one names, and the files that those name, relative to `path`'s folder. Empty if they
/// cannot be read.
std::vector<std::string> named_files(std::string_view content, const std::string& path, Companions& companions);

/// Reads all data sets that a file holds or names. notes: lines for users, which begin with `path`; of several time
/// steps only the first is read. `content` and companions must outlive the data sets. For this folder: throws Refusal.
std::vector<DataSet> read_data_sets(std::string_view content, const std::string& path, Companions& companions,
                                    std::vector<std::string>& notes);

/// Reads a file as a mesh: surfaces_of() its data sets; arrays of points and cells, and the values of the one that
/// `array` names (empty: none); normals of points; colours from arrays of points or cells: 8-bit scalars of three or
/// four components, or arrays with names of colours.
Result<Mesh> read_mesh(std::string_view content, const std::string& path, Companions& companions,
                       const std::string& array);

/// The description of a file's image, without its values.
struct Image {
  std::array<int64_t, 6> extent{};  ///< in points
  glm::dmat4 index_to_data{1.0};    ///< for points
  std::vector<std::string> arrays;  ///< all arrays of numbers, those of points first
  std::string array;                ///< the array to be read; empty: the image has no array
  bool of_cells = false;            ///< it has one value per cell
  StoredType type = StoredType::kU8;
  size_t components = 1;
  bool text = false, packed = false;  ///< encoding of its values in the file
  uint64_t bytes = 0;                 ///< sum over all of its files
};

/// Reads an image's description. array: the wanted one; empty: the active scalars, else the first of one component, of
/// points, else of cells. Error, beginning with `path`: not an image, or without that array; its files are unreadable.
Result<Image> read_image_header(std::string_view content, const std::string& path, Companions& companions,
                                const std::string& array);

/// Returns the values, first axis fastest, native byte order. Error: values are damaged, or missing in part; a piece
/// has another type. Precondition: memory can hold the extent.
Result<std::vector<std::byte>> read_image(const Image& image, std::string_view content, const std::string& path,
                                          Companions& companions);

}  // namespace telesplat::data::vtk
