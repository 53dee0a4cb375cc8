#include "common/codec/dense/normals.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <memory>

#include "common/codec/dense/height.h"

namespace telesplat::codec::detail {
namespace {

constexpr int kMostFlatExponent = 24, kEnoughFlatExponent = 8;  // more is chosen for depth within bounds alone
constexpr unsigned kFlatExponentBits = 5;
constexpr double kSmooth = 3.0;  // mean tokens of both coordinates, added up
// Mean tokens of a coordinate, without a bound of normals and with one, above which weights by flatness save more than
// they take, in bits and in time.
constexpr double kRough = 3, kRoughWithin = 1.5;

struct Point {
  int x, y, z;
};

Point point_of(uint16_t code) {
  const int x = std::min(code & 255, 254) - 127, y = std::min(code >> 8, 254) - 127;
  const int z = 127 - std::abs(x) - std::abs(y), fold = std::max(-z, 0);
  return {x + (x >= 0 ? -fold : fold), y + (y >= 0 ? -fold : fold), z};
}

uint16_t code_of(const Point& p) {
  int x = p.x, y = p.y;
  if (p.z < 0) x = (127 - std::abs(p.y)) * (p.x >= 0 ? 1 : -1), y = (127 - std::abs(p.x)) * (p.y >= 0 ? 1 : -1);
  return static_cast<uint16_t>((x + 127) | (y + 127) << 8);
}

Point turn(const Point& p, int pole) {
  const Point q = pole / 2 == 0 ? Point{p.y, p.z, p.x} : pole / 2 == 1 ? Point{p.z, p.x, p.y} : p;
  return pole % 2 == 0 ? q : Point{q.x, q.y, -q.z};
}
Point unturn(const Point& p, int pole) {
  const Point q = pole % 2 == 0 ? p : Point{p.x, p.y, -p.z};
  return pole / 2 == 0 ? Point{q.z, q.x, q.y} : pole / 2 == 1 ? Point{q.y, q.z, q.x} : q;
}

using Table = std::array<uint16_t, 65536>;
const Table& table(int pole, bool back) {
  static const auto tables = [] {
    auto all = std::make_unique<std::array<std::array<Table, kPoles>, 2>>();
    for (unsigned code = 0; code < 65536; ++code)
      for (int p = 0; p < kPoles; ++p) {
        (*all)[0][size_t(p)][code] = code_of(turn(point_of(uint16_t(code)), p));
        (*all)[1][size_t(p)][code] = code_of(unturn(point_of(uint16_t(code)), p));
      }
    return all;
  }();
  return (*tables)[back][static_cast<size_t>(pole)];
}

// What turns slopes and height into normals, which look towards the eye, turned by `pole`: -1 times the inverse of the
// axes' transpose. False where there is none.
bool normals_of(const RoomAxes& axes, int pole, double out[9]) {
  RoomAxes inverse;
  if (!inverse_transpose(axes, inverse)) return false;
  const size_t first = pole / 2 == 0 ? 1 : pole / 2 == 1 ? 2 : 0;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) out[3 * i + j] = inverse[(first + i) % 3][j] * (i == 2 && pole % 2 != 0 ? 1 : -1);
  return true;
}

}  // namespace

uint16_t turn_normal(uint16_t code, int pole) { return pole == kRaw ? code : table(pole, false)[code]; }
const uint16_t* turn_table(int pole) { return table(pole, false).data(); }
uint16_t turn_back(uint16_t code, int pole) { return pole == kRaw ? code : table(pole, true)[code]; }

void make_geometry_guide(const TileShape& shape, const DepthPlane& depth, const GeometryModel* geometry, uint16_t base,
                         Plane<int16_t>& x_guide, Plane<int16_t>& y_guide) {
  const int x0 = -static_cast<int>(shape.width / 2), y0 = -static_cast<int>(shape.height / 2);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.around(y);
    if (geometry == nullptr) {
      std::fill_n(x_guide.row(r), shape.width, static_cast<int16_t>((base & 255) * 64));
      std::fill_n(y_guide.row(r), shape.width, static_cast<int16_t>((base >> 8) * 64));
      continue;
    }
    const uint32_t* const rows[3] = {depth.depth.row(r - 1) + begin, depth.depth.row(r) + begin,
                                     depth.depth.row(r + 1) + begin};
    kernels().geometry(rows, end - begin, x0 + static_cast<int>(begin), y0 + static_cast<int>(y), *geometry,
                       x_guide.row(r) + begin, y_guide.row(r) + begin);
  }
}

