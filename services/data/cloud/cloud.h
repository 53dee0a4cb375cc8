// A cloud of points as readers fill it, and as the mesh that is shown: one square a point, in the plane of the points
// around it.
#pragma once

#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <string>
#include <vector>

#include "common/scene/base.h"
#include "services/data/base/mesh.h"
#include "services/data/base/random_mesh.h"

namespace telesplat::data {

inline constexpr uint64_t kMaxPoints = kMaxTriangles / 2 - 1;

struct Cloud {
  /// A mesh without triangles. Its format says " points": "LAS 1.4 points (format 7)". A point that is not finite is
  /// left out later.
  Mesh points;
  /// Points from `first` on were seen from here.
  struct Scan {
    size_t first = 0;
    glm::dvec3 scanner{0};
  };
  std::vector<Scan> scans;
  bool z_up = false;  ///< it is known that z points up
};

/// Where a cloud is seen from.
struct CloudView {
  std::vector<Cloud::Scan> scans;
  geometry::DBox box;
  double extent = 0;  ///< the box's largest side
  bool from_above = false;

  glm::dvec3 middle() const { return box.lo + 0.5 * box.size(); }  // lo + hi may not be finite
  /// Direction of length 1 from a point to its scanner, or as told below.
  glm::dvec3 towards(size_t point, const glm::dvec3& at) const;
};

using scene::is_cloud;

/// Point n has the vertices 4 n to 4 n + 3 and the triangles 2 n and 2 n + 1.
///     Normals are the file's, else those of the plane through the nearest ten points (least squares). They look
/// towards the scanner; where it is not known, or far outside, up if z points up or the cloud is flat in z; else away
/// from the middle of the cloud's box.
///     A side is 1.5 times the distance to neighbours, so that squares of a regular grid meet however they are turned;
/// half as long where the points around are no surface (wires, twigs), and at most twice as long as those of
/// points nearby, so that strays stay small. Where they are no surface, the squares are shaded as if they were turned
/// half of the way to where the cloud is seen from: leaves do not glitter.
class SquareCloud final : public RandomMesh {
 public:
  /// Error texts start with `name`: no points, more than kMaxPoints, all at one place.
  static Result<std::shared_ptr<const SquareCloud>> make(Cloud&& cloud, const std::string& name);

  bool corners(uint64_t first, size_t count, uint32_t* out) const override;
  glm::dvec3 position(uint64_t vertex) const override;
  glm::vec3 normal(uint64_t vertex) const override;
  uint32_t colour(uint64_t vertex) const override { return points_.colours[vertex / 4]; }
  float scalar(uint64_t vertex) const override { return points_.scalars[vertex / 4]; }
  /// Half a side of a point's square, in Mesh::positions' unit.
  float half(size_t point) const { return std::abs(halves_[point]); }

  /// The same as a mesh.
  Mesh mesh() const;

 private:
  SquareCloud(Facts facts, Mesh&& points, CloudView&& view, std::vector<float> halves)
      : RandomMesh(std::move(facts)), points_(std::move(points)), view_(std::move(view)), halves_(std::move(halves)) {}

  Mesh points_;
  CloudView view_;
  std::vector<float> halves_;  // negative: the points around are no surface
};

}  // namespace telesplat::data
