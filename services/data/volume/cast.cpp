#include "services/data/volume/cast.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <limits>

namespace telesplat::data {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kStepsAVoxel = 16;
constexpr double kLongestBracket = 4;  // voxels to the places that bound it; a wider bracket is no bound

// Range of the extinctions for all values from lo to hi.
struct Extinctions {
  double least, most;
};
Extinctions extinctions(const volume::TransferFunction& transfer, double lo, double hi) {
  const float at_lo = transfer.at(lo).opacity, at_hi = transfer.at(hi).opacity;
  float least = std::min(at_lo, at_hi), most = std::max(at_lo, at_hi);
  auto point = std::lower_bound(transfer.points.begin(), transfer.points.end(), lo,
                                [](const volume::TransferFunction::Point& p, double v) { return p.value < v; });
  for (; point != transfer.points.end() && point->value <= hi; ++point)
    least = std::min(least, point->opacity), most = std::max(most, point->opacity);
  return {double{volume::extinction(least)}, double{volume::extinction(most)}};
}

// Eight voxels around a place, in the data's values, and the deviation of values between them from trilinear ones.
class Cells {
 public:
  Cells(const volume::Session& session, int begin, int end, const LevelAt& level_at)
      : session_(session),
        lo_{0, 0, std::max(begin - 1, 0)},
        hi_{session.grid.size[0], session.grid.size[1], std::min(end + 1, session.grid.size[2])},
        level_at_(level_at) {}

  void move_to(const glm::dvec3& index) {
    const std::array<int, 3> cell{int(std::floor(index.x)), int(std::floor(index.y)), int(std::floor(index.z))};
    if (cell == cell_) return;
    cell_ = cell;
    bend_ = glm::dvec3(0);
    for (size_t corner = 0; corner < 8; ++corner) {
      std::array<int, 3> at;
      for (size_t a = 0; a < 3; ++a) at[a] = std::clamp(cell[a] + int(corner >> a & 1), lo_[a], hi_[a] - 1);
      values_[corner] = value(at);
      for (size_t a = 0; a < 3; ++a) bend_[int(a)] = std::max(bend_[int(a)], second_difference(at, a, values_[corner]));
    }
  }
  double value(const glm::dvec3& index) const {
    const glm::dvec3 part = index - glm::floor(index);
    double out = 0;
    for (int corner = 0; corner < 8; ++corner) {
      double weight = 1;
      for (int a = 0; a < 3; ++a) weight *= corner >> a & 1 ? part[a] : 1 - part[a];
      out += weight * values_[size_t(corner)];
    }
    return out;
  }
  // The error of linear interpolation is h^2/2 t (1 - t) times the second derivative: zero at voxels.
  double deviation(const glm::dvec3& index) const {
    const glm::dvec3 part = index - glm::floor(index);
    return glm::dot(bend_, part * (1.0 - part)) / 2 + session_.levels.step / 2;
  }

 private:
  double value(const std::array<int, 3>& at) const {
    return session_.levels.lo + level_at_(at[0], at[1], at[2]) * session_.levels.step;
  }
  double second_difference(std::array<int, 3> at, size_t axis, double middle) const {
    const int here = at[axis];
    if (here - 1 < lo_[axis] || here + 1 >= hi_[axis]) return 0;
    at[axis] = here - 1;
    const double before = value(at);
    at[axis] = here + 1;
    return std::abs(before - 2 * middle + value(at));
  }

  const volume::Session& session_;
  const std::array<int, 3> lo_, hi_;
  const LevelAt& level_at_;
  std::array<int, 3> cell_{-2, -2, -2};
  std::array<double, 8> values_{};
  glm::dvec3 bend_{0};  // the largest second differences of the eight, along each axis
};

// Adds up optical depth until it reaches `enough`.
struct Depth {
  double sum = 0, reached = kInfinity;  // reached: metres along the ray
  void add(double more, double from, double length, double enough) {
    if (reached < kInfinity) return;
    if (sum + more >= enough) reached = from + length * (more > 0 ? (enough - sum) / more : 0);
    sum += more;
  }
};

}  // namespace

Result<scene::Probed> cast(const volume::Session& session, const std::pair<int, int>& held, const LevelAt& level_at,
                           const volume::TransferFunction& transfer, const geometry::Clip& clip,
                           const scene::Probe& probe) {
  const auto [begin, end] = held;
  const glm::dmat4 to_index = session.grid.room_to_index();
  const glm::dvec3 from(to_index * glm::dvec4(probe.origin_room, 1)),
      on(to_index * glm::dvec4(probe.direction_room, 0));
  const glm::dvec3 size(session.grid.size[0], session.grid.size[1], session.grid.size[2]);
  const auto [begins, last] =
      clip.stretch(probe.origin_room, probe.direction_room).within({glm::dvec3(-0.5), size - 0.5}, from, on);
  const double first = std::max(begins, 0.0);
  if (!(first < last)) return Error{"probe: the ray does not meet the volume"};

  const double voxel_m = 1 / std::max({std::abs(on.x), std::abs(on.y), std::abs(on.z)}),
               step_m = voxel_m / kStepsAVoxel;
  const double enough = double{volume::extinction(float(probe.opacity))}, unit_m = session.grid.unit_m();
  Cells cells(session, begin, end, level_at);
  Depth told, nearest, farthest;
  double lo = kInfinity, hi = -kInfinity;  // range of values between the nearest and the farthest possible place
  for (double at = first; at < last && farthest.reached == kInfinity; at += step_m) {
    const double length = std::min(step_m, last - at);
    const glm::dvec3 index = from + (at + length / 2) * on;
    if (const double k = std::floor(index.z + 0.5); k < begin || k >= end) {
      if (told.reached == kInfinity) return Error{"probe: slices of another data server lie in front"};
      break;
    }
    if (at - told.reached > kLongestBracket * voxel_m) break;
    cells.move_to(index);
    const double value = cells.value(index), off = cells.deviation(index);
    const Extinctions may = extinctions(transfer, value - off, value + off);
    const double share = length / unit_m;
    nearest.add(may.most * share, at, length, enough);
    told.add(double{volume::extinction(transfer.at(value).opacity)} * share, at, length, enough);
    farthest.add(may.least * share, at, length, enough);
    if (nearest.reached < kInfinity) lo = std::min(lo, value - off), hi = std::max(hi, value + off);
  }
  if (told.reached == kInfinity) return Error{"probe: nothing on the ray hides enough"};

  scene::Probed out{.room = probe.origin_room + told.reached * probe.direction_room};
  const glm::dvec3 index = from + told.reached * on;
  cells.move_to(index);
  out.value = cells.value(index);
  out.value_error = cells.deviation(index);
  const double bracket_m = std::max(told.reached - nearest.reached, farthest.reached - told.reached);
  if (bracket_m > kLongestBracket * voxel_m) return out;
  out.error_m = bracket_m + step_m / 2;
  for (const double at : {nearest.reached - step_m / 2, farthest.reached + step_m / 2}) {
    const glm::dvec3 end = from + at * on;
    cells.move_to(end);
    lo = std::min(lo, cells.value(end) - cells.deviation(end));
    hi = std::max(hi, cells.value(end) + cells.deviation(end));
  }
  out.value_error = std::max({*out.value_error, hi - *out.value, *out.value - lo});
  return out;
}

}  // namespace telesplat::data
