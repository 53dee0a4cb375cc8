#include "common/wire/lease_seal.h"

#include <gtest/gtest.h>

namespace telesplat::wire {
namespace {

Lease some_lease() {
  Lease l{.lease = {1}, .frame = {2}, .epoch = {3}, .viewer = {4}, .request = {5}, .tile = 6};
  l.blocks_in_frame = 7;
  l.camera = geometry::make_camera({}, 60, 64, 48);
  l.rect = l.block_rect = {0, 0, 64, 48};
  l.master = {8};
  return l;
}

TEST(LeaseSeals, AreOfTheWholeLeaseItsSamplerAndItsKey) {
  const auto key = make_lease_key();
  Lease l = some_lease();
  EXPECT_FALSE(is_sealed(l, {9}, key)) << "none yet";
  seal(l, {9}, key);
  EXPECT_TRUE(is_sealed(l, {9}, key));
  EXPECT_FALSE(is_sealed(l, {10}, key));
  EXPECT_FALSE(is_sealed(l, {9}, make_lease_key()));
  EXPECT_FALSE(is_sealed(l, {9}, {})) << "a key that is not known";
  const auto changed = [&](auto&& change) {
    Lease other = l;
    change(other);
    return is_sealed(other, {9}, key);
  };
  EXPECT_FALSE(changed([](Lease& o) { o.lease = {2}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.frame = {3}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.epoch = {4}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.viewer = {5}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.request = {6}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.tile = 0; }));
  EXPECT_FALSE(changed([](Lease& o) { o.step = 4; }));
  EXPECT_FALSE(changed([](Lease& o) { o.block = 1; }));
  EXPECT_FALSE(changed([](Lease& o) { o.blocks_in_frame = 1; }));
  EXPECT_FALSE(changed([](Lease& o) { o.camera.pose.position_room.x = 1; }));
  EXPECT_FALSE(changed([](Lease& o) { o.rect.width = 32; }));
  EXPECT_FALSE(changed([](Lease& o) { o.block_rect.width = 32; }));
  EXPECT_FALSE(changed([](Lease& o) { o.extra = true; }));
  EXPECT_FALSE(changed([](Lease& o) { o.footprint = 1; }));
  EXPECT_FALSE(changed([](Lease& o) { o.master = {9}; }));
  EXPECT_FALSE(changed([](Lease& o) { o.seal[0] ^= 1; }));
  EXPECT_FALSE(changed([](Lease& o) { o.seal.pop_back(); }));
  EXPECT_TRUE(changed([](Lease& o) { o.rays = 7, o.mask = {1}, o.moments.leased_s = 1; })) << "a sampler changes them";
}

TEST(LeaseSeals, OfSlabsAreOfTheirViewsToo) {
  const auto key = make_lease_key();
  SliceLease l{.lease = {1}, .frame = {2}, .epoch = {3}, .partition = 4, .slab = 0, .slabs = 2, .begin = 0, .end = 5};
  l.views = {{{7}, {5}, geometry::make_camera({}, 60, 64, 48), 0, {}}};
  seal(l, {9}, key);
  EXPECT_TRUE(is_sealed(l, {9}, key));
  l.moments.sample_begin_s = 3;
  EXPECT_TRUE(is_sealed(l, {9}, key));
  l.views[0].viewer = {8};
  EXPECT_FALSE(is_sealed(l, {9}, key));
}

}  // namespace
}  // namespace telesplat::wire
