// VTK's legacy files: "# vtk DataFile Version 1.0" to 5.1, text and binary.
// Source: vtk.org, "VTK File Formats", and VTK's vtkDataReader.
#pragma once

#include <string>
#include <string_view>

#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// The kind of data set, in capitals: "POLYDATA", "STRUCTURED_POINTS"; empty: it is no legacy file.
std::string legacy_kind(std::string_view content);

/// The data set with all its arrays; those whose size does not fit are left out. Without `values` arrays have sizes,
/// but no data; of structured points alone. Error, naming the file, and the line of text: it is cut, claims more than
/// it holds, or is of an unknown kind.
Result<DataSet> read_legacy(std::string_view content, const std::string& name, bool values = true);

}  // namespace telesplat::data::vtk
