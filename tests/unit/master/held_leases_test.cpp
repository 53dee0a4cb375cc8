// Some samplers keep leases for ever, or send only tiles that the packer cannot use: frames go on all the same.
#include <gtest/gtest.h>

#include "services/master/slabs/schedule.h"
#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

wire::ViewRequest request(uint64_t viewer, uint64_t id) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.camera.width = 256;
  r.camera.height = 128;
  return r;
}

const auto kNobody = [](const std::string&) {};

std::optional<wire::Lease> next(FrameSchedule& s, const std::string& sampler, double now_s) {
  do {
    if (auto lease = s.lease(sampler, now_s)) return lease;
  } while (s.begin_view({1}));
  return std::nullopt;
}

wire::TileRefused refusal(const wire::Lease& l) {
  return {.frame = l.frame, .tile = l.tile, .lease = l.lease, .sampler = {3}, .why = "no image"};
}

TEST(HeldLeases, OneThatIsExtendedForEverEnds) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2, .longest_fetch_s = 10});
  s.request_view(request(1, 1));
  const auto lease = next(s, "stuck", 0);
  ASSERT_TRUE(lease);
  int expired = 0;
  double ended_s = 0;
  for (double now_s = 0; now_s < 60 && !expired; now_s += 0.1) {
    s.extend(lease->lease, "stuck", now_s);
    expired = s.expire(now_s, kNobody);
    ended_s = now_s;
  }
  EXPECT_EQ(expired, 1);
  EXPECT_GT(ended_s, 9.9) << "it may fetch for so long";
  EXPECT_LT(ended_s, 10.3);
  const auto other = next(s, "other", ended_s);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->tile, lease->tile);
}

TEST(HeldLeases, OthersGetATileThatOnlyEverIsExtended) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2});
  wire::TileDone done;
  s.request_view(request(1, 1));
  const auto first = next(s, "fast", 0);  // gives the schedule a typical time of tiles
  done.frame = first->frame, done.tile = first->tile, done.lease = first->lease;
  ASSERT_TRUE(s.tile_done(done, "fast", 0.01));
  s.request_view(request(1, 2));
  const auto before = next(s, "stuck", 3);  // the fast one delivered long ago
  ASSERT_TRUE(before);
  done.frame = before->frame, done.tile = before->tile, done.lease = before->lease;
  ASSERT_TRUE(s.tile_done(done, "stuck", 3.01)) << "it delivers, so it is trusted to extend";
  s.request_view(request(1, 3));
  const auto stuck = next(s, "stuck", 3.02);
  ASSERT_TRUE(stuck);
  double given_s = 0;
  for (double now_s = 3.1; now_s < 13 && given_s == 0; now_s += 0.1) {
    s.extend(stuck->lease, "stuck", now_s);
    if (const auto backup = s.lease("fast", now_s)) {
      given_s = now_s;
      EXPECT_EQ(backup->tile, stuck->tile);
    }
  }
  EXPECT_GT(given_s, 3 + kHeardFor_s);
  EXPECT_LT(given_s, 3.5 + kHeardFor_s);
}

TEST(HeldLeases, OnlyWhoHoldsOneExtendsIt) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  const auto lease = next(s, "holder", 0);
  ASSERT_TRUE(lease);
  s.extend(lease->lease, "other", 1.9);
  EXPECT_EQ(s.expire(2.1, kNobody), 1);
}

TEST(HeldLeases, ATileThatIsRefusedGoesToAnother) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  const auto bad = next(s, "bad", 0);
  s.refused(refusal(*bad), "bad", 0.1);
  const auto good = s.lease("good", 0.1, false);
  ASSERT_TRUE(good) << "at once: nobody waits until the lease runs out";
  EXPECT_EQ(good->tile, bad->tile);
  wire::TileDone done;
  done.frame = good->frame, done.tile = good->tile, done.lease = good->lease;
  EXPECT_TRUE(s.tile_done(done, "good", 0.2));
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_EQ(s.given_up(), 0u);
}

