// Inside services/data/vtk: the cells of data sets, their faces, and the surface that is visible from outside.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// Nodes of a face in VTK's order: corners, then middles of edges (of all, or only of those between corners 0 and 1 and
/// between 2 and 3), then the centre.
struct FaceRow {
  uint8_t corners = 0, middles = 0, nodes = 0;
  uint8_t node[9] = {};  ///< numbers of the cell's nodes
};

/// A type of cells. Surface cells have one face: themselves. Polygons, strips and polyhedra have no rows.
struct CellKind {
  int dimension = 0;
  size_t nodes = 0;            ///< least number
  bool corners_alone = false;  ///< it is curved, and drawn by its corners only
  std::vector<FaceRow> faces;
};
inline constexpr uint8_t kPolyVertex = 2, kPolyLine = 4, kStrip = 6, kPolygon = 7, kQuad = 9, kHexahedron = 12,
                         kQuadraticPolygon = 36, kPolyhedron = 42;

/// Returns the kind of one of VTK's type numbers ("VTK File Formats"); null: not known. nodes: the cell's number of
/// nodes; Lagrange cells of second order then have faces with all their nodes.
const CellKind* kind_of_cell(uint8_t type, size_t nodes);

/// One face of a cell: its nodes as points of the data set.
struct FacePoints {
  std::span<const uint32_t> corners, middles;
  std::span<const uint32_t> centre;  ///< one point, or empty
};

/// Cuts faces into triangles; reuses its memory.
class FaceCutter {
 public:
  explicit FaceCutter(const DataSet& set) : set_(set) {}
  /// Appends three points per triangle to `out`. Curved faces are divided at their middle nodes, as VTK's geometry
  /// filter does at its first level; without a centre, the quadrilateral of the middles gets its shorter diagonal.
  void cut(const FacePoints& face, std::vector<uint32_t>& out);

 private:
  void cut_polygon_of(std::span<const uint32_t> corners, std::vector<uint32_t>& out);

  const DataSet& set_;
  std::vector<glm::dvec3> positions_;
  std::vector<uint32_t> local_, cut_;
};

enum class CellState : uint8_t { kShown, kGhost, kAbsent };

class CellReader {
 public:
  explicit CellReader(const DataSet& set);

  /// Error: a cell lacks points or faces.
  void check() const;
  size_t count() const { return states_.size(); }
  uint8_t type(size_t cell) const { return set_.structured ? structured_type_ : set_.types[cell]; }
  /// Null: the cell's type is not known.
  const CellKind* kind(size_t cell) const;
  CellState state(size_t cell) const { return states_[cell]; }
  size_t face_count(size_t cell) const;
  /// Valid until the next call. Precondition: check() passed; cell and face exist.
  FacePoints face(size_t cell, size_t face);
  /// True if that face of a volume cell looks into it, by the sign of the cell's own volume.
  bool looks_inward(size_t cell, size_t face);
  /// Structured data sets with three axes: the number of cells along each.
  std::array<size_t, 3> sides() const { return sides_; }

  /// Returns twice a polygon's area, times its normal.
  glm::dvec3 area_vector(std::span<const uint32_t> corners) const;

 private:
  std::span<const uint32_t> nodes(size_t cell);
  double volume_under(std::span<const uint32_t> corners, const glm::dvec3& from) const;
  void orient(size_t cell);
  void orient_polyhedron(size_t cell);

  const DataSet& set_;
  std::vector<CellState> states_;
  std::array<size_t, 3> sides_{};
  uint8_t structured_type_ = 0;
  std::vector<size_t> steps_;  // steps between points along the axes that are longer than one point
  std::array<uint32_t, 8> corners_;
  std::vector<uint32_t> face_;
  size_t oriented_ = ~size_t{0};
  std::vector<bool> inward_;  // per face of cell oriented_
};

/// Triangles of a data set.
struct Surface {
  std::vector<uint32_t> corners;  ///< three points of the data set for each triangle
  std::vector<uint32_t> cells;    ///< for each triangle the cell whose data it has
};

/// Counts cells that are not shown, or not exactly, for notes to users.
struct SurfaceNotes {
  uint64_t points_and_lines = 0, straightened = 0, ghosts = 0, unknown = 0;
};

/// Returns the surfaces of data sets that form one whole, one each: their surface cells, and the faces of volume cells
/// that no second cell shares. Faces are identified by their points, between data sets by their points' positions.
/// Faces of volume cells look outward, for any orientation of the cell. A surface cell on a volume cell's outer face is
/// shown once, with its own data. Ghost cells (vtkGhostType: duplicates) cover other cells' faces, but are not shown;
/// hidden and refined cells, and cells with hidden points, count as absent. Error: a cell with too few points or with
/// missing points.
std::vector<Surface> surfaces_of(std::span<const DataSet> sets, SurfaceNotes& notes);

}  // namespace telesplat::data::vtk
