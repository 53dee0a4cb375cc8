// A mesh whose vertices and triangles can be read here and there, so that nothing holds it whole.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/scene/arrays.h"
#include "common/scene/placement.h"
#include "services/data/base/mapped_file.h"
#include "services/data/base/stored_type.h"

namespace telesplat::data {

/// Threads may read at once.
class RandomMesh {
 public:
  struct Facts {
    std::string format;                     ///< Mesh::format
    uint64_t vertices = 0, triangles = 0;   ///< numbers that vertices and triangles have are below
    uint64_t unused = 0;                    ///< numbers that have no vertex
    bool smooth = false;                    ///< Mesh::smooth
    bool normals = false, colours = false;  ///< vertices have them
    bool scalars = false;                   ///< vertices have values of the requested array
    std::vector<scene::ArrayInfo> arrays;   ///< Mesh::arrays
    std::vector<std::string> notes;         ///< Mesh::notes
    scene::Coordinates coordinates;         ///< Mesh::coordinates
  };
  virtual ~RandomMesh() = default;
  const Facts& facts() const { return facts_; }
  uint64_t triangles() const { return facts_.triangles; }
  uint64_t vertices() const { return facts_.vertices; }

  /// First corner of a number that has no triangle.
  static constexpr uint32_t kNoTriangle = ~uint32_t{0} - 1;
  /// Writes the vertices of the triangles [first, first + count), three each, which may not exist. Returns false if a
  /// triangle has another number of corners.
  virtual bool corners(uint64_t first, size_t count, uint32_t* out) const = 0;
  /// Positions in the file's units. Preconditions here and below: the vertex exists and has what is read.
  virtual glm::dvec3 position(uint64_t vertex) const = 0;
  virtual glm::vec3 normal(uint64_t vertex) const = 0;
  virtual uint32_t colour(uint64_t vertex) const = 0;  ///< 0x00RRGGBB
  virtual float scalar(uint64_t vertex) const = 0;     ///< Mesh::scalars
  /// Frees memory of this process that reading took; what is read again is fetched again.
  virtual void drop_pages() const {}

 protected:
  explicit RandomMesh(Facts facts) : facts_(std::move(facts)) {}
  Facts facts_;
};

/// A mesh in a mapped file where all vertices, and all triangles, take the same room.
class RecordMesh final : public RandomMesh {
 public:
  /// A number of each record of a kind.
  struct Field {
    size_t at = 0;  ///< in the record
    StoredType type = StoredType::kF32;
  };
  using Fields = std::array<Field, 3>;

  struct Layout {
    size_t vertices_at = 0, vertex_bytes = 0;     ///< the first record, and the size of each
    size_t triangles_at = 0, triangle_bytes = 0;  ///< likewise
    Field corners;                                ///< the number of corners, which is three
    Field first_corner;                           ///< the first of three numbers behind each other
    Fields position;                              ///< a vertex has it, and the following
    Fields normal, colour;                        ///< colour: bytes
    Field scalar;
    double scalar_origin = 0;  ///< to be subtracted from it
    bool swap = false;         ///< the file has the other byte order
  };

  /// Precondition: all records of the layout lie in the file.
  RecordMesh(std::shared_ptr<const MappedFile> file, Facts facts, const Layout& layout);
  void choose_scalar(const Field& field, double origin) {
    layout_.scalar = field, layout_.scalar_origin = origin, facts_.scalars = true;
  }
  void set_arrays(const std::vector<scene::ArrayInfo>& arrays) { facts_.arrays = arrays; }

  bool corners(uint64_t first, size_t count, uint32_t* out) const override;
  glm::dvec3 position(uint64_t vertex) const override;
  glm::vec3 normal(uint64_t vertex) const override { return three(vertex, layout_.normal); }
  uint32_t colour(uint64_t vertex) const override;
  float scalar(uint64_t vertex) const override;
  void drop_pages() const override { file_->drop_pages(); }
  /// Any number of a vertex.
  double number(uint64_t vertex, const Field& field) const;

 private:
  glm::dvec3 three(uint64_t vertex, const Fields& fields) const;

  std::shared_ptr<const MappedFile> file_;
  Layout layout_;
  bool has_floats_;  // the usual file: positions are floats behind each other, in this machine's order
};

}  // namespace telesplat::data
