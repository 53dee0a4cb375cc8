// Normals of a dense tile, after its depth: the octahedron turned so that its seam is far away, predicted from
// neighbours and from depth's slopes.
#pragma once

#include <cstdint>

#include "common/codec/dense/depth.h"
#include "common/codec/dense/guided.h"
#include "common/codec/poles.h"
#include "common/codec/room_axes.h"

namespace telesplat::codec::detail {

struct NormalPlanes {
  /// reach: of a NormalLattice; 0: exact codes.
  void reset(const TileShape& shape, int reach);
  /// codes -> symbols. `depth` must be extended. base: the first pixel's code. one_colour: all pixels have the same
  /// colour, so that only normals show the surface: if they are smooth they are coded exactly, even with a bound.
  /// axes: of the room, from the tile's centre, or null.
  void encode(const TileShape& shape, const PixelRows<uint16_t>& codes, const DepthPlane& depth, uint16_t base,
              bool one_colour, const RoomAxes* axes);
  void put_header(BitSink& bits) const;
  static constexpr size_t kMostBits = 256 + 2 * GuidedPlane::kMostWeightBits;
  [[nodiscard]] bool decode_header(const TileShape& shape, const DepthPlane& depth, uint16_t base, BitReader& bits);
  /// Makes codes of all pixels of row y, once decode_values() made its values.
  void get_codes(const TileShape& shape, size_t y, uint16_t* codes);

  GuidedPlane plane[2];
  Plane<uint8_t> activity;

 private:
  void load(const TileShape& shape, const PixelRows<uint16_t>& codes);
  void make_guide(const TileShape& shape, const DepthPlane& depth, uint16_t base);
  void to_lattice(const TileShape& shape);
  bool are_smooth(const TileShape& shape);
  void use_exact_codes();
  int choose_pole(const TileShape& shape, const PixelRows<uint16_t>& codes) const;

  Samples samples_;
  std::vector<int16_t> row_of_codes_[2];
  NormalLattice lattice_{0};
  bool may_be_exact_ = false, exact_ = false;  ///< streams with a bound of normals may code them exactly; do
  int pole_ = kRaw;
  bool has_geometry_ = false;
  GeometryModel geometry_;
};

}  // namespace telesplat::codec::detail
