// Masks of surfaces: where runs of covered pixels begin and end, by where they do in the row above.
#pragma once

#include <cstdint>
#include <vector>

#include "common/codec/mask.h"

namespace telesplat::codec::detail {

/// Appends `mask` at `out`: few bytes where rows are like those above, more than put_mask() has of scattered pixels. As
/// in modified modified READ (ITU-T T.6) an edge is where the one above is, or a little beside it, or there is none any
/// more, or it is new; which of these is coded by how likely it is. See docs/codec.md.
void put_edges(std::vector<uint8_t>& out, const Mask& mask);
/// Fills a mask whose size was set by reset(); false where the stream is damaged.
[[nodiscard]] bool get_edges(Reader& in, Mask& mask);

}  // namespace telesplat::codec::detail
