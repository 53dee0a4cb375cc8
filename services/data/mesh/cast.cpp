#include "services/data/mesh/cast.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <vector>

#include "common/geometry/chunk_code.h"

namespace telesplat::data {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSeam = 1e-9;      // in barycentric coordinates: rays do not slip between neighbours
constexpr double kCrease = 0.7;     // cosine between normals: a sharper fold is not a bend
constexpr double kRound = 0x1p-24;  // relative rounding error of a float: half of its last bit

struct Ray {
  glm::dvec3 origin, direction;
  geometry::Clip::Stretch kept;  // metres along the ray
};

// Returns the ray's entry into a box, in metres; infinity: it misses the box.
double entry(const Ray& ray, const geometry::Box& box) {
  const glm::dvec3 lo(box.lo), hi(box.hi);
  const glm::dvec3 slack = 1e-9 * (glm::abs(lo - ray.origin) + glm::abs(hi - ray.origin));  // planes' boxes are flat
  const auto within = ray.kept.within({lo - slack, hi + slack}, ray.origin, ray.direction);
  return within.empty() ? kInfinity : within.begin;
}

using Corners = std::array<glm::dvec3, 3>;

struct Hit {
  double at = kInfinity;  // metres along the ray
  size_t triangle = 0;
  glm::dvec3 weights{0.0};  // barycentric
};

Corners corners_of(const geometry::MeshChunkView& chunk, size_t triangle) {
  Corners out;
  for (size_t c = 0; c < 3; ++c) {
    const float* p = &chunk.positions_room[3 * size_t(chunk.indices[3 * triangle + c])];
    out[c] = {p[0], p[1], p[2]};
  }
  return out;
}

// Möller and Trumbore, "Fast, minimum storage ray/triangle intersection", 1997.
void intersect(const Ray& ray, const Corners& t, size_t triangle, Hit& best) {
  const glm::dvec3 ab = t[1] - t[0], ac = t[2] - t[0], across = glm::cross(ray.direction, ac);
  const double determinant = glm::dot(ab, across);
  if (determinant == 0) return;
  const glm::dvec3 from = ray.origin - t[0], turned = glm::cross(from, ab);
  const double u = glm::dot(from, across) / determinant, v = glm::dot(ray.direction, turned) / determinant;
  if (!(u >= -kSeam && v >= -kSeam && u + v <= 1 + kSeam)) return;
  const double at = glm::dot(ac, turned) / determinant;
  if (at >= ray.kept.begin && at <= ray.kept.end && at < best.at) best = {at, triangle, {1 - u - v, u, v}};
}

double value_at(const geometry::MeshChunkView& chunk, uint32_t vertex) {
  return double{std::bit_cast<float>(chunk.colours[vertex])};
}

// Largest deviation of surface and values around a triangle, as an estimate for those within it.
struct Bend {
  double surface_m = 0, value = 0;
};

class Neighbourhood {
 public:
  Neighbourhood(const geometry::MeshChunkView& chunk, size_t triangle, bool values)
      : chunk_(chunk), triangle_(triangle), values_(values), t_(corners_of(chunk, triangle)) {
    const glm::dvec3 ab = t_[1] - t_[0], ac = t_[2] - t_[0];
    normal_ = glm::normalize(glm::cross(ab, ac));
    centre_ = (t_[0] + t_[1] + t_[2]) / 3.0;
    side_m_ = std::max({glm::length(ab), glm::length(ac), glm::length(t_[2] - t_[1])});
    if (!values) return;
    // v = v0 + gradient . (p - t0) on the triangle's plane.
    const uint32_t* i = &chunk.indices[3 * triangle];
    v0_ = value_at(chunk, i[0]);
    const double b = value_at(chunk, i[1]) - v0_, c = value_at(chunk, i[2]) - v0_;
    const glm::dvec3 n = glm::cross(ab, ac);
    gradient_ = (b * glm::cross(ac, n) + c * glm::cross(n, ab)) / glm::dot(n, n);
  }
  const glm::dvec3& normal() const { return normal_; }
  const glm::dvec3& gradient() const { return gradient_; }

  Bend bend() const {
    Bend out;
    for (size_t n = 0; n < chunk_.triangles(); ++n) {
      if (n == triangle_) continue;
      const uint32_t* i = &chunk_.indices[3 * n];
      if (!touches(i[0]) && !touches(i[1]) && !touches(i[2])) continue;
      const Corners other = corners_of(chunk_, n);
      const glm::dvec3 towards = glm::cross(other[1] - other[0], other[2] - other[0]);
      if (std::abs(glm::dot(towards, normal_)) < kCrease * glm::length(towards)) continue;
      for (size_t c = 0; c < 3; ++c) add(other[c], i[c], out);
    }
    return out;
  }

