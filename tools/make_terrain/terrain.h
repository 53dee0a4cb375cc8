// Made-up land for demos: a caldera with a lake, coloured by height and slope. It is made band by band, so that files
// may be larger than the memory.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/core/result.h"

namespace telesplat::terrain {

/// At most about 2^30 vertices: readers that know only signed indices can have them.
inline constexpr uint64_t kMinTriangles = 2, kMaxTriangles = uint64_t{1} << 31;

/// Full rows of cells with two triangles each, then a shorter row with the rest of the triangles.
struct Grid {
  uint64_t triangles, columns, rows, rest;
  explicit Grid(uint64_t triangles);
  uint64_t vertices() const { return (rows + 1) * (columns + 1) + (rest == 0 ? 0 : rest / 2 + 1); }
  uint64_t vertex_rows() const { return rows + 1 + (rest != 0); }
};

#pragma pack(push, 1)
struct Vertex {
  float position[3];  ///< metres; x east, y north, z up; the land begins at (0, 0)
  uint8_t colour[3];  ///< red, green, blue
};
struct Face {
  uint8_t corners;     ///< 3
  uint32_t vertex[3];  ///< counter-clockwise from above
};
#pragma pack(pop)

/// Fraction done, called on the caller's thread; false: give up.
using Progress = std::function<bool(double fraction)>;
inline const Progress kGoOn = [](double) { return true; };

/// The land of a seed with exactly this many triangles. The large forms do not depend on the number of triangles. The
/// same arguments make the same land on any number of threads. Preconditions: kMinTriangles <= triangles <=
/// kMaxTriangles; first_row <= last_row <= grid().vertex_rows().
class Terrain {
 public:
  Terrain(uint64_t triangles, uint64_t seed, const Progress& progress = kGoOn);
  const Grid& grid() const { return grid_; }
  /// The vertices of the rows [first_row, last_row).
  std::vector<Vertex> vertices(uint64_t first_row, uint64_t last_row) const;
  /// The triangles whose first vertex is in these rows.
  std::vector<Face> faces(uint64_t first_row, uint64_t last_row) const;

 private:
  Grid grid_;
  double step_m_;
  std::shared_ptr<const class Land> land_;
};

/// Size of write_ply()'s file.
uint64_t ply_bytes(const Grid& grid);

/// Error: the disk of `path` has less than `bytes` free, or there is no such folder.
Status check_room(const std::string& path, uint64_t bytes);

/// Binary little-endian PLY with float positions and uchar colours. The file appears whole or not at all. band_rows:
/// rows of vertices in memory at a time. Errors name the path.
Status write_ply(const Terrain& terrain, const std::string& path, const Progress& progress = kGoOn,
                 uint64_t band_rows = 64);

}  // namespace telesplat::terrain