TEST(HeldLeases, ATileThatIsRefusedEveryTimeEndsItsFrame) {
  FrameSchedule s({.tile_size = 128, .frames_in_flight = 1, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  const auto good = next(s, "a", 0);
  wire::TileDone done;
  done.frame = good->frame, done.tile = good->tile, done.lease = good->lease;
  s.tile_done(done, "a", 0.1);
  int refused = 0;
  while (s.frames_in_flight() > 0 && refused < 100) {
    const auto bad = s.lease("a", 0.2);
    ASSERT_TRUE(bad);
    s.refused(refusal(*bad), "a", 0.2);
    ++refused;
  }
  EXPECT_EQ(refused, kMostRefused + 1);
  EXPECT_EQ(s.given_up(), 1u);
  EXPECT_EQ(s.frames_completed(), 0u);
  EXPECT_EQ(s.overtaken(), 0u);
  EXPECT_FALSE(s.view_waiting()) << "it would be refused again";
  const auto ends = s.take_ends(1);
  ASSERT_EQ(ends.size(), 1u) << "the packer shows what there is";
  EXPECT_EQ(ends[0].frame, good->frame);
  s.request_view(request(1, 2));
  EXPECT_TRUE(next(s, "a", 1)) << "the next view has its place";
}

TEST(HeldLeases, ATileThatEverySamplerDiesOfEndsItsFrame) {
  FrameSchedule s({.tile_size = 256, .frames_in_flight = 1, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  int died = 0;
  for (; died < 100 && next(s, "s" + std::to_string(died), died); ++died) s.release_sampler("s" + std::to_string(died));
  EXPECT_EQ(died, kMostLost + 1);
  EXPECT_EQ(s.given_up(), 1u);
}

TEST(HeldLeases, ARefusalOfAnotherFrameOrATileThatIsDoneChangesNothing) {
  FrameSchedule s({.tile_size = 256, .lease_timeout_s = 2});
  s.request_view(request(1, 1));
  const auto lease = next(s, "a", 0);
  wire::TileRefused other = refusal(*lease);
  other.frame = {99};
  for (int n = 0; n < 10; ++n) s.refused(other, "a", 0.2);
  other = refusal(*lease);
  other.tile = 77;
  for (int n = 0; n < 10; ++n) s.refused(other, "a", 0.2);
  EXPECT_EQ(s.leases_of("a"), 1u);
  EXPECT_EQ(s.frames_in_flight(), 1u);
}

// A farm on a clock of milliseconds: each view has eight tiles, and another view always waits.
struct Farm {
  enum class Kind { kGood, kSlow, kSilent, kExtends, kBegs };
  struct Sampler {
    Kind kind = Kind::kGood;
    std::optional<wire::Lease> lease;
    double until_s = 0;
  };
  static double needs_s(Kind kind) { return kind == Kind::kGood ? 0.01 : kind == Kind::kSlow ? 0.06 : 1e300; }

  explicit Farm(std::vector<Kind> kinds) {
    for (const Kind kind : kinds) samplers.push_back({kind});
  }
  void step() {
    now_s += 0.001;
    if (!schedule.view_waiting()) schedule.request_view(request(1, ++views));
    for (size_t i = 0; i < samplers.size(); ++i) work(samplers[i], "sampler " + std::to_string(i));
    schedule.expire(now_s, kNobody);
    for (const auto& news : schedule.take_news(now_s)) told.push_back(news.sampler);
  }
  void work(Sampler& s, const std::string& name) {
    if (s.lease && now_s >= s.until_s) {
      wire::TileDone done;
      done.frame = s.lease->frame, done.tile = s.lease->tile, done.lease = s.lease->lease;
      schedule.tile_done(done, name, now_s);
      s.lease.reset();
      schedule.heard_of(name);
    }
    if (s.lease && s.kind == Kind::kExtends) schedule.extend(s.lease->lease, name, now_s);
    if (s.lease && s.kind != Kind::kBegs) return;
    if (s.kind == Kind::kBegs) schedule.heard_of(name);
    if (auto lease = next(schedule, name, now_s)) s.lease = std::move(lease), s.until_s = now_s + needs_s(s.kind);
  }
  // Returns frames a second from now on.
  double rate(double for_s) {
    const uint64_t before = schedule.frames_completed();
    for (const double until_s = now_s + for_s; now_s < until_s;) step();
    return double(schedule.frames_completed() - before) / for_s;
  }

  FrameSchedule schedule{{.tile_size = 64, .frames_in_flight = 2, .lease_timeout_s = 2}};
  std::vector<Sampler> samplers;
  std::vector<std::string> told;
  double now_s = 0;
  uint64_t views = 0;
};

std::vector<Farm::Kind> one_good(size_t others, Farm::Kind kind) {
  std::vector<Farm::Kind> out(others + 1, kind);
  out[others / 2] = Farm::Kind::kGood;
  return out;
}

// A copy of the good sampler's tile costs it nothing: it goes on as if it were alone.
TEST(HeldLeases, SamplersThatDeliverNothingTakeLittleOfTheRate) {
  using enum Farm::Kind;
  const double alone = Farm({kGood}).rate(10);
  EXPECT_NEAR(alone, 100.0 / 8, 2);
  for (const Farm::Kind kind : {kSilent, kExtends, kBegs})
    for (const size_t others : {1, 8}) {
      Farm farm(one_good(others, kind));
      EXPECT_GT(farm.rate(10), 0.8 * alone) << others << " of the kind " << int(kind);
      EXPECT_EQ(farm.told.size(), others) << "each once";
    }
}

TEST(HeldLeases, WhoBeginsToDeliverHasItsShareAgain) {
  using enum Farm::Kind;
  Farm farm({kGood, kSilent});
  const double alone = farm.rate(5);
  EXPECT_TRUE(farm.schedule.stuck_s("sampler 1", farm.now_s));
  farm.samplers[1].kind = kGood;
  farm.samplers[1].lease.reset();
  farm.rate(3);  // its last lease is still out
  EXPECT_FALSE(farm.schedule.stuck_s("sampler 1", farm.now_s));
  EXPECT_GT(farm.rate(5), 1.6 * alone);
  EXPECT_EQ(farm.told, (std::vector<std::string>{"sampler 1", "sampler 1"}));
}

// A slow sampler's tile comes after the backup's: it does not count as delivering nothing.
TEST(HeldLeases, SlowSamplersAreNotCalledStuck) {
  using enum Farm::Kind;
  const double alone = Farm({kGood}).rate(10);
  Farm farm({kGood, kSlow});
  EXPECT_GT(farm.rate(10), 0.9 * alone);
  EXPECT_TRUE(farm.told.empty());
}

TEST(HeldLeases, SamplersGoOnWhereTheTrustedOneIsDead) {
  using enum Farm::Kind;
  Farm farm({kGood, kSilent});
  farm.rate(3);
  farm.samplers[0].kind = kSilent;  // it holds a lease, or takes one more
  farm.samplers[1].kind = kGood;
  farm.samplers[1].lease.reset();
  farm.rate(3);
  EXPECT_NEAR(farm.rate(5), 100.0 / 8, 2);
}

class HeldSlabs : public testing::Test {
 protected:
  HeldSlabs() {
    volume::Grid grid;
    grid.size = {16, 16, 24};
    grid.index_to_room[0][0] = grid.index_to_room[1][1] = grid.index_to_room[2][2] = 0.05;
    s.set_grid(grid);
    partition->number = 1;
    partition->slabs = {{.sampler = "a", .range = {0, 10}}, {.sampler = "b", .range = {10, 24}}};
    wire::ViewRequest r = request(1, 1);
    r.camera = geometry::make_camera({.position_room = {0.4, 0.4, 3}}, 60, 64, 48);
    s.request_view(r);
    EXPECT_TRUE(s.begin_frame({1}, partition));
  }
  VolumeSchedule s{{.lease_timeout_s = 2, .longest_fetch_s = 10}};
  std::shared_ptr<Partition> partition = std::make_shared<Partition>();
};

TEST_F(HeldSlabs, OneThatIsExtendedForEverEnds) {
  const auto a = s.lease("a", 0);
  ASSERT_TRUE(a);
  double now_s = 0;
  for (; now_s < 60 && s.expire(now_s, kNobody) == 0; now_s += 0.1) s.extend(a->lease, "a", now_s);
  EXPECT_GT(now_s, 9.9);
  EXPECT_LT(now_s, 10.3);
}

TEST_F(HeldSlabs, OnlyWhoHoldsOneExtendsIt) {
  const auto a = s.lease("a", 0);
  s.extend(a->lease, "b", 1.9);
  EXPECT_EQ(s.expire(2.1, kNobody), 1);
}

TEST_F(HeldSlabs, OneThatIsRefusedEndsItsFrame) {
  const auto a = s.lease("a", 0);
  ASSERT_TRUE(a);
  const wire::TileRefused m{.frame = a->frame, .tile = a->slab, .lease = a->lease, .sampler = {3}, .why = "no slices"};
  s.refused(m, "b");
  EXPECT_EQ(s.frames_in_flight(), 1u) << "it is not b's";
  s.refused(m, "a");
  EXPECT_EQ(s.frames_in_flight(), 0u);
  EXPECT_FALSE(s.view_waiting()) << "it would be refused again";
  EXPECT_EQ(s.given_up(), 1u);
  EXPECT_EQ(s.frames_completed(), 0u);
}

}  // namespace
}  // namespace telesplat::master
