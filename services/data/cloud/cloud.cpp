#include "services/data/cloud/cloud.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <utility>

#include "common/parallel/in_parallel.h"
#include "services/data/cloud/neighbours.h"
#include "services/data/cloud/square.h"

namespace telesplat::data {
namespace {

// A side of a square is twice this times the distance to its neighbours: a grid's squares meet if they are turned, too.
constexpr float kReach = 0.75f;
// Points around are a surface if their least variance is below this part of the next one, and that is above the other
// part of the largest.
constexpr float kFlat = 0.2f, kWide = 0.02f;
constexpr double kLeastExtent = 1e-30, kMostExtent = 1e30;
constexpr float kNoSurface = 0.5f, kMostOfNeighbours = 2;

bool is_finite(const glm::dvec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

template <class T>
void keep(std::vector<T>& values, const std::vector<bool>& kept) {
  if (values.empty()) return;
  size_t n = 0;
  for (size_t i = 0; i < kept.size(); ++i)
    if (kept[i]) values[n++] = values[i];
  values.resize(n);
}

void drop_not_finite(Cloud& cloud, const std::string& name) {
  Mesh& points = cloud.points;
  std::vector<bool> kept(points.positions.size());
  size_t count = 0;
  for (size_t i = 0; i < kept.size(); ++i) count += kept[i] = is_finite(points.positions[i]);
  if (count == kept.size()) return;
  for (Cloud::Scan& scan : cloud.scans)
    scan.first = size_t(std::count(kept.begin(), kept.begin() + std::ptrdiff_t(scan.first), true));
  points.notes.push_back(fmt::format("{}: {} of {} points are left out: a coordinate of theirs is no finite number",
                                     name, kept.size() - count, kept.size()));
  keep(points.positions, kept), keep(points.normals, kept);
  keep(points.colours, kept), keep(points.scalars, kept);
}

// Variances along the three axes of a set of points, ascending, and the direction of the smallest.
struct Axes {
  float variance[3];
  glm::vec3 normal;
};

// Eigenvalues of a symmetric matrix by Jacobi's rotations.
Axes axes_of(glm::dmat3 m) {
  glm::dmat3 turned(1.0);
  for (int sweep = 0; sweep < 8; ++sweep) {
    const double off = std::abs(m[1][0]) + std::abs(m[2][0]) + std::abs(m[2][1]);
    if (!(off > 1e-12 * (m[0][0] + m[1][1] + m[2][2]))) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (m[p][q] == 0) continue;
        const double theta = (m[q][q] - m[p][p]) / (2 * m[p][q]);
        const double t = std::copysign(1 / (std::abs(theta) + std::sqrt(theta * theta + 1)), theta);
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        glm::dmat3 turn(1.0);
        turn[p][p] = turn[q][q] = c, turn[q][p] = s, turn[p][q] = -s;
        m = glm::transpose(turn) * m * turn;
        turned = turned * turn;
      }
  }
  int order[3] = {0, 1, 2};
  std::sort(order, order + 3, [&](int a, int b) { return m[a][a] < m[b][b]; });
  Axes out{{}, glm::vec3(turned[order[0]])};
  for (int i = 0; i < 3; ++i) out.variance[i] = float(std::max(m[order[i]][order[i]], 0.0));
  return out;
}

// Fits squares to the points of a cloud, scaled to a box of size 1.
class Fit {
 public:
  explicit Fit(Cloud& cloud) : cloud_(cloud), points_(cloud.points) {}

