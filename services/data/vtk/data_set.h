// Data sets as VTK's files hold them: points, cells, arrays.
#pragma once

#include <array>
#include <cstdint>
#include <cstring>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <span>
#include <string>
#include <vector>

#include "services/data/base/refusal.h"
#include "services/data/base/stored_type.h"
#include "services/data/base/text_scanner.h"

namespace telesplat::data::vtk {

/// Numbers in native byte order: tuples of `components` each.
struct Array {
  std::string name, unit;
  StoredType type = StoredType::kF32;
  size_t components = 1;
  size_t values = 0;                ///< number of values, all components counted
  const std::byte* data = nullptr;  ///< unaligned; in `owned`, or in the file, which must outlive the array
  std::vector<std::byte> owned;

  Array() = default;
  Array(Array&&) = default;
  Array& operator=(Array&&) = default;
  size_t tuples() const { return values / components; }
  double at(size_t value) const {
    return with_type(type, [&](auto v) {
      std::memcpy(&v, data + value * sizeof v, sizeof v);
      return double(v);
    });
  }
  /// Allocates this many values; the caller then writes to owned.data().
  void own(size_t count) {
    owned.resize(count * stored_bytes(type));
    data = owned.data(), values = count;
  }
  void swap_bytes();  ///< to the other byte order; copies values that lie in a file
};

struct Attributes {
  std::vector<Array> arrays;
  std::string scalars, normals;  ///< names of the active arrays; empty: no array is

  const Array* find(std::string_view name) const;
};

/// Lists of point numbers, one per cell (or face).
struct Cells {
  std::vector<size_t> begins{0};  ///< one entry more than cells
  std::vector<uint32_t> points;

  size_t size() const { return begins.size() - 1; }
  void add(std::span<const uint32_t> corners) {
    points.insert(points.end(), corners.begin(), corners.end());
    begins.push_back(points.size());
  }
  std::span<const uint32_t> operator[](size_t i) const {
    return std::span(points).subspan(begins[i], begins[i + 1] - begins[i]);
  }
};

struct DataSet {
  std::string name;  ///< its file's name, for error texts
  /// A structured data set (image, rectilinear or structured grid): the first and last point of each axis; points go
  /// along the first axis fastest, cells likewise. Other data sets list their cells in `cells`.
  bool structured = false;
  std::array<int64_t, 6> extent{0, -1, 0, -1, 0, -1};
  bool image = false;  ///< its points are index_to_data * (i, j, k, 1)
  glm::dmat4 index_to_data{1.0};
  std::array<Array, 3> axes;  ///< rectilinear grids: coordinates along each axis
  Array points;               ///< other data sets: three components
  Cells cells;
  std::vector<uint8_t> types;       ///< per cell: VTK's number ("VTK File Formats")
  Cells faces;                      ///< faces of polyhedra
  std::vector<size_t> face_begins;  ///< per cell, its faces: from face_begins[cell] to [cell + 1]; empty: no polyhedra
  Attributes point_data, cell_data;

  int64_t side(size_t axis) const { return extent[2 * axis + 1] - extent[2 * axis] + 1; }  ///< in points
  size_t point_count() const;
  size_t cell_count() const;
  glm::dvec3 point(size_t i) const;
};

// The functions below throw a Refusal that begins with `name`.

/// Checks an extent: sides of at least 1, points that 32 bits can number, and at most 1032 points per byte of the file.
void check_extent(const std::array<int64_t, 6>& extent, size_t file_bytes, const std::string& name);

/// Reads numbers of the array's type, up to `most` or a word that is not a number. Memory grows with the text.
void parse_numbers(TextScanner& in, size_t most, Array& out);

/// Converts integers to indices; a negative or too large one becomes ~0.
std::vector<uint32_t> indices_of(const Array& array);
/// Converts integers to cell types.
std::vector<uint8_t> types_of(const Array& array);
/// Appends cells of one type to the data set's.
void append_cells(Cells cells, uint8_t type, DataSet& set);

/// Makes cells from point numbers and the end of each cell's part of them. Refuses ends that fall or lie beyond the
/// numbers, and numbers that are not below `points`.
Cells make_cells(const Array& ids, const Array& ends, bool with_first, size_t points, const std::string& name);

/// Makes cells from the older layout: each cell's count, then its point numbers. `count`: claimed number of cells.
Cells make_listed_cells(const Array& list, size_t count, const std::string& name);

/// Refuses a point number that is not below `points`.
void check_ids(std::span<const uint32_t> ids, size_t points, const std::string& name);

/// Adds the faces of a polyhedron from a stream: their number, then each face's count and points. Point numbers are not
/// checked. Refuses a stream that is cut off.
void add_face_stream(std::span<const uint32_t> stream, DataSet& set);

}  // namespace telesplat::data::vtk
