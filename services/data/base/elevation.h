// Elevation rasters (GeoTIFF, HGT, 16-bit PNG and others that GDAL reads) as coloured height fields.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/data/base/mesh.h"
#include "services/data/base/random_mesh.h"

namespace telesplat::data {

inline constexpr int64_t kMaxRasterSamples = int64_t{1} << 26;  ///< vertices; larger rasters are read coarser

/// z_scale multiplies heights; 0: 1 where the raster is georeferenced, else a factor that makes the relief a seventh of
/// the longer side.
struct ElevationOptions {
  double z_scale = 0;
  std::string texture;  ///< an image draped over the raster (orthophoto), path; empty: coloured by height
  int64_t most_samples = kMaxRasterSamples;
};

/// A regular grid of heights. Sample (column, row) stands at first + column * along_row + row * along_column: east and
/// north, metres (or pixels, if the file has no position).
struct ElevationRaster {
  int width = 0, height = 0;
  glm::dvec2 first{0}, along_row{1, 0}, along_column{0, -1};
  bool georeferenced = false;      ///< plan and heights have one unit
  scene::Coordinates coordinates;  ///< the file's, without z_scale
  int step = 1;                    ///< every step-th sample of the file
  std::vector<float> heights;      ///< row by row, metres; NaN: no data
  std::vector<uint32_t> colours;   ///< from a texture, 0x00RRGGBB, one per sample; empty: no texture
  std::vector<std::string> notes;  ///< as Mesh::notes
};

/// The mesh of a raster: two triangles per cell whose four corners have data, one where three have. x east, y north, z
/// up. Colours are the texture's, or tints by height: blue at and below sea level where the data have a coast, green to
/// brown to white over the 2nd to 98th percentile of the rest.
class ElevationGrid final : public RandomMesh {
 public:
  /// Range of the heights.
  struct Relief {
    float lo = 0, hi = 1;            ///< all heights
    float land_lo = 0, land_hi = 1;  ///< percentiles of those of land
    bool sea = false;
  };
  /// Error, starting with `name`: fewer than 2 x 2 samples, no data, a z_scale that is not finite.
  static Result<std::shared_ptr<const ElevationGrid>> make(ElevationRaster raster, const ElevationOptions& options,
                                                           const std::string& name);
  bool corners(uint64_t first, size_t count, uint32_t* out) const override;
  glm::dvec3 position(uint64_t vertex) const override;  ///< not finite: no data
  glm::vec3 normal(uint64_t) const override { return glm::vec3(0); }
  uint32_t colour(uint64_t vertex) const override;
  float scalar(uint64_t) const override { return 0; }

 private:
  using Triangle = std::array<uint32_t, 3>;
  ElevationGrid(Facts facts, ElevationRaster raster, const Relief& relief, double z_scale)
      : RandomMesh(std::move(facts)), raster_(std::move(raster)), relief_(relief), z_scale_(z_scale) {}
  Triangle triangle(uint64_t t) const;

  const ElevationRaster raster_;
  const Relief relief_;
  const double z_scale_;
};

/// Makes the whole mesh. Errors: those of ElevationGrid::make(); no cell has data.
Result<Mesh> elevation_mesh(ElevationRaster raster, const ElevationOptions& options, const std::string& name);

}  // namespace telesplat::data
