// Normals of a dense tile, after its depth: the octahedron turned so that its seam is far away, predicted from
// neighbours and from depth's slopes.
#pragma once

#include <cstdint>

#include "common/codec/dense/depth.h"
#include "common/codec/dense/guided.h"
#include "common/codec/room_axes.h"

namespace telesplat::codec::detail {

/// Octahedral codes with another axis of the lattice as the pole: 0 to 5 of kPoles; kRaw: as they are.
/// A permutation of the canonical codes; the lattice's points stay what they are.
inline constexpr int kPoles = 6, kRaw = 6;
/// Of several codes of a direction all become the canonical one, unless the pole is kRaw.
uint16_t turn_normal(uint16_t code, int pole);
/// turn_normal() of all codes. Precondition: pole < kPoles.
const uint16_t* turn_table(int pole);
uint16_t turn_back(uint16_t code, int pole);

/// Guides of both coordinates, in 64ths of a code: what the geometry says, or `base` everywhere if it is null.
void make_geometry_guide(const TileShape& shape, const DepthPlane& depth, const GeometryModel* geometry, uint16_t base,
                         Plane<int16_t>& x_guide, Plane<int16_t>& y_guide);
void put_geometry(BitSink& bits, const GeometryModel& geometry);
inline constexpr size_t kGeometryBits = 9 * 16 + 8;
[[nodiscard]] bool get_geometry(BitReader& bits, GeometryModel& geometry);

/// Finds the pole that is nearest to many normals.
class PoleChoice {
 public:
  void add(uint16_t code);
  int best() const;

 private:
  int64_t sum_[3] = {};
};

struct NormalPlanes {
  /// reach: of a NormalLattice; 0: all codes.
  void reset(const TileShape& shape, int reach);
  /// codes -> symbols, and a header. `depth` must be extended. base: the first pixel's code. of_one_colour: all pixels
  /// are, so that normals are all that is seen of them: where they are smooth they are coded as they are, whatever the
  /// bound. axes: of the room, from the tile's centre, or null.
  void encode(const TileShape& shape, const PixelRows<uint16_t>& codes, const DepthPlane& depth, uint16_t base,
              bool of_one_colour, const RoomAxes* axes, BitSink& bits);
  static constexpr size_t kMostBits = 256 + 2 * (GuidedPlane::kMostWeightBits + GuidedPlane::kMostFlatBits);
  [[nodiscard]] bool decode_header(const TileShape& shape, const DepthPlane& depth, uint16_t base, BitReader& bits);
  /// Row y from its symbols, before decode_values().
  void decode_sums(const TileShape& shape, size_t y);
  /// Codes of all pixels of row y, after it.
  void get_codes(const TileShape& shape, size_t y, uint16_t* codes);

  /// What encode() took of what is known, or fitted; null: nothing.
  const GeometryModel* geometry() const { return has_geometry_ ? &geometry_ : nullptr; }

  GuidedPlane plane[2];
  Plane<uint8_t> activity;
  Samples samples;
  FlatSamples flat;

 private:
  bool find_geometry(const DepthPlane& depth, const Plane<int16_t>* const values[2], const RoomAxes* axes, int x0,
                     int y0);
  void put_header(BitSink& bits) const;
  void find_flatness(const TileShape& shape, const DepthPlane& depth);
  bool choose_flatness(const TileShape& shape, const DepthPlane& depth);
  void to_lattice(const TileShape& shape);
  bool smooth(const TileShape& shape);
  void be_exact();
  void make_guide(const TileShape& shape, const DepthPlane& depth, uint16_t base);
  int choose_pole(const TileShape& shape, const PixelRows<uint16_t>& codes) const;
  std::vector<int16_t> row_of_codes_[2];
  NormalLattice lattice_{0};
  bool may_be_exact_ = false, exact_ = false;  ///< of streams with a bound of normals
  Plane<uint8_t> flatness_;
  int flat_exponent_ = 0;  ///< depth that differs by less than 2^flat_exponent_ from what continues it is flat
  int pole_ = kRaw;
  bool has_geometry_ = false;
  GeometryModel geometry_;
};

}  // namespace telesplat::codec::detail