void put_geometry(BitSink& bits, const GeometryModel& geometry) {
  for (const auto& row : geometry.matrix)
    for (const int16_t e : row) bits.put(static_cast<uint16_t>(e), 16);
  bits.put(static_cast<uint64_t>(geometry.slope_shift), 4);
  bits.put(static_cast<uint64_t>(geometry.height_shift), 4);
}

bool get_geometry(BitReader& bits, GeometryModel& geometry) {
  int total = 0;
  for (auto& row : geometry.matrix)
    for (int16_t& e : row) total += std::abs(int{e = static_cast<int16_t>(bits.source.take(16))});
  geometry.slope_shift = static_cast<int>(bits.source.take(4));
  geometry.height_shift = static_cast<int>(bits.source.take(4));
  return total <= kMostMatrix;
}

void PoleChoice::add(uint16_t code) {
  const Point p = point_of(code);
  sum_[0] += p.x, sum_[1] += p.y, sum_[2] += p.z;
}

int PoleChoice::best() const {
  int axis = 2;
  for (int a = 0; a < 2; ++a)
    if (std::abs(sum_[a]) > std::abs(sum_[axis])) axis = a;
  return 2 * axis + (sum_[axis] < 0 ? 1 : 0);
}

void NormalPlanes::reset(const TileShape& shape, int reach) {
  lattice_ = NormalLattice(reach);
  may_be_exact_ = reach != 0, exact_ = false;
  for (GuidedPlane& p : plane) p.reset(shape);
  activity.reset(shape.width, shape.height);
}

int NormalPlanes::choose_pole(const TileShape& shape, const PixelRows<uint16_t>& codes) const {
  uint32_t others = 0;
  for (size_t y = 0; y < shape.height; ++y) {
    if (lattice_.step() != 1) break;  // within bounds another code of the same direction is as good
    const auto [begin, end] = shape.span(y);
    others |=
        kernels().other_normals(shape.full(y) ? nullptr : shape.cover(y) + begin, codes.row(y) + begin, end - begin);
  }
  if (others != 0) return kRaw;
  PoleChoice choice;
  for (const auto p : samples.places) choice.add(codes.row(static_cast<size_t>(p.y))[p.x]);
  return choice.best();
}

void NormalPlanes::be_exact() { exact_ = true, lattice_ = NormalLattice(0); }

// Whether normals as they are take few bits. Fits weights to them.
bool NormalPlanes::smooth(const TileShape& shape) {
  double left_over = 0;
  for (GuidedPlane& p : plane) {
    for (size_t y = 0; y < shape.height; ++y) p.finish_row(shape, y);
    p.fit(samples, nullptr);
    left_over += p.left_over;
  }
  return left_over < kSmooth;
}

// The guide in 64ths of a code -> of the lattice's steps.
void NormalPlanes::to_lattice(const TileShape& shape) {
  if (lattice_.step() == 1) return;
  for (GuidedPlane& p : plane) p.most = lattice_.most();
  for (GuidedPlane& p : plane) {
    for (size_t y = 0; y < shape.height; ++y) {
      const auto [begin, end] = shape.around(y);
      int16_t* const row = p.guide.row(static_cast<ptrdiff_t>(y)) + begin;
      kernels().divide(row, end - begin, lattice_.offset64(), lattice_.share());
    }
    p.begin(shape);
  }
}

// Without geometry it is the first pixel's normal everywhere.
void NormalPlanes::make_guide(const TileShape& shape, const DepthPlane& depth, uint16_t base) {
  make_geometry_guide(shape, depth, geometry(), turn_normal(base, pole_), plane[0].guide, plane[1].guide);
  for (GuidedPlane& p : plane) p.begin(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.around(y);
    const auto rows = [&, first = begin](const GuidedPlane& p) {
      return std::array<const int16_t*, 3>{p.guide.row(r - 1) + first, p.guide.row(r) + first,
                                           p.guide.row(r + 1) + first};
    };
    kernels().activity(rows(plane[0]).data(), rows(plane[1]).data(), end - begin, activity.row(r) + begin);
    activity.row(r)[-1] = activity.row(r)[0], activity.row(r)[shape.width] = activity.row(r)[shape.width - 1];
  }
  plane[0].symbols.other = &activity;
  plane[1].symbols.other = &plane[0].symbols.tokens;
}

