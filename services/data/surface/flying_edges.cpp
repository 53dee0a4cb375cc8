#include "services/data/surface/isosurface.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <type_traits>
#include <utility>

#include "common/parallel/in_parallel.h"

namespace telesplat::data {

namespace {

// A case of marching cubes: the triangles in a cube whose corners are inside or outside. Corner c of a cube stands at
// (c & 1, c >> 1 & 1, c >> 2). Edges 0..3 run along x from corners 0 2 4 6, 4..7 along y from 0 1 4 5, 8..11 along z
// from 0 1 2 3.
struct CubeCase {
  int triangles = 0;
  std::array<std::array<uint8_t, 3>, 12> edges{};  // per triangle; its normal points away from inside corners
};

// Corners of each face, counterclockwise as seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b) {
  const int low = std::min(a, b), axis = (a ^ b) == 1 ? 0 : (a ^ b) == 2 ? 1 : 2;
  return axis == 0 ? low >> 1 : axis == 1 ? 4 + ((low & 1) | (low >> 2) << 1) : 8 + low;
}

// In each face, lines lead from the edge where its outline leaves the inside to the edge where it came in; they join to
// loops through the cube's faces, which become fans.
CubeCase make_case(int inside) {
  std::array<int, 12> next;
  next.fill(-1);
  for (const auto& face : kFaces)
    for (int i = 0; i < 4; ++i) {
      const auto is_inside = [&](int k) { return (inside >> face[k & 3] & 1) != 0; };
      if (!is_inside(i) || is_inside(i + 1)) continue;
      int back = i;  // to the corner where this run of inside corners begins
      while (is_inside(back + 3)) back += 3;
      next[size_t(edge_between(face[back & 3], face[(back + 3) & 3]))] = edge_between(face[i], face[(i + 1) & 3]);
    }
  CubeCase out;
  for (int start = 0; start < 12; ++start) {
    std::array<uint8_t, 12> loop;
    size_t length = 0;
    for (int edge = start; next[size_t(edge)] >= 0;) {
      loop[length++] = uint8_t(edge);
      edge = std::exchange(next[size_t(edge)], -1);
    }
    for (size_t i = 2; i < length; ++i) out.edges[size_t(out.triangles++)] = {loop[0], loop[i - 1], loop[i]};
  }
  return out;
}

// Cases by the bits of inside corners. In faces with two diagonal inside corners these stay apart, in both cubes that
// share the face, so surfaces are closed.
const std::array<CubeCase, 256>& cube_cases() {
  static const auto cases = [] {
    std::array<CubeCase, 256> out;
    for (int inside = 0; inside < 256; ++inside) out[size_t(inside)] = make_case(inside);
    return out;
  }();
  return cases;
}

constexpr int kSlices = 16;                      // per slab: its border is visited twice, its tables stay small
constexpr uint32_t kOfNext = uint32_t{1} << 31;  // marks a vertex of the slab above, by its number there

// Returns the least value of T that is inside; beyond T's range if no value is.
template <class T>
auto threshold(double iso) {
  if constexpr (std::is_integral_v<T>) {
    return int32_t(std::clamp(std::ceil(iso), -1e9, 1e9));
  } else {
    const auto nearest = float(iso);
    return double(nearest) < iso ? std::nextafter(nearest, std::numeric_limits<float>::infinity()) : nearest;
  }
}

struct Part {
  std::vector<glm::dvec3> positions;
  std::vector<glm::vec3> normals;
  std::vector<uint32_t> indices;
};

// Data that all slabs share.
template <class T>
struct Field {
  const T* values;
  std::array<int, 3> size;
  double iso;
  glm::dmat4 index_to_data;
  glm::dmat3 of_normals;
  bool turned;  // triangles must be turned
  size_t steps[3] = {1, size_t(size[0]), size_t(size[0]) * size_t(size[1])};

  glm::dvec3 downward(const std::array<int, 3>& at, size_t index) const {
    glm::dvec3 out;
    for (size_t a = 0; a < 3; ++a) {
      const bool first = at[a] == 0, last = at[a] == size[a] - 1;
      const double below = double(values[first ? index : index - steps[a]]);
      const double above = double(values[last ? index : index + steps[a]]);
      out[int(a)] = (below - above) * (first || last ? 1 : 0.5);
    }
    return out;
  }

