// Volumes as VTK has them. In the program telesplat-import only: VTK may print, throw or crash on hostile files.
#pragma once

#include <vtkImageData.h>
#include <vtkSmartPointer.h>

#include <string>

#include "services/data/base/progress.h"
#include "services/data/base/volume.h"
#include "services/data/volume/formats/header.h"

namespace telesplat::data {

/// A volume whose image lies in index space: origin 0, spacing 1, extent from 0, no direction; one component of point
/// data, stored values. What VTK computes from it (isosurfaces) has index coordinates: points become
/// header.index_to_data * (p, 1); triangles turn round where its determinant is negative; normals go by the inverse
/// transpose. value = stored * header.scale + header.offset.
struct VtkVolume {
  vtkSmartPointer<vtkImageData> image;
  VolumeFileHeader header;  ///< size and stored type are the image's; byte order and payload mean nothing
};

/// Reads a file that VTK reads (nifti, vti). `header`: read_volume_header(path). Error: what VTK complained of; an
/// image that is not as the header says.
Result<VtkVolume> read_vtk_volume(const VolumeFileHeader& header, const std::string& path,
                                  const ReadProgress& progress);

}  // namespace telesplat::data
