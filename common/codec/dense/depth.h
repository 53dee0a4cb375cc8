// Depth of a dense tile: predicted as L + U - UL, which is exact on planes. If triangles are only a few pixels large,
// most pixels lie in a plane through other neighbours: then each symbol names the plane. Within bounds, if steps exceed
// the roughness of surfaces, the mean of four such planes adds up less of the steps' rounding.
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

  /// Sets the pixels above the first row to `base`.
  void reset(const TileShape& shape, uint32_t base);
  /// depth -> symbols, once all rows are set. Sets pixels that are not covered to their predictions. may_mean: kMean is
  /// allowed.
  void encode(const TileShape& shape, bool may_mean);
  /// To be called before the first decode_row().
  [[nodiscard]] bool begin_decoding(const TileShape& shape, BitReader& bits);
  static constexpr unsigned kWayBits = 2;
  /// Converts covered or all pixels between codes and their indices in `lattice`. Within bounds, indices are coded.
  void to_indices(const TileShape& shape, const DepthLattice& lattice);
  void to_codes(const TileShape& shape, const DepthLattice& lattice);
  /// Decodes the next row from its symbols. False: a covered depth is 0, or above `most`.
  [[nodiscard]] bool decode_row(const TileShape& shape, size_t y, uint32_t most);
  /// Continues slopes beyond the tile's edges, for geometry(). To be called once all rows are known.
  void extend(const TileShape& shape);

 private:
  void find_residuals(const TileShape& shape, size_t y, Way by);
  double bits_by(const TileShape& shape, Way by);
  void decode_by_planes(const TileShape& shape, size_t y);
  std::vector<uint32_t> terms_[3];
};

}  // namespace telesplat::codec::detail
