// Codec for depth images, a tile at a time: depth, colour, normal and coverage mask. Lossless, or within bounds of
// error; a refinement makes bounded images exact.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "common/codec/error_bounds.h"
#include "common/core/result.h"
#include "common/image/depth_image.h"

namespace telesplat::codec {

/// Largest image a stream may describe; decode() refuses more before it allocates.
inline constexpr size_t kMaxPixels = size_t{1} << 24;

/// Encodes a canonical depth image (image/depth_image.h) of 1..kMaxPixels pixels. Codes both fully and sparsely covered
/// images well: a patch after redundancy elimination is a depth image with most pixels masked out. Deterministic: the
/// same image and bounds give the same bytes. Thread-safe. bounds: largest differences between `image` and the decoded
/// image, within the limits of ErrorBounds. decoded: if not null, becomes the image that decode() returns.
std::vector<uint8_t> encode(const image::DepthImage& image, const ErrorBounds& bounds = {},
                            image::DepthImage* decoded = nullptr);

/// Decodes the bytes of encode(): decode(encode(x)) == x, and decode(encode(x, bounds)) is within the bounds of x. Any
/// other bytes give an error or some canonical image, never more than kMaxPixels pixels, never a read or write out of
/// bounds; memory stays proportional to the pixels of the stream's header, which must be plausible for the stream's
/// length, and a table for the bounds of at most 8 MiB. `expected_width`/`expected_height`: refuses other sizes (0:
/// any).
Result<image::DepthImage> decode(std::span<const uint8_t> bytes, int expected_width = 0, int expected_height = 0);

/// Decodes into `image`, reusing its memory: page faults of several hundred new kilobytes a tile would cost about a
/// sixth of the decoding time. On failure `image` is left empty, 0 x 0.
Status decode_into(image::DepthImage& image, std::span<const uint8_t> bytes, int expected_width = 0,
                   int expected_height = 0);

/// Encodes the difference to a bounded image: decode_refinement(encode_refinement(exact, bounded), bounded) == exact,
/// bit for bit. `bounded`: the decoded image, or any of the same size that covers the same pixels; both must be
/// canonical. The nearer they are to each other, the fewer the bytes. Deterministic, thread-safe.
std::vector<uint8_t> encode_refinement(const image::DepthImage& exact, const image::DepthImage& bounded);

/// Returns the exact image. Any other bytes give an error or some canonical image that covers the same pixels, with the
/// same promises as decode(). It does not always notice a refinement of another image than `bounded`: the sender names
/// the image with both.
Result<image::DepthImage> decode_refinement(std::span<const uint8_t> bytes, const image::DepthImage& bounded);

/// For `telesplat inspect`: size and parts of a stream without decoding its pixels.
struct StreamInfo {
  int width = 0, height = 0;
  size_t covered_pixels = 0;
  size_t mask_bytes = 0, depth_bytes = 0, colour_bytes = 0, normal_bytes = 0;
  size_t sparse_bytes = 0;  ///< sparse tiles: depth, colour and normal together
  ErrorBounds bounds;       ///< bounds of the decoded image
};
Result<StreamInfo> inspect(std::span<const uint8_t> bytes);

}  // namespace telesplat::codec
