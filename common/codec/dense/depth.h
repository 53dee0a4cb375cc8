// Depth of a dense tile: predicted as L + U - UL, which is exact on planes. Where triangles are as small as a few
// pixels, most pixels lie in the plane of some neighbours, but not of those three: there it is said of which. Within
// bounds, where steps are larger than what surfaces are rough, a mean of four such planes adds up less of the steps.
#pragma once

#include <cstdint>
#include <vector>

#include "common/codec/dense/symbols.h"
#include "common/codec/lattice.h"

namespace telesplat::codec::detail {

/// Depths of a tile with the rows and columns around it, and their symbols.
struct DepthPlane {
  Plane<uint32_t> depth;
  SymbolPlane symbols;
  enum Way : uint8_t { kLinear = 0, kPlanes = 1, kMean = 2 };
  Way way = kLinear;

  /// What lies above and to the left of the first pixel is `base`.
  void reset(const TileShape& shape, uint32_t base);
  /// depth -> symbols, once all rows were set. Gives pixels that are not covered their predictions.
  /// may_mean: kMean may be chosen.
  void encode(const TileShape& shape, bool may_mean);
  /// Before the first decode_row().
  [[nodiscard]] bool begin_decoding(const TileShape& shape, BitReader& bits);
  static constexpr unsigned kWayBits = 2;
  /// Indices of `lattice` <-> the codes that they stand for, for all pixels, or those that are covered. What is coded
  /// within bounds are indices.
  void to_indices(const TileShape& shape, const DepthLattice& lattice);
  void to_codes(const TileShape& shape, const DepthLattice& lattice);
  /// The next row from its symbols. False where a covered depth would be 0, or above `most`.
  [[nodiscard]] bool decode_row(const TileShape& shape, size_t y, uint32_t most);
  /// Continues slopes beyond the tile's edges, as geometry needs it, once all rows are known.
  void extend(const TileShape& shape);

 private:
  void find_residuals(const TileShape& shape, size_t y, Way by);
  double bits_by(const TileShape& shape, Way by);
  void decode_by_planes(const TileShape& shape, size_t y);
  std::vector<uint32_t> terms_[3];
};

}  // namespace telesplat::codec::detail
