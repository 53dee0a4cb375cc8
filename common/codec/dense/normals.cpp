#include "common/codec/dense/normals.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "common/image/normal.h"

namespace telesplat::codec::detail {
namespace {

constexpr double kSmooth = 3.0;  // sum of both coordinates' mean tokens

// Makes the matrix that turns slopes and height into normals towards the eye, turned by `pole`: -1 times the inverse of
// the axes' transpose. Returns false if there is no inverse.
bool normals_of(const RoomAxes& axes, int pole, double out[9]) {
  RoomAxes cofactors;
  double determinant = 0;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j) {
      const size_t a = (i + 1) % 3, b = (i + 2) % 3, c = (j + 1) % 3, d = (j + 2) % 3;
      cofactors[i][j] = axes[a][c] * axes[b][d] - axes[a][d] * axes[b][c];
      if (i == 0) determinant += axes[i][j] * cofactors[i][j];
    }
  if (!(std::abs(determinant) > 0)) return false;
  const size_t first = pole / 2 == 0 ? 1 : pole / 2 == 1 ? 2 : 0;
  for (size_t i = 0; i < 3; ++i)
    for (size_t j = 0; j < 3; ++j)
      out[3 * i + j] = cofactors[(first + i) % 3][j] / determinant * (i == 2 && pole % 2 != 0 ? 1 : -1);
  return true;
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

}  // namespace

void NormalPlanes::reset(const TileShape& shape, int reach) {
  lattice_ = NormalLattice(reach);
  may_be_exact_ = reach != 0, exact_ = false;
  for (GuidedPlane& p : plane) p.reset(shape, GuidedPlane::kByteBits, 254);
  activity.reset(shape.width, shape.height);
}

int NormalPlanes::choose_pole(const TileShape& shape, const PixelRows<uint16_t>& codes) const {
  bool canonical = true;
  if (lattice_.step() == 1)  // within bounds, any code of the same direction will do
    for (size_t y = 0; y < shape.height; ++y)
      shape.for_each_run(y, [&, row = codes.row(y)](size_t x, size_t end) {
        for (; x < end; ++x) canonical &= image::canonical_normal16(row[x]) == row[x];
      });
  if (!canonical) return kRaw;
  PoleChoice choice;
  for (const auto p : samples_.places) choice.add(codes.row(static_cast<size_t>(p.y))[p.x]);
  return choice.best();
}

void NormalPlanes::use_exact_codes() { exact_ = true, lattice_ = NormalLattice(0); }

// True if exact normals take few bits.
bool NormalPlanes::are_smooth(const TileShape& shape) {
  double left_over = 0;
  for (GuidedPlane& p : plane) {
    for (size_t y = 0; y < shape.height; ++y) p.finish_row(shape, y);
    left_over += p.fit(samples_, nullptr);
  }
  return left_over < kSmooth;
}

// Converts the guide from 64ths of a code to the lattice's steps.
void NormalPlanes::to_lattice(const TileShape& shape) {
  if (lattice_.step() == 1) return;
  for (GuidedPlane& p : plane) {
    p.most = lattice_.most();
    for (size_t y = 0; y < shape.height; ++y)
      divide(p.guide.row(static_cast<ptrdiff_t>(y)), shape.width, lattice_.offset64(), lattice_.share());
    p.begin(shape);
  }
}

// Fills the guide from depth's geometry; without a geometry, with the first pixel's normal.
void NormalPlanes::make_guide(const TileShape& shape, const DepthPlane& depth, uint16_t base) {
  const int x0 = -static_cast<int>(shape.width / 2), y0 = -static_cast<int>(shape.height / 2);
  const uint16_t turned = turn_normal(base, pole_);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    int16_t* const guide[2] = {plane[0].guide.row(r), plane[1].guide.row(r)};
    if (has_geometry_) {
      const uint32_t* const rows[3] = {depth.depth.row(r - 1), depth.depth.row(r), depth.depth.row(r + 1)};
      geometry(rows, shape.width, x0, y0 + static_cast<int>(y), geometry_, guide);
    } else {
      std::fill_n(guide[0], shape.width, static_cast<int16_t>((turned & 255) * 64));
      std::fill_n(guide[1], shape.width, static_cast<int16_t>((turned >> 8) * 64));
    }
  }
  for (GuidedPlane& p : plane) p.begin(shape);
  for (size_t y = 0; y < shape.height; ++y) {
    const auto r = static_cast<ptrdiff_t>(y);
    const Plane<int16_t>&gx = plane[0].guide, &gy = plane[1].guide;
    const int16_t *const xs[3] = {gx.row(r - 1), gx.row(r), gx.row(r + 1)}, *const ys[3] = {gy.row(r - 1), gy.row(r),
                                                                                            gy.row(r + 1)};
    uint8_t* const row = activity.row(r);
    detail::activity(xs, ys, shape.width, row);
    row[-1] = row[0], row[shape.width] = row[shape.width - 1];
  }
  plane[0].symbols.other = &activity;
  plane[1].symbols.other = &plane[0].symbols.tokens;
}

