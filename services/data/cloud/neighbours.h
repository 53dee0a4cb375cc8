// Finds the nearest points of points: a k-d tree whose leaves hold a few points each. Source: J. Friedman, J. Bentley,
// R. Finkel, "An Algorithm for Finding Best Matches in Logarithmic Expected Time", 1977.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

namespace telesplat::data {

class Neighbours {
 public:
  static constexpr int kMost = 10;  ///< neighbours of a point
  struct Point {
    glm::vec3 at;
    uint32_t index;  ///< in the caller's order
  };
  struct Found {
    float squared = 0;   ///< distance
    uint32_t place = 0;  ///< in points()
  };
  using List = std::array<Found, kMost>;

  /// Sorts the points into a tree; takes all cores. Precondition: coordinates are finite.
  explicit Neighbours(std::vector<Point> points);
  /// The points in the tree's order: those that follow each other lie close together.
  const std::vector<Point>& points() const { return points_; }
  /// Finds the neighbours of points()[place], nearest first; returns their number. Any thread.
  int nearest(uint32_t place, List& out) const;

 private:
  struct Split {
    float at = 0;
    uint8_t axis = 0;
  };
  struct Search;
  void sort(size_t node, size_t begin, size_t end);
  void visit(size_t node, size_t begin, size_t end, const glm::vec3& away, Search& search) const;

  std::vector<Point> points_;
  std::vector<Split> splits_;  // children of node n: 2 n + 1 and 2 n + 2
};

}  // namespace telesplat::data