 private:
  // Compares places: a vertex with two normals or colours is stored twice.
  bool touches(uint32_t vertex) const {
    const float* p = &chunk_.positions_room[3 * size_t(vertex)];
    const glm::dvec3 at(p[0], p[1], p[2]);
    return at == t_[0] || at == t_[1] || at == t_[2];
  }
  void add(const glm::dvec3& at, uint32_t vertex, Bend& out) const {
    const glm::dvec3 from = at - centre_;
    const double near = std::min(1.0, side_m_ * side_m_ / glm::dot(from, from)) / 2;
    out.surface_m = std::max(out.surface_m, near * std::abs(glm::dot(at - t_[0], normal_)));
    if (!values_) return;
    const double off = std::abs(value_at(chunk_, vertex) - v0_ - glm::dot(gradient_, at - t_[0]));
    if (std::isfinite(off)) out.value = std::max(out.value, near * off);
  }

  const geometry::MeshChunkView& chunk_;
  const size_t triangle_;
  const bool values_;
  const Corners t_;
  glm::dvec3 normal_, centre_, gradient_{0.0};
  double side_m_, v0_ = 0;
};

scene::Probed describe(const geometry::MeshChunkView& chunk, const Ray& ray, const Hit& hit, double scalar_origin,
                       bool of_cells) {
  scene::Probed out{.room = ray.origin + hit.at * ray.direction};
  const uint32_t* i = &chunk.indices[3 * hit.triangle];
  double value = 0, largest = std::abs(scalar_origin);
  if (chunk.scalars)
    for (int c = 0; c < 3; ++c) {
      value += hit.weights[c] * value_at(chunk, i[c]);
      largest = std::max(largest, std::abs(value_at(chunk, i[c])));
    }
  const bool has_value = chunk.scalars && std::isfinite(value);
  const Neighbourhood around(chunk, hit.triangle, has_value && !of_cells);
  const Bend bend = around.bend();
  const double lean = std::abs(glm::dot(around.normal(), ray.direction));
  const auto [lo, hi] = chunk.box_room;
  const glm::dvec3 far = glm::max(glm::abs(glm::dvec3(lo)), glm::abs(glm::dvec3(hi)));
  // Corners are rounded, and so is the box that places the data in the room.
  out.error_m = (bend.surface_m + 4 * kRound * glm::length(far)) / lean;
  out.normal_room = glm::dot(around.normal(), ray.direction) > 0 ? -around.normal() : around.normal();
  if (!has_value) return out;
  out.value = scalar_origin + (of_cells ? value_at(chunk, i[0]) : value);
  out.value_error = 2 * kRound * largest;
  if (!of_cells) *out.value_error += bend.value + glm::length(around.gradient()) * *out.error_m;
  return out;
}

}  // namespace

std::optional<scene::Probed> cast(const MeshStore& store, const scene::Probe& probe, const geometry::Clip& clip,
                                  double scalar_origin, bool of_cells) {
  Ray ray{probe.origin_room, probe.direction_room, clip.stretch(probe.origin_room, probe.direction_room)};
  ray.kept.begin = std::max(ray.kept.begin, 0.0);
  struct Met {
    double at;
    ChunkId chunk;
  };
  std::vector<Met> met;
  for (const geometry::ChunkInfo& chunk : store.leaves())
    if (const double at = entry(ray, chunk.box_room); at < kInfinity) met.push_back({at, chunk.id});
  std::sort(met.begin(), met.end(), [](const Met& a, const Met& b) { return a.at < b.at; });
  Hit best;
  geometry::HeldChunk of;
  for (const Met& m : met) {
    if (m.at > best.at) break;
    auto chunk = geometry::decode_chunk(store.chunk(m.chunk).bytes);
    if (!chunk) continue;  // cannot happen: the store checks its chunks
    const double before = best.at;
    for (size_t t = 0; t < chunk->view.triangles(); ++t) intersect(ray, corners_of(chunk->view, t), t, best);
    if (best.at < before) of = *std::move(chunk);
  }
  if (!(best.at < kInfinity)) return std::nullopt;
  return describe(of.view, ray, best, scalar_origin, of_cells);
}

}  // namespace telesplat::data