  // Adds the vertex where the edge along `axis` from a grid point crosses the value.
  void add_vertex(std::array<int, 3> at, size_t axis, Part& out) const {
    const size_t index = size_t(at[0]) + steps[1] * size_t(at[1]) + steps[2] * size_t(at[2]);
    const double s = double(values[index]), t = (iso - s) / (double(values[index + steps[axis]]) - s);
    glm::dvec4 place(at[0], at[1], at[2], 1);
    place[int(axis)] += t;
    out.positions.emplace_back(index_to_data * place);
    const glm::dvec3 here = downward(at, index);
    ++at[axis];
    const glm::dvec3 normal = of_normals * (here + t * (downward(at, index + steps[axis]) - here));
    const double length = glm::length(normal);
    out.normals.emplace_back(length > 0 ? glm::vec3(normal / length) : glm::vec3(0));
  }
};

// The slices from `first` on: their vertices, and the triangles between each and the next slice.
template <class T>
class Slab {
 public:
  Slab(const Field<T>& field, int first, int last) : field_(field), first_(first), last_(last) {
    const size_t rows = size_t(field.size[1]);
    stride_ = size_t(field.size[0]) + 9;  // eight points are compared at a time, each with the next
    for (auto& slice : inside_) slice.resize(rows * stride_ + 8);
    for (auto* ids : {&x_[0], &x_[1], &y_[0], &y_[1], &z_}) ids->resize(rows * stride_);
  }

  Part make() {
    const bool topmost = last_ == field_.size[2] - 1;
    classify(first_, 0);
    in_slice(0, [&](std::array<int, 3> at, size_t axis) { return add(at, axis, first_); });
    for (int k = first_; k < last_; ++k) {
      classify(k + 1, 1);
      uint32_t count = 0;
      if (k + 1 < last_ || topmost)
        in_slice(1, [&](std::array<int, 3> at, size_t axis) { return add(at, axis, k + 1); });
      else
        in_slice(1, [&](std::array<int, 3>, size_t) { return kOfNext | count++; });
      for (int j = 0; j < field_.size[1]; ++j)
        crossings(row(0, j), row(1, j), [&](int i) { z_[size_t(j) * stride_ + size_t(i)] = add({i, j, 0}, 2, k); });
      for (int j = 0; j + 1 < field_.size[1]; ++j) cubes(j);
      std::swap(inside_[0], inside_[1]);
      std::swap(x_[0], x_[1]);
      std::swap(y_[0], y_[1]);
    }
    return std::move(part_);
  }

 private:
  const uint8_t* row(int slice, int j) const { return inside_[slice].data() + size_t(j) * stride_; }
  static uint64_t eight(const uint8_t* at) {
    uint64_t out;
    std::memcpy(&out, at, sizeof out);
    return out;
  }

  // Sets one byte per point, 1: inside. The last point is repeated behind its row, so that there are no crossings.
  void classify(int k, int slice) {
    const auto least = threshold<T>(field_.iso);
    for (int j = 0; j < field_.size[1]; ++j) {
      const T* from = field_.values + field_.steps[2] * size_t(k) + field_.steps[1] * size_t(j);
      uint8_t* to = inside_[slice].data() + size_t(j) * stride_;
      for (int i = 0; i < field_.size[0]; ++i) to[i] = from[i] >= least;
      std::memset(to + field_.size[0], to[field_.size[0] - 1], stride_ - size_t(field_.size[0]));
    }
  }

  // Calls f(i) for each i where two rows differ.
  template <class F>
  void crossings(const uint8_t* a, const uint8_t* b, F&& f) const {
    for (int begin = 0; begin < field_.size[0]; begin += 8)
      for (uint64_t differ = eight(a + begin) ^ eight(b + begin); differ != 0; differ &= differ - 1)
        if (const int i = begin + std::countr_zero(differ) / 8; i < field_.size[0]) f(i);
  }

  // Numbers the vertices on the edges within a slice, by id(grid point, axis); always in the same order.
  template <class Id>
  void in_slice(int slice, Id&& id) {
    for (int j = 0; j < field_.size[1]; ++j) {
      const size_t begin = size_t(j) * stride_;
      crossings(row(slice, j), row(slice, j) + 1, [&](int i) { x_[slice][begin + size_t(i)] = id({i, j, 0}, 0); });
      if (j + 1 < field_.size[1])
        crossings(row(slice, j), row(slice, j + 1), [&](int i) { y_[slice][begin + size_t(i)] = id({i, j, 0}, 1); });
    }
  }

  uint32_t add(std::array<int, 3> at, size_t axis, int k) {
    at[2] = k;
    field_.add_vertex(at, axis, part_);
    return uint32_t(part_.positions.size() - 1);
  }

