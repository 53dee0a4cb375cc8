// One tile of a refinement: the exact pixels, where those within bounds are known. docs/codec.md describes it.
#pragma once

#include <cstdint>
#include <vector>

#include "common/codec/dense/colours.h"
#include "common/codec/dense/depth.h"
#include "common/codec/dense/normals.h"
#include "common/codec/entropy.h"
#include "common/codec/tile_rect.h"
#include "common/image/depth_image.h"

namespace telesplat::codec::detail {

/// How far the exact pixels of a tile are from those that are known.
struct Reach {
  uint32_t depth = 0;  ///< a code c is known within floor(c * depth / 2^32)
  int pole = 0;        ///< by which normals are turned: 0 to kPoles - 1
  int normal = 0;      ///< of each coordinate on that map
  int colour = 0;      ///< of each channel
  bool none() const { return depth == 0 && normal == 0 && colour == 0; }

  /// Between which codes the exact one lies.
  struct Codes {
    uint32_t low, high;
  };
  Codes around(uint32_t known) const {
    const auto by = static_cast<uint32_t>(uint64_t{known} * depth >> 32);
    return {known - std::min(by, known - 1), std::min(known + by, image::kMaxDepthCode)};
  }
};

/// What codes dense tiles of refinements. One a thread: it keeps its memory.
class RefinementCoder {
 public:
  /// Appends what makes the pixels of `rect` exact, all of them or those that `mask` covers. The tile must be 16 pixels
  /// wide or more.
  void put(std::vector<uint8_t>& out, const image::DepthImage& exact, const image::DepthImage& known,
           const TileRect& rect, const Mask* mask, const Reach& reach);
  /// `image` holds what is known, and gets the exact pixels. False where the stream is damaged.
  [[nodiscard]] bool get(Reader& in, image::DepthImage& image, const TileRect& rect, const Mask* mask,
                         const Reach& reach);

 private:
  struct NearPlane {
    GuidedPlane exact;
    Plane<int16_t> known;  ///< in 64ths, as GuidedPlane has values
  };
  void begin(const TileRect& rect, const Mask* mask);
  void load_known(const image::DepthImage& known, const TileRect& rect);
  void load_exact(const image::DepthImage& exact, const TileRect& rect);
  void encode_depth(const Reach& reach, BitSink& bits);
  void encode_near_depth(const Reach& reach);
  [[nodiscard]] bool decode_depth(const Reach& reach, WordSource& source);
  [[nodiscard]] bool decode_near_row(const Reach& reach, size_t y);
  void fill_hole(size_t x, size_t y);
  void load_normals(const Reach& reach, bool with_exact);
  void begin_normals();
  void finish_normals(size_t plane, size_t y);
  void predict_normals(const Reach& reach, size_t plane, size_t y);
  void encode_normals(const Reach& reach, BitSink& bits);
  [[nodiscard]] bool decode_normals(const Reach& reach, WordSource& source);
  void begin_near_colours();
  void encode_near_colours();
  void encode_colours(const Reach& reach, BitSink& bits);
  [[nodiscard]] bool decode_colours(const Reach& reach, WordSource& source);
  void add_plane(SymbolPlane& plane);
  void end_group(BitSink& bits);
  void put_words(std::vector<uint8_t>& out);

  TileShape shape_;
  DepthPlane depth_;          ///< exact
  SymbolPlane near_symbols_;  ///< of depth
  bool near_depth_ = false;   ///< by where it may lie; else as if nothing were known
  std::vector<uint32_t> known_depth_, exact_colours_, known_colours_;
  std::vector<int32_t> guesses_;
  std::vector<uint16_t> exact_normals_, known_normals_;
  NearPlane normal_[2];
  bool has_geometry_ = false;
  GeometryModel geometry_;
  Samples samples_;
  ColourPlanes colours_;
  bool near_colours_ = false;
  SymbolPlane near_channel_[3];
  std::vector<SymbolPlane*> planes_;  ///< in the order in which they are coded
  std::vector<size_t> group_ends_;    ///< places behind those that are coded row by row
  PlaneEncoder encoders_[6];
  PlaneDecoder decoders_[6];
  BitWriter writer_;
  BitReader reader_;
  std::vector<uint8_t> words_;
};

}  // namespace telesplat::codec::detail
