// Sizes of planes of numbers in general picture formats: a baseline for codecs.
#pragma once

#include <cstddef>
#include <span>
#include <string>

namespace telesplat::image {

/// Bytes of a lossless picture file, made in memory. extension: "png", or "tif" with compression "lzw", which takes
/// differences of neighbours. compression: empty: the format's own. planes: channels interleaved, row after row, of
/// unsigned values of value_bytes, 1 or 4. 0: OpenImageIO writes no such file. Precondition: planes has width x height
/// x channels values.
size_t plane_file_bytes(const std::string& extension, const std::string& compression, int width, int height,
                        int channels, int value_bytes, std::span<const std::byte> planes);

}  // namespace telesplat::image