  void cubes(int j) {
    const uint8_t* rows[4] = {row(0, j), row(0, j + 1), row(1, j), row(1, j + 1)};
    const int count = field_.size[0] - 1;
    for (int begin = 0; begin < count; begin += 8) {
      uint64_t first = eight(rows[0] + begin), differ = 0;
      for (const uint8_t* r : rows) differ |= (eight(r + begin) ^ first) | (eight(r + begin + 1) ^ first);
      for (; differ != 0; differ &= differ - 1) {
        const int i = begin + std::countr_zero(differ) / 8;
        if (i >= count) break;
        int inside = 0;
        for (int r = 0; r < 4; ++r) inside |= (rows[r][i] | rows[r][i + 1] << 1) << (2 * r);
        add_triangles(cube_cases()[size_t(inside)], size_t(j) * stride_ + size_t(i));
      }
    }
  }

  void add_triangles(const CubeCase& cube, size_t at) {
    const auto vertex = [&](int edge) {
      const size_t along = at + (edge & 1 ? (edge < 4 ? stride_ : 1) : 0);
      if (edge < 4) return x_[edge >> 1][along];
      if (edge < 8) return y_[(edge - 4) >> 1][along];
      return z_[along + (edge >= 10 ? stride_ : 0)];
    };
    for (int t = 0; t < cube.triangles; ++t) {
      const auto& edges = cube.edges[size_t(t)];
      part_.indices.push_back(vertex(edges[0]));
      part_.indices.push_back(vertex(edges[field_.turned ? 2 : 1]));
      part_.indices.push_back(vertex(edges[field_.turned ? 1 : 2]));
    }
  }

  const Field<T>& field_;
  const int first_, last_;
  size_t stride_;
  std::vector<uint8_t> inside_[2];         // this slice, and the next one
  std::vector<uint32_t> x_[2], y_[2], z_;  // vertices on the edges from each grid point, where edges cross
  Part part_;
};

Result<Mesh> join(std::vector<Part>& parts, const std::string& name) {
  std::vector<uint64_t> begins{0};
  uint64_t corners = 0;
  for (const Part& part : parts) {
    begins.push_back(begins.back() + part.positions.size());
    corners += part.indices.size();
    if (part.positions.size() >= kOfNext) return Error{fmt::format("{}: its surface has too many vertices", name)};
  }
  if (begins.back() > kMaxVertices || corners / 3 > kMaxTriangles)
    return Error{fmt::format("{}: its surface has {} triangles, limit {}", name, corners / 3, kMaxTriangles)};
  Mesh mesh;
  mesh.positions.reserve(begins.back());
  mesh.normals.reserve(begins.back());
  mesh.indices.reserve(corners);
  for (size_t p = 0; p < parts.size(); ++p) {
    const Part part = std::move(parts[p]);
    mesh.positions.insert(mesh.positions.end(), part.positions.begin(), part.positions.end());
    mesh.normals.insert(mesh.normals.end(), part.normals.begin(), part.normals.end());
    for (const uint32_t i : part.indices)
      mesh.indices.push_back(uint32_t(i & kOfNext ? begins[p + 1] + (i ^ kOfNext) : begins[p] + i));
  }
  return mesh;
}

template <class T>
Result<Mesh> surface_of(const Volume& volume, const T* values, double iso, const std::string& name) {
  const glm::dmat3 linear(volume.index_to_data);
  const bool upside_down = volume.scale < 0;  // larger stored values are lower values
  const Field<T> field{values,
                       volume.size,
                       iso,
                       volume.index_to_data,
                       glm::transpose(glm::inverse(linear)) * (upside_down ? -1.0 : 1.0),
                       (glm::determinant(linear) < 0) != upside_down};
  const int layers = volume.size[2] - 1;
  std::vector<Part> parts(size_t((layers + kSlices - 1) / kSlices));
  in_parallel(size_t{0}, parts.size(), [&](size_t p) {
    parts[p] = Slab<T>(field, int(p) * kSlices, std::min(int(p + 1) * kSlices, layers)).make();
  });
  return join(parts, name);
}

}  // namespace

Result<Mesh> flying_edges(const Volume& volume, double iso, double below, const std::string& name) {
  if (volume.type != VoxelType::kF32 || volume.not_finite == 0)
    return with_type(volume.type, [&](auto value) {  // a vector's storage is aligned for any type
      using T = std::conditional_t<(sizeof value <= 2), decltype(value), float>;  // the only types of volumes
      return surface_of(volume, reinterpret_cast<const T*>(volume.stored.data()), iso, name);
    });
  std::vector<float> finite(volume.stored.size() / sizeof(float));
  std::memcpy(finite.data(), volume.stored.data(), volume.stored.size());
  for (float& v : finite) v = std::isfinite(v) ? v : float(below);
  return surface_of(volume, finite.data(), iso, name);
}

}  // namespace telesplat::data
