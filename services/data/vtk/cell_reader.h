// The cells of a data set one by one, structured ones included.
#pragma once

#include <vector>

#include "services/data/vtk/cell_faces.h"

namespace telesplat::data::vtk {

enum class CellState : uint8_t { kShown, kGhost, kAbsent };

class CellReader {
 public:
  explicit CellReader(const DataSet& set);

  /// Error: a cell lacks points or faces.
  Status check() const;
  size_t count() const { return states_.size(); }
  uint8_t type(size_t cell) const { return set_.structured ? structured_type_ : set_.types[cell]; }
  /// Null: it is not known.
  const CellKind* kind(size_t cell) const;
  CellState state(size_t cell) const { return states_[cell]; }
  size_t face_count(size_t cell) const;
  /// Valid until the next call. Precondition: check(), cell and face are there.
  FacePoints face(size_t cell, size_t face);
  /// Whether that face of a volume cell looks into it, by the sign of the cell's own volume.
  bool looks_inward(size_t cell, size_t face);
  /// Structured data sets of three axes: the cells along each.
  std::array<size_t, 3> sides() const { return sides_; }

  /// Twice a polygon's area, times its normal.
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
  std::vector<size_t> steps_;  // of points along the axes that are longer than one point
  std::array<uint32_t, 8> corners_;
  std::vector<uint32_t> face_;
  size_t oriented_ = ~size_t{0};
  std::vector<bool> inward_;  // the faces of cell oriented_
};

}  // namespace telesplat::data::vtk
