// The faces of VTK's cells, and how faces become triangles.
#pragma once

#include <cstdint>
#include <glm/vec3.hpp>
#include <span>
#include <vector>

#include "services/data/vtk/data_set.h"

namespace telesplat::data::vtk {

/// Nodes of a face in VTK's order: corners, then middles of edges (of all, or of those between corners 0 and 1 and
/// between 2 and 3), then the centre.
struct FaceRow {
  uint8_t corners = 0, middles = 0, nodes = 0;
  uint8_t node[9] = {};  ///< of the cell
};

/// What a type of cells is. Surface cells have one face: themselves. Polygons, strips and polyhedra have no rows.
struct CellKind {
  int dimension = 0;
  size_t nodes = 0;            ///< at least
  bool corners_alone = false;  ///< it is curved, and shown by its corners
  std::vector<FaceRow> faces;
};
inline constexpr uint8_t kPolyVertex = 2, kPolyLine = 4, kStrip = 6, kPolygon = 7, kQuad = 9, kHexahedron = 12,
                         kQuadraticPolygon = 36, kPolyhedron = 42;

/// Returns the kind that one of VTK's numbers means ("VTK File Formats"); null: it is not known. nodes: Lagrange's
/// cells of second order have all their nodes.
const CellKind* kind_of_cell(uint8_t type, size_t nodes);

/// One face of a cell: its nodes as points of the data set.
struct FacePoints {
  std::span<const uint32_t> corners, middles;
  std::span<const uint32_t> centre;  ///< one, or none
};

/// Cuts faces into triangles; keeps its memory from one to the next.
class FaceCutter {
 public:
  explicit FaceCutter(const DataSet& set) : set_(set) {}
  /// Appends three points a triangle to `out`. Curved faces are divided at their middle nodes, as VTK's geometry filter
  /// does at its first level; where there is no centre, the quadrilateral of the middles goes by its shorter diagonal.
  void cut(const FacePoints& face, std::vector<uint32_t>& out);

 private:
  void cut_polygon_of(std::span<const uint32_t> corners, std::vector<uint32_t>& out);

  const DataSet& set_;
  std::vector<glm::dvec3> positions_;
  std::vector<uint32_t> local_, cut_;
};

}  // namespace telesplat::data::vtk
