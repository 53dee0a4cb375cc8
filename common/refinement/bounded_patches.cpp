#include "common/refinement/bounded_patches.h"

#include "common/codec/depth_codec.h"

namespace telesplat::refinement {

Result<std::optional<points::PreparedRefinement>> BoundedPatches::refine(const points::ModelConfig& config,
                                                                         Sequence sequence, Sequence of,
                                                                         std::span<const uint8_t> stream) {
  const auto patch = book_.take(of);
  if (!patch) return std::optional<points::PreparedRefinement>();
  const auto bounded = codec::decode(patch->stream, patch->rect.width, patch->rect.height);
  if (!bounded) return bounded.error();
  const auto exact = codec::decode_refinement(stream, *bounded);
  if (!exact) return exact.error();
  return std::optional(
      points::prepare_refinement(config, sequence, of, {patch->camera, patch->rect, *bounded, *exact, patch->tag}));
}

}  // namespace telesplat::refinement
