// Data sets of VTK's XML files.
#pragma once

#include "services/data/vtk/xml_file.h"

namespace telesplat::data::vtk {

/// The pieces of a file that holds points and arrays itself: one data set each. Error, naming the file: an array that
/// is cut, damaged or missing, cells that do not fit.
Result<std::vector<DataSet>> read_pieces(const XmlFile& file);

/// The placement of an image: where its index (i, j, k) lies.
glm::dmat4 placement_of(pugi::xml_node image);
/// Six whole numbers, "0 9 0 9 0 0". False: they are none.
bool parse_extent(std::string_view text, std::array<int64_t, 6>& out);
/// All arrays of numbers in an element <PointData> or <CellData>; one that cannot be read is an error.
Result<Attributes> read_attributes(const XmlFile& file, pugi::xml_node element, size_t tuples);

}  // namespace telesplat::data::vtk
