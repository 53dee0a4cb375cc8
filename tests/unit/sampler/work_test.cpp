// Samplers' work for their leases: Julia sets by epoch, masks.
#include <gtest/gtest.h>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/geometry/trajectory.h"
#include "common/julia/parameters.h"
#include "common/net/dispatch.h"
#include "services/sampler/julia/tiles.h"
#include "services/sampler/tiles/work.h"
#include "tests/support/masks.h"

namespace telesplat::sampler {
namespace {

using State = Readiness::State;

HeldLease lease(uint64_t id, EpochId epoch, geometry::Rect rect, double received_s) {
  const auto camera = geometry::make_camera(geometry::default_pose(), 90, 48, 32);
  wire::Lease l{.lease = {id}, .epoch = epoch, .camera = camera, .rect = rect};
  return {l, received_s};
}

wire::Welcome welcome(EpochId epoch, double c_x, InstanceId master = {7}) {
  julia::Parameters parameters;
  parameters.c.x = c_x;
  const auto placement = julia::place(julia::bounds(parameters), 0.8);
  wire::Welcome w;
  w.master = master;
  w.epoch = epoch;
  w.parameters = julia::to_map(parameters);
  w.parameters.merge(julia::to_map(placement));
  w.box_room = placement.box_room;
  return w;
}

TEST(JuliaTiles, SamplesEachLeaseWithItsEpochsParameters) {
  JuliaTiles work(1);
  EXPECT_FALSE(work.takes_leases());
  work.on_welcome(welcome({1}, 0));
  work.on_welcome(welcome({2}, -0.6));
  ASSERT_TRUE(work.takes_leases());
  const auto first = lease(1, {1}, {0, 8, 48, 16}, 0), second = lease(2, {2}, {0, 8, 48, 16}, 0);
  ASSERT_EQ(work.readiness(first, 0).state, State::kReady);
  ASSERT_EQ(work.readiness(second, 0).state, State::kReady);
  const auto a = work.sample(first), b = work.sample(second);
  EXPECT_EQ(a.image.width, 48);
  EXPECT_EQ(a.image.height, 16);
  EXPECT_GE(a.end_s, a.begin_s);
  EXPECT_NE(a.image, b.image);
  EXPECT_EQ(work.sample(first).image, a.image);
}

TEST(JuliaTiles, TheSurfaceIsThatOfTheLeasesFootprint) {
  JuliaTiles work(1);
  work.on_welcome(welcome({1}, 0.3));
  HeldLease own = lease(1, {1}, {0, 0, 48, 32}, 0), stepped = own, fine = own;
  fine.lease.footprint = 1 / fine.lease.camera.focal_x() / 4;  // as a lease of every fourth pixel
  stepped.lease.step = 4;
  EXPECT_EQ(work.sample(fine).image, work.sample(stepped).image);
  EXPECT_NE(work.sample(fine).image, work.sample(own).image);
  for (const double odd : {1e-300, 1e300}) {
    fine.lease.footprint = odd;
    EXPECT_EQ(work.sample(fine).image.width, 48) << odd;
  }
}

TEST(JuliaTiles, RemembersTheLastEpochsOnly) {
  JuliaTiles work(1);
  for (uint64_t e = 1; e <= kEpochs + 1; ++e) work.on_welcome(welcome({e}, 0.01 * double(e)));
  EXPECT_EQ(work.readiness(lease(1, {1}, {0, 0, 48, 8}, 0), 5).state, State::kHopeless);
  EXPECT_EQ(work.readiness(lease(1, {2}, {0, 0, 48, 8}, 0), 5).state, State::kReady);
}

TEST(JuliaTiles, WaitsAMomentForAnEpochsWelcome) {
  JuliaTiles work(1);
  work.on_welcome(welcome({1}, 0));
  const auto early = lease(1, {2}, {0, 0, 48, 8}, 10);
  const auto r = work.readiness(early, 10.1);
  EXPECT_EQ(r.state, State::kWaits);
  EXPECT_DOUBLE_EQ(r.again_s, 10 + kUnknownEpoch_s);
  EXPECT_EQ(work.readiness(early, r.again_s).state, State::kHopeless);
  work.on_welcome(welcome({2}, 0.1));
  EXPECT_EQ(work.readiness(early, 10.2).state, State::kReady);
}

TEST(JuliaTiles, DropsLeasesOfBadParametersAndForgetsAnotherMastersEpochs) {
  JuliaTiles work(1);
  auto bad = welcome({1}, 0);
  bad.parameters["iterations"] = 0;
  work.on_welcome(bad);
  EXPECT_EQ(work.readiness(lease(1, {1}, {0, 0, 48, 8}, 0), 0).state, State::kHopeless);
  auto incomplete = welcome({2}, 0);
  incomplete.parameters.erase("room.scale");
  work.on_welcome(incomplete);
  EXPECT_EQ(work.readiness(lease(1, {2}, {0, 0, 48, 8}, 0), 0).state, State::kHopeless);
  work.on_welcome(welcome({3}, 0));
  work.on_welcome(welcome({1}, 0, {8}));  // a restarted master counts epochs anew
  EXPECT_EQ(work.readiness(lease(1, {1}, {0, 0, 48, 8}, 0), 0).state, State::kReady);
  EXPECT_EQ(work.readiness(lease(1, {3}, {0, 0, 48, 8}, 0), 0).state, State::kWaits);
}

class Masks : public testing::Test {
 protected:
  Masks() : link_(context_, "tcp://127.0.0.1:9", {}), control_(context_, net::Kind::kDealer, "master") {
    work_.on_welcome(welcome({1}, 0));
  }
  void take(const wire::Lease& lease) {
    const auto body = std::make_shared<std::string>(wire::encode(lease));
    work_.take(control_, {"", "lease", std::as_bytes(std::span(*body)), body}, true, 0);
  }
  // Samples the first lease; returns the lease and the image of the tile that results.
  std::pair<wire::Lease, image::DepthImage> deliver() {
    EXPECT_EQ(work_.look_at_next(0).state, State::kReady);
    const Delivery made = work_.sample_next();
    std::pair<wire::Lease, image::DepthImage> out;
    net::dispatch<wire::DepthTile>(control_, {"", std::string(made.type), std::as_bytes(std::span(made.body)), nullptr},
                                   [&](const wire::DepthTile& tile) {
                                     const auto* bytes = reinterpret_cast<const uint8_t*>(tile.image.data());
                                     auto image = codec::decode({bytes, tile.image.size()});
                                     ASSERT_TRUE(image.ok());
                                     out = {tile.lease, *std::move(image)};
                                   });
    return out;
  }
  static wire::Lease plain() {
    wire::Lease out = lease(1, {1}, {4, 4, 40, 24}, 0).lease;
    out.block_rect = out.rect;
    out.blocks_in_frame = 1;
    return out;
  }

