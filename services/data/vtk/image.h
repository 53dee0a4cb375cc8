// Images of VTK's files (vti, pvti, legacy structured points): one array of numbers on a regular grid.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "services/data/base/companions.h"
#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

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