void NormalPlanes::load(const TileShape& shape, const PixelRows<uint16_t>& codes) {
  for (size_t y = 0; y < shape.height; ++y)
    turn_normals(codes.row(y), shape.width, pole_, plane[0].values.row(static_cast<ptrdiff_t>(y)),
                 plane[1].values.row(static_cast<ptrdiff_t>(y)));
}

void NormalPlanes::encode(const TileShape& shape, const PixelRows<uint16_t>& codes, const DepthPlane& depth,
                          uint16_t base, bool one_colour, const RoomAxes* axes) {
  samples_.choose(shape, std::min<size_t>(kMostSamples, shape.total / 16));
  pole_ = choose_pole(shape, codes);
  load(shape, codes);
  const Plane<int16_t>* const values[2] = {&plane[0].values, &plane[1].values};
  double matrix[9];
  has_geometry_ = axes != nullptr && pole_ != kRaw && normals_of(*axes, pole_, matrix) &&
                  fit_geometry(samples_, shape, depth.depth, values, matrix, geometry_);
  make_guide(shape, depth, base);
  if (may_be_exact_ && one_colour && are_smooth(shape)) use_exact_codes();
  to_lattice(shape);
  for (GuidedPlane& p : plane)
    for (size_t y = 0; y < shape.height; ++y) {
      int16_t* const row = p.values.row(static_cast<ptrdiff_t>(y));
      if (lattice_.step() != 1)
        for (size_t x = 0; x < shape.width; ++x) row[x] = static_cast<int16_t>(lattice_.index(row[x] >> 6) * 64);
      p.finish_row(shape, y);
    }
  for (GuidedPlane& p : plane) {
    const GuidedPlane* const before = &p == &plane[1] ? &plane[0] : nullptr;
    p.fit(samples_, before);
    p.encode(shape, before);
  }
}

void NormalPlanes::put_header(BitSink& bits) const {
  bits.put(static_cast<uint64_t>(pole_), 3);
  bits.put(has_geometry_, 1);
  if (has_geometry_) put_geometry(bits, geometry_);
  if (may_be_exact_) bits.put(exact_, 1);
  for (const GuidedPlane& p : plane) p.put_weights(bits);
}

bool NormalPlanes::decode_header(const TileShape& shape, const DepthPlane& depth, uint16_t base, BitReader& bits) {
  pole_ = static_cast<int>(bits.source.take(3));
  has_geometry_ = bits.source.take(1) != 0;
  if (pole_ > kRaw || (has_geometry_ && !get_geometry(bits, geometry_))) return false;
  if (may_be_exact_ && bits.source.take(1) != 0) use_exact_codes();
  for (GuidedPlane& p : plane)
    if (!p.get_weights(bits)) return false;
  make_guide(shape, depth, base);
  to_lattice(shape);
  return true;
}

void NormalPlanes::get_codes(const TileShape& shape, size_t y, uint16_t* out) {
  const int16_t* rows[2];
  for (size_t i = 0; i < 2; ++i) {
    rows[i] = plane[i].values.row(static_cast<ptrdiff_t>(y));
    if (lattice_.step() == 1) continue;
    std::vector<int16_t>& codes_of = row_of_codes_[i];
    if (codes_of.size() < shape.width) codes_of.resize(shape.width);
    for (size_t x = 0; x < shape.width; ++x)
      codes_of[x] = static_cast<int16_t>(lattice_.value(std::min(rows[i][x] >> 6, lattice_.most())) * 64);
    rows[i] = codes_of.data();
  }
  turn_normals_back(rows[0], rows[1], shape.width, pole_, out);
}

}  // namespace telesplat::codec::detail