  net::Context context_;
  net::MasterLink link_;
  net::Socket control_;
  TileWork work_{std::make_unique<JuliaTiles>(1), link_};
};

TEST_F(Masks, OfALeaseSaysWhatIsSampledAndStaysWithTheSampler) {
  const auto mask = test::spread_mask(40, 24, 8, 1);
  wire::Lease lease = plain();
  take(lease);
  const auto all = deliver().second;
  lease.mask = codec::encode_mask(mask);
  lease.rays = mask.count();
  take(lease);
  const auto [back, image] = deliver();
  EXPECT_TRUE(back.mask.empty());
  EXPECT_EQ(back.rays, mask.count());
  EXPECT_EQ(image, test::masked(all, mask));
  EXPECT_NE(image, image::DepthImage(40, 24));
}

// Dropped, the lease would be sent again and again.
TEST_F(Masks, WhereTheyAreNoneAllPixelsAreSampled) {
  wire::Lease lease = plain();
  take(lease);
  const auto all = deliver().second;
  const auto good = codec::encode_mask(test::spread_mask(40, 24, 8, 1));
  for (const std::vector<uint32_t>& bad : {std::vector<uint32_t>{0xffffffff},
                                           std::vector<uint32_t>(1000, 0x01010101),
                                           {good.begin(), good.end() - 1},
                                           codec::encode_mask(test::spread_mask(200, 300, 8, 1))}) {
    lease.mask = bad;
    lease.rays = 120;
    take(lease);
    ASSERT_EQ(work_.leases(), 1u) << bad.size() << " words";
    const auto [back, image] = deliver();
    EXPECT_EQ(image, all);
    EXPECT_EQ(back.rays, 40u * 24u);
    EXPECT_TRUE(back.mask.empty());
  }
  lease.mask = good;
  take(lease);
  EXPECT_EQ(work_.leases(), 1u);
}

}  // namespace
}  // namespace telesplat::sampler