bool NormalPlanes::find_geometry(const DepthPlane& depth, const Plane<int16_t>* const values[2], const RoomAxes* axes,
                                 int x0, int y0) {
  double known[9];
  return (axes != nullptr && normals_of(*axes, pole_, known) &&
          known_geometry(samples, depth.depth, values, x0, y0, known, geometry_)) ||
         fit_geometry(samples, depth.depth, values, x0, y0, geometry_);
}

void NormalPlanes::encode(const TileShape& shape, const PixelRows<uint16_t>& codes, const DepthPlane& depth,
                          uint16_t base, bool of_one_colour, const RoomAxes* axes, BitSink& bits) {
  samples.choose(shape, std::min<size_t>(kMostSamples, shape.total / 16));
  pole_ = choose_pole(shape, codes);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto [begin, end] = shape.span(y);
    int16_t* const x_row = plane[0].values.row(static_cast<ptrdiff_t>(y)) + begin;
    int16_t* const y_row = plane[1].values.row(static_cast<ptrdiff_t>(y)) + begin;
    const uint16_t* const from = codes.row(y) + begin;
    if (pole_ != kRaw)
      kernels().turn_normals(from, end - begin, pole_, x_row, y_row);
    else
      for (size_t x = 0; x < end - begin; ++x)
        x_row[x] = static_cast<int16_t>((from[x] & 255) * 64), y_row[x] = static_cast<int16_t>((from[x] >> 8) * 64);
  }
  const Plane<int16_t>* const values[2] = {&plane[0].values, &plane[1].values};
  has_geometry_ = pole_ != kRaw && find_geometry(depth, values, axes, -static_cast<int>(shape.width / 2),
                                                 -static_cast<int>(shape.height / 2));
  make_guide(shape, depth, base);
  if (may_be_exact_ && of_one_colour && smooth(shape)) be_exact();
  to_lattice(shape);
  for (GuidedPlane& p : plane)
    for (size_t y = 0; y < shape.height; ++y) {
      const auto [begin, end] = shape.span(y);
      int16_t* const row = p.values.row(static_cast<ptrdiff_t>(y));
      if (lattice_.step() != 1)
        for (size_t x = begin; x < end; ++x) row[x] = static_cast<int16_t>(lattice_.index(row[x] >> 6) * 64);
      p.finish_row(shape, y);
    }
  const FlatSamples* by_flatness = nullptr;
  for (GuidedPlane& p : plane) {
    const GuidedPlane* const before = &p == &plane[1] ? &plane[0] : nullptr;
    p.fit(samples, before);
    const bool rough =
        depth.faceted && std::isfinite(p.left_over) && p.left_over > (lattice_.step() == 1 ? kRough : kRoughWithin);
    if (rough && by_flatness == nullptr && choose_flatness(shape, depth)) by_flatness = &flat;
    p.encode_fitted(shape, before, rough ? by_flatness : nullptr);
  }
  put_header(bits);
}

void NormalPlanes::put_header(BitSink& bits) const {
  bits.put(static_cast<uint64_t>(pole_), 3);
  bits.put(has_geometry_, 1);
  if (has_geometry_) put_geometry(bits, geometry_);
  if (may_be_exact_) bits.put(exact_, 1);
  for (const GuidedPlane& p : plane) p.put_weights(bits);
  const bool any = plane[0].flatness != nullptr || plane[1].flatness != nullptr;
  bits.put(any, 1);
  if (!any) return;
  bits.put(static_cast<uint64_t>(flat_exponent_), kFlatExponentBits);
  for (const GuidedPlane& p : plane) bits.put(p.flatness != nullptr, 1);
  for (const GuidedPlane& p : plane)
    if (p.flatness != nullptr) p.put_flat_weights(bits);
}