  /// Returns false if all points lie at one place, or too far apart.
  bool run() {
    for (const glm::dvec3& p : points_.positions) view_.box.extend(p);
    const glm::dvec3 size = view_.box.size();
    view_.extent = std::max({size.x, size.y, size.z});
    if (!(view_.extent >= kLeastExtent && view_.extent <= kMostExtent)) return false;
    view_.from_above = cloud_.z_up || (size.z < 0.35 * size.x && size.z < 0.35 * size.y);
    view_.scans = cloud_.scans;
    const size_t count = points_.positions.size();
    std::vector<Neighbours::Point> scaled(count);
    in_parallel(size_t{0}, count, [&](size_t i) {
      scaled[i] = {glm::vec3((points_.positions[i] - view_.middle()) / view_.extent), uint32_t(i)};
    });
    points_.normals.resize(count, glm::vec3(0));
    halves_.resize(count);
    fit(Neighbours(std::move(scaled)));
    return true;
  }
  CloudView take_view() { return std::move(view_); }
  std::vector<float> take_halves() { return std::move(halves_); }
  float median_side() const { return 2 * median_; }

 private:
  void fit(const Neighbours& tree) {
    const std::vector<Neighbours::Point>& points = tree.points();
    std::vector<float> own(points.size());
    std::vector<std::array<uint32_t, 2>> others(points.size());
    in_parallel(uint32_t{0}, uint32_t(points.size()), [&](uint32_t i) {
      Neighbours::List found;
      const int count = tree.nearest(i, found);
      others[i] = {found[size_t(std::min(count, 4) - 1)].place, found[size_t(std::min(count, 7) - 1)].place};
      own[i] = half_of(points, points[i], found, count);
    });
    set_median(own);
    in_parallel(uint32_t{0}, uint32_t(points.size()), [&](uint32_t i) {
      const float most = kMostOfNeighbours * std::min(own[others[i][0]], own[others[i][1]]);
      const float half = own[i] > 0 ? std::min(own[i], most > 0 ? most : median_) : median_;
      halves_[points[i].index] = std::copysign(half * float(view_.extent), halves_[points[i].index]);
    });
    median_ *= float(view_.extent);
  }

  // Sets the median of those above 0.
  void set_median(std::vector<float> halves) {
    halves.erase(std::remove(halves.begin(), halves.end(), 0.0f), halves.end());
    if (halves.empty()) halves.push_back(1e-3f);
    const auto middle = halves.begin() + std::ptrdiff_t(halves.size() / 2);
    std::nth_element(halves.begin(), middle, halves.end());
    median_ = *middle;
  }

  // Sets the point's normal, and the sign of its half; returns that, 0 if the neighbours lie at the point itself.
  float half_of(const std::vector<Neighbours::Point>& points, const Neighbours::Point& point,
                const Neighbours::List& found, int count) {
    glm::dvec3 mean(0);
    for (int i = 0; i < count; ++i) mean += glm::dvec3(points[found[size_t(i)].place].at - point.at);
    mean /= std::max(count, 1);
    glm::dmat3 spread(0.0);
    for (int i = 0; i < count; ++i) {
      const glm::dvec3 way = glm::dvec3(points[found[size_t(i)].place].at - point.at) - mean;
      spread += glm::outerProduct(way, way) / double(count);
    }
    const Axes axes = axes_of(spread);
    glm::vec3& normal = points_.normals[point.index];
    const float length = glm::length(normal);
    const bool given = length > 1e-20f && std::isfinite(length);
    normal = given ? normal / length : axes.variance[2] > 0 ? axes.normal : glm::vec3(0, 0, 1);
    if (!given && glm::dot(glm::dvec3(normal), view_.towards(point.index, points_.positions[point.index])) < 0)
      normal = -normal;
    float near = 0;  // mean distance of the nearest four
    const int few = std::min(count, 4);
    for (int i = 0; i < few; ++i) near += std::sqrt(found[size_t(i)].squared) / float(few);
    // Distance in a grid that is as dense as the points here.
    constexpr float kPi = 3.14159265f;
    const float dense = std::sqrt(found[size_t(count - 1)].squared * kPi / float(count + 1));
    const bool surface =
        given || (axes.variance[0] < kFlat * axes.variance[1] && axes.variance[1] > kWide * axes.variance[2]);
    halves_[point.index] = surface ? 1.0f : -1.0f;
    return kReach * std::max(near, dense) * (surface ? 1.0f : kNoSurface);
  }

