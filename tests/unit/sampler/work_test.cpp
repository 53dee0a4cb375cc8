// Samplers' work for their leases: Julia sets by epoch, replays, masks.
#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "common/codec/depth_codec.h"
#include "common/codec/mask_stream.h"
#include "common/geometry/trajectory.h"
#include "common/julia/parameters.h"
#include "common/net/dispatch.h"
#include "services/sampler/julia/tiles.h"
#include "services/sampler/tiles/replay.h"
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

Replay replay() {
  Replay r{{48, 32}, std::vector<double>(32, 0.5)};
  for (size_t i = 0; i < r.frame.pixels(); ++i) r.frame.depth[i] = uint32_t(i + 1), r.frame.colour[i] = uint32_t(i);
  r.row_cost_s[9] = 2;
  return r;
}

TEST(ReplayTiles, ALeaseTakesWhatItsRowsCostAndLateWakingDoesNotAddUp) {
  ReplayTiles work(replay(), 2);
  const auto first = lease(1, {1}, {0, 8, 48, 2}, 100), second = lease(2, {1}, {0, 0, 48, 1}, 101);
  const auto r = work.readiness(first, 100.5);
  EXPECT_EQ(r.state, State::kWaits);
  EXPECT_DOUBLE_EQ(r.again_s, 105);
  EXPECT_EQ(work.readiness(first, 105.3).state, State::kReady);
  const auto sampled = work.sample(first);
  EXPECT_DOUBLE_EQ(sampled.begin_s, 100);
  EXPECT_DOUBLE_EQ(sampled.end_s, 105);
  EXPECT_EQ(sampled.image.width, 48);
  ASSERT_EQ(sampled.image.height, 2);
  EXPECT_EQ(sampled.image.depth.front(), 8 * 48 + 1u);
  EXPECT_EQ(sampled.image.depth.back(), 10 * 48u);
  EXPECT_DOUBLE_EQ(work.readiness(second, 105.3).again_s, 106);  // from 105, not from 105.3
}

TEST(ReplayTiles, DropsLeasesOfOtherFrames) {
  ReplayTiles work(replay(), 1);
  auto other = lease(1, {1}, {0, 0, 12, 8}, 0);
  other.lease.step = 4;
  EXPECT_EQ(work.readiness(other, 0).state, State::kHopeless);
  other.lease.step = 1;
  other.lease.camera.width = 24;
  EXPECT_EQ(work.readiness(other, 0).state, State::kHopeless);
}

TEST(ReplayTiles, AMaskedLeaseCostsItsPartAndHasItsPixelsOnly) {
  ReplayTiles work(replay(), 1);
  auto held = lease(1, {1}, {0, 0, 48, 4}, 100);
  held.mask = test::band_mask(48, 4, 20);
  const size_t count = held.mask->count();
  ASSERT_GT(count, 10u);
  ASSERT_LT(count, 48u * 4);
  EXPECT_NEAR(work.readiness(held, 100).again_s, 100 + 0.5 * 4 * double(count) / (48 * 4), 1e-9);
  ASSERT_EQ(work.readiness(held, 103).state, State::kReady);
  const auto masked = work.sample(held).image;
  held.mask.reset();
  EXPECT_EQ(masked, test::masked(work.sample(held).image, test::band_mask(48, 4, 20)));
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

class ReplayFile : public testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(path_); }
  void write(const std::string& text) { std::ofstream(path_, std::ios::binary) << text; }
  std::string refusal() {
    const auto r = read_replay(path_);
    return r ? "" : r.error().text;
  }
  std::string path_ =
      (std::filesystem::temp_directory_path() / ("telesplat-replay-" + std::to_string(getpid()))).string();
};

TEST_F(ReplayFile, ComesBackAsItWasWritten) {
  const Replay r = replay();
  ASSERT_TRUE(write_replay(path_, r));
  const auto back = read_replay(path_);
  ASSERT_TRUE(back) << back.error().text;
  EXPECT_EQ(back->frame, r.frame);
  EXPECT_EQ(back->row_cost_s, r.row_cost_s);
}

TEST_F(ReplayFile, RefusesWhatIsNone) {
  EXPECT_NE(refusal().find(path_), std::string::npos);
  write("");
  EXPECT_NE(refusal().find("JSON"), std::string::npos);
  write("{\"width\":2,\"height\":1,\"row_cost_s\":[-1]}\n");
  EXPECT_NE(refusal().find("-1"), std::string::npos);
  write("{\"width\":2,\"height\":1,\"row_cost_s\":[1]}\nnothing of the kind");
  EXPECT_NE(refusal().find(path_), std::string::npos);
  ASSERT_TRUE(write_replay(path_, replay()));
  std::ifstream in(path_, std::ios::binary);
  const std::string all(std::istreambuf_iterator<char>(in), {});
  for (size_t n = 0; n < all.size(); n += 7) {
    write(all.substr(0, n));
    EXPECT_NE(refusal(), "") << n << " of " << all.size() << " bytes";
  }
}

}  // namespace
}  // namespace telesplat::sampler