void NormalPlanes::find_flatness(const TileShape& shape, const DepthPlane& depth) {
  flatness_.reset(shape.width, shape.height);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const auto [begin, end] = shape.span(y);
    kernels().flatness(depth.depth.row(r - 2) + begin, depth.depth.row(r - 1) + begin, depth.depth.row(r) + begin,
                       end - begin, 1u << flat_exponent_, flatness_.row(r) + begin);
  }
}

// Chosen so that three of four pixels lie in the plane of L, U and UL.
bool NormalPlanes::choose_flatness(const TileShape& shape, const DepthPlane& depth) {
  flat.samples.choose(shape, std::min<size_t>(kMostFlatSamples, shape.total / 10));
  if (flat.samples.places.empty()) return false;
  std::vector<uint32_t> off;
  for (const auto& p : flat.samples.places) {
    const uint32_t *const row = depth.depth.row(p.y) + p.x, *const above = depth.depth.row(p.y - 1) + p.x;
    off.push_back(static_cast<uint32_t>(std::abs(static_cast<int>(row[0] - row[-1] - above[0] + above[-1]))));
  }
  const auto at = off.begin() + static_cast<ptrdiff_t>(off.size() * 3 / 4);
  std::nth_element(off.begin(), at, off.end());
  flat_exponent_ =
      std::min(static_cast<int>(std::bit_width(*at)), depth.in_steps ? kMostFlatExponent : kEnoughFlatExponent);
  find_flatness(shape, depth);
  flat.flatness = &flatness_;
  return true;
}

bool NormalPlanes::decode_header(const TileShape& shape, const DepthPlane& depth, uint16_t base, BitReader& bits) {
  pole_ = static_cast<int>(bits.source.take(3));
  has_geometry_ = bits.source.take(1) != 0;
  if (pole_ > kRaw) return false;
  if (has_geometry_ && !get_geometry(bits, geometry_)) return false;
  if (may_be_exact_ && bits.source.take(1) != 0) be_exact();
  for (GuidedPlane& p : plane)
    if (!p.get_weights(bits)) return false;
  if (bits.source.take(1) != 0) {
    flat_exponent_ = static_cast<int>(bits.source.take(kFlatExponentBits));
    if (flat_exponent_ > kMostFlatExponent) return false;
    find_flatness(shape, depth);
    for (GuidedPlane& p : plane) p.flatness = bits.source.take(1) != 0 ? &flatness_ : nullptr;
    for (GuidedPlane& p : plane)
      if (p.flatness != nullptr && !p.get_flat_weights(bits)) return false;
  }
  make_guide(shape, depth, base);
  to_lattice(shape);
  return true;
}

void NormalPlanes::decode_sums(const TileShape& shape, size_t y) {
  plane[0].decode_sums(shape, y, nullptr);
  plane[1].decode_sums(shape, y, &plane[0]);
}

void NormalPlanes::get_codes(const TileShape& shape, size_t y, uint16_t* out) {
  const auto [begin, end] = shape.span(y);
  const int16_t* rows[2];
  for (size_t i = 0; i < 2; ++i) {
    rows[i] = plane[i].values.row(static_cast<ptrdiff_t>(y)) + begin;
    if (lattice_.step() == 1) continue;
    std::vector<int16_t>& codes_of = row_of_codes_[i];
    if (codes_of.size() < shape.width) codes_of.resize(shape.width);
    const auto step = static_cast<int16_t>(lattice_.step() * 64), first = static_cast<int16_t>(lattice_.value(0) * 64),
               most = static_cast<int16_t>(lattice_.most());
    for (size_t x = 0; x < end - begin; ++x)
      codes_of[x] = static_cast<int16_t>(first + std::min(static_cast<int16_t>(rows[i][x] >> 6), most) * step);
    rows[i] = codes_of.data();
  }
  out += begin;
  if (pole_ != kRaw)
    kernels().turn_normals_back(rows[0], rows[1], end - begin, pole_, out);
  else
    for (size_t x = 0; x < end - begin; ++x) out[x] = static_cast<uint16_t>(rows[0][x] >> 6 | rows[1][x] << 2);
}

}  // namespace telesplat::codec::detail
