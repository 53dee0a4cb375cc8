// Projects the nodes of an octree into a view: for known_empty_carve.cpp and known_empty_project.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/vec3.hpp>

#include "common/geometry/camera.h"
#include "common/points/point_model.h"

namespace telesplat::packer {

/// Bounds of a cube's projection. If a cube reaches before the near plane: bounds of the part behind the plane.
struct NodeView {
  float left = 0, right = 0, top = 0, bottom = 0;  ///< pixels
  float nearest_m = 0, farthest_m = 0;
  bool crosses_near = false, behind = false;  ///< behind: it lies wholly before the near plane, invisible

  /// True if about half a pixel large: its children are not visited.
  bool small() const { return length() <= 0.6f; }
  float length() const { return std::max(right - left, bottom - top); }
};

/// A cube's corners, in pixels. Numbers of corners that an edge joins differ in one bit.
struct NodeCorners {
  std::array<float, 8> x, y;
};

/// Returns a pixel position as an integer in [0, limit]; NaN gives 0.
inline int to_pixel(float v, int limit) {
  if (!(v > 0)) return 0;
  return v < static_cast<float>(limit) ? static_cast<int>(v) : limit;
}

class NodeProjection {
 public:
  static constexpr int kLevels = 9, kLast = kLevels - 2;

  NodeProjection(const geometry::Camera& camera, const points::OctreeGrid& grid)
      : near_m_(static_cast<float>(camera.near_m)) {
    const geometry::Camera::PixelTransform t = camera.room_to_pixel();
    const auto at = [&](const glm::dvec4& p) {
      return glm::vec3(glm::dvec3(glm::dot(t.x, p), glm::dot(t.y, p), glm::dot(t.w, p)));
    };
    const double size = grid.leaf_size * (1 << grid.depth);
    root_ = at({grid.lo, 1});
    for (int level = 0; level < kLevels; ++level) {
      const double side = size / (1 << level), inner = std::max(side - 0.5 * size / (1 << kLast), 0.0);
      Level& whole = levels_[static_cast<size_t>(level)];
      Level& inside = inner_[static_cast<size_t>(level)];
      for (int axis = 0; axis < 3; ++axis) {
        glm::dvec4 along(0);
        along[axis] = 1;
        whole.add(static_cast<size_t>(axis), at(along * side));
        inside.add(static_cast<size_t>(axis), at(along * inner));
      }
    }
  }

  /// False: the camera is too far away, or its focal length too great, for floats.
  bool usable() const {
    const auto sane = [](const glm::vec3& v) {
      return std::abs(v.x) < 1e12f && std::abs(v.y) < 1e12f && std::abs(v.z) < 1e12f;
    };
    return sane(root_) && sane(levels_[0].reach);
  }
  /// Lower corner of the whole cube, homogeneous pixels (x w, y w, w).
  const glm::vec3& root() const { return root_; }
  /// Returns the corner of a node's child: bit 0 of `child` stands for x, bit 1 for y, bit 2 for z.
  glm::vec3 child(const glm::vec3& corner, int child_level, int child) const {
    return add(corner, levels_[static_cast<size_t>(child_level)].edges, child);
  }
  /// Returns a node's middle, homogeneous pixels.
  glm::vec3 middle(int level, const glm::vec3& corner) const {
    return corner + levels_[static_cast<size_t>(level)].middle;
  }
  NodeView look(int level, const glm::vec3& corner) const {
    return look(corner + levels_[static_cast<size_t>(level)].middle, levels_[static_cast<size_t>(level)]);
  }
  /// Returns the view of a node without a quarter of a node of level kLast on each side. Precondition: the node does
  /// not cross the near plane.
  NodeView look_inside(int level, const glm::vec3& corner) const {
    return look(corner + levels_[static_cast<size_t>(level)].middle, inner_[static_cast<size_t>(level)]);
  }
  NodeCorners corners_inside(int level, const glm::vec3& corner) const;

 private:
  using Edges = std::array<glm::vec3, 3>;
  struct Level {
    Edges edges;
    glm::vec3 middle{0}, reach{0};  // half the sum of the edges, and of their absolute values
    void add(size_t axis, const glm::vec3& edge) {
      edges[axis] = edge;
      middle += 0.5f * edge, reach += 0.5f * glm::abs(edge);
    }
  };
  static glm::vec3 add(glm::vec3 corner, const Edges& edges, int which) {
    if (which & 1) corner += edges[0];
    if (which & 2) corner += edges[1];
    if (which & 4) corner += edges[2];
    return corner;
  }
  NodeView look(const glm::vec3& middle, const Level& level) const;
  void look_through(const glm::vec3& middle, const glm::vec3& reach, NodeView& out) const;

  float near_m_;
  glm::vec3 root_;
  std::array<Level, kLevels> levels_, inner_;
};

// In homogeneous pixels a corner differs from the middle by d; in pixels by (d.x - x d.w) / (w + d.w), where x is the
// middle's position.
inline NodeView NodeProjection::look(const glm::vec3& middle, const Level& level) const {
  NodeView out;
  out.nearest_m = middle.z - level.reach.z, out.farthest_m = middle.z + level.reach.z;
  if (out.nearest_m < near_m_) {
    look_through(middle, level.reach, out);
    return out;
  }
  const float inverse = 1 / middle.z, longest = 0.5f / out.nearest_m;
  const float x = middle.x * inverse, y = middle.y * inverse;
  float dx = 0, dy = 0;
  for (const glm::vec3& e : level.edges) {
    dx += std::abs(e.x - x * e.z);
    dy += std::abs(e.y - y * e.z);
  }
  out.left = x - dx * longest, out.right = x + dx * longest;
  out.top = y - dy * longest, out.bottom = y + dy * longest;
  return out;
}

// Bounds x / w for x and w in separate intervals.
inline void NodeProjection::look_through(const glm::vec3& middle, const glm::vec3& reach, NodeView& out) const {
  out.crosses_near = true;
  out.behind = out.farthest_m <= near_m_;
  out.nearest_m = near_m_;
  if (out.behind) return;
  const glm::vec3 lo = middle - reach, hi = middle + reach;
  const auto low = [&](float v) { return v / (v < 0 ? near_m_ : out.farthest_m); };
  const auto high = [&](float v) { return v / (v > 0 ? near_m_ : out.farthest_m); };
  out.left = low(lo.x), out.right = high(hi.x), out.top = low(lo.y), out.bottom = high(hi.y);
}

inline NodeCorners NodeProjection::corners_inside(int level, const glm::vec3& corner) const {
  const Level& inside = inner_[static_cast<size_t>(level)];
  const glm::vec3 inner = corner + levels_[static_cast<size_t>(level)].middle - inside.middle;
  NodeCorners out;
  for (int i = 0; i < 8; ++i) {
    const glm::vec3 c = add(inner, inside.edges, i);
    const float inverse = 1 / c.z;
    out.x[static_cast<size_t>(i)] = c.x * inverse, out.y[static_cast<size_t>(i)] = c.y * inverse;
  }
  return out;
}

}  // namespace telesplat::packer
