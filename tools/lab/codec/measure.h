// What depth images take and how fast they are coded, beside LZW and zstd.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/image/depth_image.h"

namespace telesplat::lab {

/// A row of the table: what the tiles of some images came to.
struct CodecFigures {
  std::string name;
  size_t images = 0, tiles = 0, covered = 0;  ///< covered: pixels
  size_t bits = 0, lzw_bits = 0, zstd_bits = 0;
  double encode_s = 0, decode_s = 0;  ///< processor time of one thread
};

/// Cuts an image into tiles as a session does, 256 pixels a side, and adds those that cover anything. Each is coded
/// three times, of which the fastest counts. zstd: level 3, one byte plane after the other. Error: what comes back from
/// the codec is not what went in.
Status add(const image::DepthImage& image, CodecFigures& to);

/// A row each: bits a covered pixel, their ratios, million covered pixels a second.
std::string to_markdown(const std::vector<CodecFigures>& all);

}  // namespace telesplat::lab
