// Samples the tiles of a plan from the test scene.
#pragma once

#include <gtest/gtest.h>

#include <span>
#include <vector>

#include "common/codec/mask_stream.h"
#include "common/wire/tile_messages.h"
#include "services/packer/points/event.h"
#include "tests/support/points_scenes.h"

namespace telesplat::test {

struct PlannedTile {
  packer::SampledTile tile;
  uint64_t rays = 0;
  bool whole = false;  ///< without a mask
};

/// Samples the tiles of a plan that is not full; pixels outside the masks are not covered. A mask that cannot be read,
/// or has another number of rays than its tile says, fails the test.
inline std::vector<PlannedTile> planned_tiles(const wire::PlanRequest& asked, const wire::Plan& plan) {
  std::vector<PlannedTile> out;
  size_t word = 0;
  const size_t count = plan.tiles.size() / wire::kPlanNumbers;
  for (size_t i = 0; i < count; ++i) {
    const uint32_t* n = &plan.tiles[i * wire::kPlanNumbers];
    packer::SampledTile tile;
    tile.frame = asked.frame, tile.epoch = asked.epoch, tile.viewer = asked.viewer, tile.request = asked.request;
    tile.extra = asked.extra;
    tile.tile = uint32_t(i), tile.tiles_in_frame = uint32_t(count);
    tile.camera = plan.camera;
    tile.rect = {int(n[0]), int(n[1]), int(n[2]), int(n[3])};
    tile.image = sample_scene(plan.camera, tile.rect);
    if (n[5] > 0) {
      const auto mask =
          codec::decode_mask(std::span(plan.masks).subspan(word, n[5]), tile.rect.width, tile.rect.height);
      EXPECT_TRUE(mask.ok());
      if (!mask) return out;
      EXPECT_EQ(mask->count(), n[4]);
      for (int y = 0; y < tile.rect.height; ++y)
        for (int x = 0; x < tile.rect.width; ++x) {
          const size_t p = size_t(y) * tile.rect.width + x;
          if (!mask->at(x, y)) tile.image.depth[p] = tile.image.colour[p] = tile.image.normal[p] = 0;
        }
    }
    word += n[5];
    out.push_back({std::move(tile), n[4], n[5] == 0});
  }
  return out;
}

}  // namespace telesplat::test