  Cloud& cloud_;
  Mesh& points_;
  CloudView view_;
  std::vector<float> halves_;
  float median_ = 0;
};

}  // namespace

glm::dvec3 CloudView::towards(size_t point, const glm::dvec3& at) const {
  const auto later = std::upper_bound(scans.begin(), scans.end(), point,
                                      [](size_t p, const Cloud::Scan& scan) { return p < scan.first; });
  glm::dvec3 way = at - middle();
  if (from_above) way = {0, 0, 1};
  if (later != scans.begin() && glm::length(std::prev(later)->scanner - middle()) < 2 * extent)
    way = std::prev(later)->scanner - at;
  const double length = glm::length(way);
  return length > 0 ? way / length : glm::dvec3(0, 0, 1);
}

Result<std::shared_ptr<const SquareCloud>> SquareCloud::make(Cloud&& cloud, const std::string& name) {
  Mesh& points = cloud.points;
  const size_t read = points.positions.size();
  if (read > kMaxPoints) return Error{fmt::format("{}: {} points, the limit is {}", name, read, kMaxPoints)};
  drop_not_finite(cloud, name);
  const size_t count = points.positions.size();
  if (count == 0) return Error{fmt::format("{}: holds no points{}", name, read > 0 ? " with finite coordinates" : "")};
  const bool own_normals = !points.normals.empty();
  Fit fit(cloud);
  if (!fit.run())
    return Error{fmt::format("{}: its {} points have no extent, or one outside [{}, {}]", name, count, kLeastExtent,
                             kMostExtent)};
  points.notes.push_back(
      fmt::format("{}: a cloud of {} points, each shown as a square in the plane of {}; the median side is {:.3g}{}",
                  name, count, own_normals ? "its normal" : "the points around it", fit.median_side(),
                  points.coordinates.space == scene::Space::kPlain ? "" : " m"));
  Facts facts{.format = points.format, .vertices = 4 * count, .triangles = 2 * count, .normals = true};
  facts.colours = !points.colours.empty(), facts.scalars = !points.scalars.empty();
  facts.arrays = points.arrays, facts.notes = points.notes, facts.coordinates = points.coordinates;
  return std::shared_ptr<const SquareCloud>(
      new SquareCloud(std::move(facts), std::move(points), fit.take_view(), fit.take_halves()));
}

bool SquareCloud::corners(uint64_t first, size_t count, uint32_t* out) const {
  for (uint64_t t = first; t < first + count; ++t)
    for (size_t k = 0; k < 3; ++k) *out++ = uint32_t(4 * (t / 2)) + kSquare[3 * (t % 2) + k];
  return true;
}

glm::dvec3 SquareCloud::position(uint64_t vertex) const {
  const uint64_t point = vertex / 4;
  return points_.positions[point] + glm::dvec3(square_around(points_.normals[point], half(point))[vertex % 4]);
}

glm::vec3 SquareCloud::normal(uint64_t vertex) const {
  const uint64_t point = vertex / 4;
  const glm::vec3 own = points_.normals[point];
  return halves_[point] > 0 ? own : glm::normalize(own + glm::vec3(view_.towards(point, points_.positions[point])));
}

Mesh SquareCloud::mesh() const {
  Mesh out;
  out.format = facts_.format, out.coordinates = facts_.coordinates;
  out.arrays = facts_.arrays, out.notes = facts_.notes, out.frame = points_.frame;
  out.positions.resize(vertices()), out.normals.resize(vertices());
  out.colours.resize(facts_.colours ? vertices() : 0), out.scalars.resize(facts_.scalars ? vertices() : 0);
  in_parallel(uint64_t{0}, vertices(), [&](uint64_t v) {
    out.positions[v] = position(v), out.normals[v] = normal(v);
    if (facts_.colours) out.colours[v] = colour(v);
    if (facts_.scalars) out.scalars[v] = scalar(v);
  });
  out.indices.resize(3 * triangles());
  corners(0, triangles(), out.indices.data());
  return out;
}

}  // namespace telesplat::data
