// The packer's part for points, without a network: tiles and state requests in, events and reports out.
#include "services/packer/points/point_packing.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <set>

#include "services/packer/slices/slice_packing.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/packer_scenes.h"

namespace telesplat::packer {
namespace {

const geometry::Camera kCamera = test::scene_camera({0.7, 0.4, 0}, 96, 64);

wire::Welcome welcome(EpochId epoch = test::kEpoch, InstanceId master = {1}) {
  const points::ModelConfig model = test::scene_config();
  wire::Welcome w;
  w.master = master;
  w.lease_key = test::lease_key();
  w.epoch = epoch;
  w.octree_depth = uint64_t(model.depth);
  w.box_room = model.box_room;
  w.facts["kind"] = "mesh";
  w.settings.keep_redundant = 0;
  return w;
}

class PointPackingTest : public testing::Test {
 protected:
  explicit PointPackingTest(const PointPacking::Options& options = {}) : packing(options, outlets(), spans) {}
  struct Sent {
    std::string peer;  // empty: to all
    std::string type, body;
  };
  template <class M>
  static M decoded(const Sent& sent) {
    EXPECT_EQ(sent.type, M::kName);
    auto m = wire::decode<M>(std::as_bytes(std::span(sent.body)));
    EXPECT_TRUE(m.ok());
    return m.ok() ? *m : M{};
  }
  // The frame in one block that comes as two tiles of 32 rows.
  wire::DepthTile tile(uint64_t frame, int half, EpochId epoch = test::kEpoch) {
    wire::DepthTile m{.sampler = {9}};
    wire::Lease& l = m.lease;
    l.lease = {frame * 10 + uint64_t(half)}, l.frame = {frame}, l.epoch = epoch, l.viewer = {77}, l.request = {5};
    l.tile = uint64_t(half), l.block = 0, l.blocks_in_frame = 1;
    l.camera = kCamera, l.rect = {0, 32 * half, 96, 32}, l.block_rect = {0, 0, 96, 64};
    l.moments.leased_s = 2;
    return m;
  }
  void sample(wire::DepthTile m, double now_s, InstanceId master = {1}) {
    test::seal_lease(m.lease, m.sampler, master);
    deliver(m, now_s);
  }
  void deliver(wire::DepthTile m, double now_s) {
    const auto stream = codec::encode(test::sample_scene(m.lease.camera, m.lease.rect));
    m.image = std::as_bytes(std::span(stream));
    packing.take_sampled(socket, message(m), now_s);
  }
  template <class M>
  net::Message message(const M& m, const std::string& peer = {}) {
    const auto body = std::make_shared<std::string>(wire::encode(m));
    return {peer, std::string(M::kName), std::as_bytes(std::span(*body)), body};
  }
  void ask(Sequence after, InstanceId packer, double now_s, const std::string& peer = "peer", uint64_t viewer = 77,
           bool anew = false) {
    packing.take_state(socket, message(wire::StateRequest{{viewer}, packer, after, anew}, peer), now_s);
  }
  void receipt(Sequence newest, InstanceId packer, double now_s, const std::string& peer = "peer") {
    packing.take_state(socket, message(wire::Receipt{{77}, packer, newest, now_s}, peer), now_s);
  }
  double status(const std::string& key) {
    net::MasterLink::Values values;
    packing.add_status(values);
    return values.contains(key) ? values.at(key) : -1;
  }
  Outlets outlets() {
    return {.tell = [this](const wire::TileDone& m) { told.push_back(m); },
            .refuse = [this](const wire::TileRefused& m) { refused.push_back(m); },
            .to_viewers =
                [this](std::string_view type, std::string body) {
                  sent.push_back({"", std::string(type), std::move(body)});
                },
            .to_viewer =
                [this](std::string_view peer, std::string_view type, std::string body) {
                  if (--takes < 0) return false;
                  sent.push_back({std::string(peer), std::string(type), std::move(body)});
                  return true;
                },
            .waiting =
                [this](const std::string& peer) {
                  uint64_t bytes = 0;
                  for (const Sent& s : sent) bytes += s.peer == peer ? s.body.size() : 0;
                  return bytes;
                },
            .master_now = [] { return 99.0; },
            .to_master_s = [](double s) { return s + 50; }};
  }

  net::Context context;
  net::Socket socket{context, net::Kind::kDealer, "from"};
  std::vector<wire::TileDone> told;
  std::vector<wire::TileRefused> refused;
  std::deque<Sent> sent;
  metrics::SpanRecorder spans;
  int takes = 1 << 30;  // messages that a viewer's connection takes
  PointPacking packing;
};

TEST_F(PointPackingTest, ErrorsAreToldAndWhatStandsStillBecomesExact) {
  wire::Welcome session = welcome();
  session.settings.errors.depth = 1.0 / 32;
  session.settings.errors.normal = 1;
  session.settings.errors.colour = 2;
  ASSERT_TRUE(packing.follow(session, 0));
  sample(tile(1, 0), 10);
  sample(tile(1, 1), 10);
  ASSERT_EQ(told.size(), 2u);
  const wire::TileDone& done = told.back();
  // A 32nd of a pixel of 96 in 60 degrees, at no more than 2 m.
  EXPECT_GT(done.depth_error_m, 0.2 * 1.1547 / 96 / 32);
  EXPECT_LE(done.depth_error_m, 2.0 * 1.1547 / 96 / 32);
  EXPECT_EQ(done.normal_error_deg, codec::normal_error_degrees(1));
  EXPECT_EQ(done.colour_error, 2);
  const auto patch = decoded<wire::Patch>(sent.back());
  EXPECT_TRUE(patch.refinable);
  sent.clear();
  packing.tick(10.29);
  const auto refinements = [&] {
    return std::count_if(sent.begin(), sent.end(), [](const Sent& s) { return s.type == wire::Refine::kName; });
  };
  EXPECT_EQ(refinements(), 0) << "the head has not stood still for long";
  packing.tick(10.31);
  ASSERT_EQ(refinements(), 1);
  EXPECT_EQ(status("patches_bounded"), 1);
  EXPECT_EQ(status("patches_refined"), 1);
  EXPECT_GT(status("bytes_refined"), 0);
  packing.tick(20);
  EXPECT_EQ(refinements(), 1) << "once";
}

TEST_F(PointPackingTest, WithoutAWordErrorsAreForSlowLinks) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  sample(tile(1, 0), 10);
  sample(tile(1, 1), 10);
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told.back().depth_error_m, 0);
  EXPECT_FALSE(decoded<wire::Patch>(sent.back()).refinable);
}

TEST(AllowedErrors, IsOfThePixelAndRoundedDown) {
  EXPECT_TRUE(bounds_of({}, kCamera).exact());
  std::set<uint32_t> depths;
  for (int width = 640; width < 1280; ++width) {
    const auto camera = test::scene_camera({0.7, 0.4, 0}, width, width * 5 / 8);
    const double wanted = 4294967296.0 / 32 / std::max(camera.focal_x(), camera.focal_y());
    const auto bounds = bounds_of({1.0 / 32, 1, 2}, camera);
    EXPECT_LE(bounds.depth, wanted);
    EXPECT_GT(bounds.depth, wanted * 15 / 16);
    EXPECT_EQ(bounds.normal, 1);
    EXPECT_EQ(bounds.colour, 2);
    depths.insert(bounds.depth);
  }
  EXPECT_LE(depths.size(), 17u);
}

TEST(StillHeads, AreThoseThatDoNotMove) {
  StillHeads heads;
  EXPECT_TRUE(heads.still(0)) << "nobody looks";
  geometry::Pose pose;
  heads.seen({1}, pose, 0);
  EXPECT_FALSE(heads.still(0.2));
  EXPECT_TRUE(heads.still(0.31));
  pose.position_room.x += 1e-3;
  heads.seen({1}, pose, 0.4);
  EXPECT_TRUE(heads.still(0.4)) << "trackers tremble";
  pose.position_room.x += 2e-3;
  heads.seen({1}, pose, 0.5);
  EXPECT_FALSE(heads.still(0.5)) << "slow is not still";
  EXPECT_TRUE(heads.still(0.81));
  pose.orientation = glm::angleAxis(0.01, glm::dvec3(0, 1, 0));
  heads.seen({1}, pose, 0.9);
  EXPECT_FALSE(heads.still(1.1));
  heads.seen({2}, {}, 1.15);
  EXPECT_FALSE(heads.still(1.3)) << "another one has just come";
  EXPECT_TRUE(heads.still(1.46));
}

TEST_F(PointPackingTest, AViewThatNeedsNoRaysIsCompleteWithItsPlan) {
  wire::Welcome session = welcome();
  session.settings.validation = 0;
  ASSERT_TRUE(packing.follow(session, 0));
  const wire::PlanRequest request{
      .frame = {1}, .epoch = test::kEpoch, .viewer = {77}, .request = {5}, .camera = kCamera};
  const wire::Plan first = packing.plan(request, 1);
  EXPECT_TRUE(first.full) << "nothing is known";
  EXPECT_EQ(first.frame.value, 1u);
  sample(tile(1, 0), 3);
  sample(tile(1, 1), 3);
  while (packing.idle(1e9)) {
  }
  sent.clear();
  wire::PlanRequest again = request;
  again.frame = {2}, again.request = {6};
  const wire::Plan second = packing.plan(again, 4);
  EXPECT_FALSE(second.full);
  EXPECT_TRUE(second.tiles.empty());
  ASSERT_EQ(sent.size(), 1u);
  const auto patch = decoded<wire::Patch>(sent[0]);
  EXPECT_TRUE(patch.frame_complete);
  EXPECT_EQ(patch.frame.value, 2u);
  EXPECT_EQ(patch.request.value, 6u);
  EXPECT_EQ(patch.counts.kept, 0u);
  again.epoch = {test::kEpoch.value + 1};
  EXPECT_TRUE(packing.plan(again, 4).full) << "of an epoch that is not the model's";
  EXPECT_EQ(status("plans"), 2);
}

TEST_F(PointPackingTest, ATileKeepsItsLabelFromLeaseToPatch) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  sample(tile(1, 0), 3);
  EXPECT_TRUE(sent.empty()) << "half a block";
  sample(tile(1, 1), 4);
  ASSERT_EQ(sent.size(), 1u);
  const auto patch = decoded<wire::Patch>(sent[0]);
  EXPECT_EQ(sent[0].peer, "");
  EXPECT_EQ(patch.sequence.value, 1u);
  EXPECT_EQ(patch.epoch, test::kEpoch);
  EXPECT_EQ(patch.frame.value, 1u);
  EXPECT_EQ(patch.viewer.value, 77u);
  EXPECT_EQ(patch.request.value, 5u);
  EXPECT_EQ(patch.tile, 0u);
  EXPECT_EQ(patch.tiles_in_frame, 1u);
  EXPECT_EQ(patch.step, 1u);
  EXPECT_TRUE(patch.frame_complete);
  EXPECT_TRUE(patch.camera == kCamera);
  EXPECT_TRUE(geometry::contains({0, 0, 96, 64}, patch.rect)) << "what holds samples of it";
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].tile, 0u);
  EXPECT_EQ(told[0].lease.value, 10u);
  EXPECT_EQ(told[0].sampler.value, 9u);
  EXPECT_EQ(told[0].rect, (geometry::Rect{0, 0, 96, 32}));
  EXPECT_EQ(told[0].moments.leased_s, 2);
  EXPECT_EQ(told[0].moments.receive_s, 53);
  EXPECT_EQ(told[0].moments.packed_s, 99);
  EXPECT_EQ(told[0].moments.published_s, 0) << "published with the tile that completed the block";
  EXPECT_EQ(told[1].moments.published_s, 99);
  EXPECT_EQ(told[0].bytes_sent, 0u);
  EXPECT_EQ(told[0].samples + told[1].samples, patch.counts.samples);
  EXPECT_EQ(told[1].kept, patch.counts.kept) << "counted to the tile that completed the block";
  EXPECT_EQ(told[1].bytes_sent, patch.image.size());
  sample(tile(1, 1), 5);
  EXPECT_EQ(told.size(), 3u) << "a duplicate is done, too";
  EXPECT_EQ(status("tiles_duplicate"), 1);
}

// Stages of an update use the moments of the part that completes it: other parts have none.
TEST_F(PointPackingTest, MomentsAreOfThePatchThatCompletesAnUpdate) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  for (const int half : {0, 1}) {
    wire::DepthTile m = tile(1, half);
    m.lease.block = uint64_t(half), m.lease.blocks_in_frame = 2, m.lease.block_rect = m.lease.rect;
    sample(m, 3);
  }
  ASSERT_EQ(sent.size(), 2u);
  const auto first = decoded<wire::Patch>(sent[0]), second = decoded<wire::Patch>(sent[1]);
  EXPECT_FALSE(first.frame_complete);
  EXPECT_EQ(first.moments, wire::Moments{});
  EXPECT_TRUE(second.frame_complete);
  EXPECT_EQ(second.moments.leased_s, 2);
  EXPECT_EQ(second.moments.published_s, 99);
  EXPECT_EQ(told[0].moments.published_s, 99) << "the master is told of all";
}

TEST_F(PointPackingTest, TilesAheadOfTheirEpochWaitForIt) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  const EpochId next = test::kEpoch.next();
  for (const int half : {0, 1}) sample(tile(1, half, next), 1);
  EXPECT_TRUE(told.empty());
  packing.tick(1.5);
  ASSERT_TRUE(packing.follow(welcome(next), 1.6));
  ASSERT_EQ(told.size(), 2u);
  EXPECT_EQ(told[0].moments.receive_s, 51) << "when it came";
  sample(tile(2, 0), 2);
  EXPECT_EQ(told.size(), 2u) << "the epoch is over";
  sample(tile(2, 0, next.next()), 3);
  packing.tick(4.5);
  ASSERT_TRUE(packing.follow(welcome(next.next()), 4.6));
  EXPECT_EQ(told.size(), 2u) << "it waited too long";
  EXPECT_EQ(status("tiles_other_epoch"), 2);
}

TEST_F(PointPackingTest, LateViewersAreBroughtUpToDate) {
  ask({}, {}, 0);
  EXPECT_TRUE(sent.empty()) << "nothing is known yet";
  ASSERT_TRUE(packing.follow(welcome(), 0));
  for (const int half : {0, 1}) sample(tile(1, half), 1);
  const InstanceId packer = decoded<wire::Patch>(sent[0]).packer;
  sent.clear();
  ask({}, {}, 2);
  ASSERT_EQ(sent.size(), 3u);
  for (const Sent& s : sent) EXPECT_EQ(s.peer, "peer");
  EXPECT_EQ(decoded<wire::StateBegin>(sent[0]).packer, packer);
  EXPECT_EQ(decoded<wire::StateBegin>(sent[0]).after.value, 0u);
  EXPECT_EQ(decoded<wire::Patch>(sent[1]).sequence.value, 1u);
  const auto mark = decoded<wire::StateMark>(sent[2]);
  EXPECT_TRUE(mark.answer);
  EXPECT_EQ(mark.packer, packer);
  EXPECT_GT(mark.points, 0u);
  sent.clear();
  ask({1}, packer, 2);
  ASSERT_EQ(sent.size(), 2u) << "it has everything";
  EXPECT_EQ(decoded<wire::StateBegin>(sent[0]).after.value, 1u);
  EXPECT_TRUE(decoded<wire::StateMark>(sent[1]).answer);
  sent.clear();
  packing.tick(3);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_FALSE(decoded<wire::StateMark>(sent[0]).answer);
  packing.tick(3 + ModelFeed::kMarkPeriod_s / 2);
  EXPECT_EQ(sent.size(), 1u);
  packing.tick(3 + ModelFeed::kMarkPeriod_s);
  EXPECT_EQ(sent.size(), 2u);
}

// Each beginning goes through all events: a viewer that begins again and again must not slow others down.
TEST_F(PointPackingTest, AnswersThatBeginAnewAreFewASecond) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  for (const int half : {0, 1}) sample(tile(1, half), 1);
  const InstanceId packer = decoded<wire::Patch>(sent[0]).packer;
  const auto begun = [&](const std::string& peer) {
    return size_t(std::count_if(sent.begin(), sent.end(),
                                [&](const Sent& s) { return s.peer == peer && s.type == wire::StateBegin::kName; }));
  };
  sent.clear();
  constexpr size_t kMost = size_t(2 * ModelFeed::kBeginnings_s);
  for (int i = 0; i < 300; ++i) {
    ask({}, {}, 2, "anew", 78, true);
    ask({uint64_t(i % 2)}, packer, 2, "to and fro", 79);
    ask({1}, packer, 2, "many", uint64_t(100 + i));
    ask({1000}, packer, 2, "ahead", 80);
  }
  for (const char* peer : {"anew", "to and fro", "many"}) EXPECT_EQ(begun(peer), kMost) << peer;
  EXPECT_EQ(size_t(std::count_if(sent.begin(), sent.end(), [](const Sent& s) { return s.peer == "ahead"; })), kMost);
  EXPECT_EQ(status("messages_refused"), double(4 * (300 - kMost)));
  sent.clear();
  ask({}, {}, 2, "friend");
  EXPECT_EQ(sent.size(), 3u) << "begin, patch, mark";
  ask({}, {}, 3, "anew", 78, true);
  EXPECT_EQ(begun("anew"), 1u);
}

TEST_F(PointPackingTest, MarksTellTheDigestNowAndThen) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  for (const int half : {0, 1}) sample(tile(1, half), 1);
  sent.clear();
  size_t told_digests = 0;
  uint64_t digest = 0;
  for (double now_s = 10; now_s < 20; now_s += ModelFeed::kMarkPeriod_s) {
    packing.tick(now_s);
    const auto mark = decoded<wire::StateMark>(sent.back());
    EXPECT_EQ(mark.sequence.value, 1u);
    if (mark.digest == 0) continue;
    if (++told_digests > 1) {
      EXPECT_EQ(mark.digest, digest) << "nothing has changed";
    }
    digest = mark.digest;
  }
  EXPECT_EQ(told_digests, size_t(10 / ModelFeed::kDigestPeriod_s));
  for (const int half : {0, 1}) {
    wire::DepthTile from_elsewhere = tile(2, half);
    from_elsewhere.lease.camera = test::scene_camera({0, 0.4, 0.7}, 96, 64);
    sample(from_elsewhere, 21);
  }
  packing.tick(30);
  EXPECT_NE(decoded<wire::StateMark>(sent.back()).digest, digest);
  EXPECT_EQ(status("digests_told"), double(told_digests + 1));
  ask({}, {}, 31);
  EXPECT_EQ(decoded<wire::StateMark>(sent.back()).digest, 0u) << "an answer has no time for it";
}

// Otherwise the viewer would wait until it requests the view again.
TEST_F(PointPackingTest, AViewerThatMissedThatItsViewIsCompleteIsToldSo) {
  wire::Welcome session = welcome();
  session.settings.validation = 0;
  ASSERT_TRUE(packing.follow(session, 0));
  wire::PlanRequest request{.frame = {1}, .epoch = test::kEpoch, .viewer = {77}, .request = {5}, .camera = kCamera};
  ASSERT_TRUE(packing.plan(request, 1).full) << "nothing is known";
  for (const int half : {0, 1}) sample(tile(1, half), 1);
  const InstanceId packer = decoded<wire::Patch>(sent[0]).packer;
  while (packing.idle(1e9)) {
  }
  for (uint64_t id = 6; id <= 8; ++id) {
    request.frame = {id}, request.request = {id};
    ASSERT_TRUE(packing.plan(request, 4).tiles.empty()) << "the model has all of it";
  }

  const auto told_after = [&](Sequence after) {
    sent.clear();
    ask(after, packer, 5);
    std::vector<uint64_t> requests;
    Sequence newest = after;
    for (size_t i = 1; i + 1 < sent.size(); ++i) {
      const auto patch = decoded<wire::Patch>(sent[i]);
      EXPECT_GT(patch.sequence, newest) << "in order";
      newest = patch.sequence;
      EXPECT_EQ(patch.viewer.value, 77u);
      EXPECT_TRUE(patch.frame_complete);
      EXPECT_EQ(patch.counts.kept > 0, patch.request.value == 5) << "the points come once";
      requests.push_back(patch.request.value);
    }
    EXPECT_TRUE(decoded<wire::StateMark>(sent.back()).answer);
    receipt({8}, packer, 5);  // otherwise a repeated request counts as under way
    return requests;
  };
  EXPECT_EQ(told_after({}), (std::vector<uint64_t>{5, 6, 7, 8}));
  EXPECT_EQ(told_after({2}), (std::vector<uint64_t>{7, 8}));
  EXPECT_EQ(told_after({4}), std::vector<uint64_t>{});
  // No view of another epoch is complete.
  session.epoch = test::kEpoch.next();
  ASSERT_TRUE(packing.follow(session, 6));
  sent.clear();
  ask({}, packer, 7);
  ASSERT_EQ(sent.size(), 3u);
  EXPECT_EQ(sent[1].type, wire::EpochBegin::kName);
}

TEST_F(PointPackingTest, WhatCameOfAViewThatEndsEarlyIsKnown) {
  wire::Welcome session = welcome();
  session.settings.validation = 0;
  ASSERT_TRUE(packing.follow(session, 0));
  wire::PlanRequest request{.frame = {1}, .epoch = test::kEpoch, .viewer = {77}, .request = {5}, .camera = kCamera};
  ASSERT_TRUE(packing.plan(request, 1).full) << "nothing is known";
  wire::DepthTile most = tile(1, 0);
  most.lease.rect = most.lease.block_rect = {0, 0, 72, 64};
  most.lease.blocks_in_frame = 2;
  sample(most, 1);
  const wire::FrameEnd end{
      .frame = {1}, .epoch = test::kEpoch, .viewer = {77}, .request = {5}, .tiles = 2, .camera = kCamera};
  sent.clear();
  packing.end_frame(end, 2);
  ASSERT_EQ(sent.size(), 1u);
  const auto patch = decoded<wire::Patch>(sent[0]);
  EXPECT_TRUE(patch.frame_complete);
  EXPECT_EQ(patch.left_out, 1u);
  EXPECT_EQ(patch.request.value, 5u);
  packing.end_frame(end, 2);
  EXPECT_EQ(sent.size(), 1u) << "once";
  EXPECT_TRUE(packing.idle(1e9)) << "there is something to learn";
  while (packing.idle(1e9)) {
  }
  request.frame = {2}, request.request = {6};
  const wire::Plan rest = packing.plan(request, 4);
  ASSERT_FALSE(rest.full);
  uint64_t rays = 0;
  for (size_t i = 0; i < rest.tiles.size(); i += wire::kPlanNumbers) rays += rest.tiles[i + 4];
  EXPECT_GT(rays, 20u * 64);
  EXPECT_LT(rays, 28u * 64) << "the quarter that was left out, and its rim";
}

TEST_F(PointPackingTest, TilesOfAMasterThatIsGoneAreDropped) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  ASSERT_TRUE(packing.follow(welcome(test::kEpoch, {2}), 1));
  // The earlier master's frame 1 had another camera, and this is one of its two tiles.
  wire::DepthTile late = tile(1, 0);
  late.lease.camera = test::scene_camera({0.1, 0.1, 0}, 96, 64);
  sample(late, 1, {1});
  EXPECT_TRUE(told.empty());
  for (const int half : {0, 1}) sample(tile(1, half), 1.1, {2});
  ASSERT_EQ(told.size(), 2u);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_TRUE(decoded<wire::Patch>(sent[0]).frame_complete);
  packing.tick(3);
  EXPECT_EQ(told.size(), 2u);
  EXPECT_TRUE(refused.empty()) << "this master did not lease it";
  EXPECT_EQ(status("tiles_other_epoch"), 1);
}

TEST_F(PointPackingTest, TilesOfAMasterThatIsNotKnownYetWaitForIt) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  for (const int half : {0, 1}) sample(tile(1, half), 1, {2});
  EXPECT_TRUE(told.empty());
  ASSERT_TRUE(packing.follow(welcome(test::kEpoch, {2}), 1.2));
  EXPECT_EQ(told.size(), 2u);
}

// Their seals cannot be checked until their master is known.
TEST_F(PointPackingTest, OneKeysEarlyTilesDoNotPushOutAnothers) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  const auto deliver_by = [&](const std::string& user, wire::DepthTile m, std::span<const uint8_t> stream) {
    m.image = std::as_bytes(stream);
    net::Message sampled = message(m);
    sampled.user = user;
    packing.take_sampled(socket, sampled, 1);
  };
  for (const int half : {0, 1}) {
    wire::DepthTile m = tile(1, half);
    test::seal_lease(m.lease, m.sampler, {2});
    deliver_by("anna", m, codec::encode(test::sample_scene(m.lease.camera, m.lease.rect)));
  }
  wire::DepthTile made_up = tile(2, 0);
  made_up.lease.master = {2};
  for (int n = 0; n < 1000; ++n) deliver_by("eve", made_up, {});
  ASSERT_TRUE(packing.follow(welcome(test::kEpoch, {2}), 1.2));
  EXPECT_EQ(told.size(), 2u);
  EXPECT_GT(status("tiles_unsealed"), 0);
}

TEST_F(PointPackingTest, OnlyWhatWasLeasedIsTaken) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  wire::DepthTile made_up = tile(1, 0);
  made_up.lease.master = {1};
  deliver(made_up, 1);
  EXPECT_EQ(socket.rejected(), 1u) << "without a seal";
  wire::seal(made_up.lease, {8}, test::lease_key());
  deliver(made_up, 1);
  EXPECT_EQ(socket.rejected(), 2u) << "of a lease that another sampler was given";
  wire::seal(made_up.lease, made_up.sampler, test::lease_key());
  made_up.lease.blocks_in_frame = 2;
  deliver(made_up, 1);
  EXPECT_EQ(socket.rejected(), 3u) << "of another frame than was leased";
  EXPECT_TRUE(told.empty());
  EXPECT_TRUE(refused.empty()) << "the master has nothing to do with them";
  EXPECT_EQ(status("tiles_unsealed"), 3);
  for (const int half : {0, 1}) sample(tile(1, half), 2);
  EXPECT_EQ(told.size(), 2u);
}

TEST_F(PointPackingTest, ARefusedTileIsToldTheMaster) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  wire::DepthTile bad = tile(1, 1);
  test::seal_lease(bad.lease, bad.sampler);
  const std::string rubbish = "this is no depth image";
  bad.image = std::as_bytes(std::span(rubbish));
  packing.take_sampled(socket, message(bad), 1);
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].frame.value, 1u);
  EXPECT_EQ(refused[0].tile, 1u);
  EXPECT_EQ(refused[0].lease, bad.lease.lease);
  EXPECT_EQ(refused[0].sampler.value, 9u);
  EXPECT_FALSE(refused[0].why.empty());
  EXPECT_TRUE(told.empty());
  EXPECT_EQ(status("tiles_refused"), 1);
}

// Answers of some events at a time, to viewers that join.
class StateAnswersTest : public PointPackingTest {
 protected:
  static constexpr uint64_t kWindow = 56000, kAll = 16 * kWindow;
  StateAnswersTest()
      : PointPackingTest({.answers = {.window_bytes = kWindow, .bytes_in_all = kAll, .bytes_at_once = kWindow / 2}}) {
    wire::Welcome session = welcome();
    session.settings.keep_redundant = 1;
    EXPECT_TRUE(packing.follow(session, 0));
    for (uint64_t frame = 1; frame <= kFrames; ++frame) publish(frame);
    packer = decoded<wire::Patch>(sent.front()).packer;
    for (const Sent& s : sent) total_bytes += s.body.size();
    EXPECT_GT(total_bytes, 4 * kWindow);
    sent.clear();
  }
  void publish(uint64_t frame) {
    for (const int half : {0, 1}) {
      auto m = tile(frame, half);
      m.lease.camera = test::scene_camera({0.7 + 0.05 * double(frame), 0.4, 0}, 96, 64);
      sample(m, 1);
    }
  }
  // Sequences of patches sent to this viewer since the last call; 0: the mark at the end.
  std::vector<uint64_t> to(const std::string& peer) {
    std::vector<uint64_t> out;
    bytes = 0;
    for (const Sent& s : sent) {
      if (s.peer != peer) continue;
      bytes += s.body.size();
      if (s.type == wire::StateBegin::kName) {
        EXPECT_EQ(decoded<wire::StateBegin>(s).packer, packer);
        begins.push_back(decoded<wire::StateBegin>(s).after.value);
      } else if (s.type == wire::StateMark::kName) {
        const auto mark = decoded<wire::StateMark>(s);
        EXPECT_TRUE(mark.answer);
        EXPECT_EQ(mark.sequence.value, kFrames);
        out.push_back(0);
      } else {
        out.push_back(decoded<wire::Patch>(s).sequence.value);
      }
    }
    std::erase_if(sent, [&](const Sent& s) { return s.peer == peer; });
    return out;
  }

  static constexpr uint64_t kFrames = 60;
  InstanceId packer;
  uint64_t total_bytes = 0, bytes = 0;
  std::vector<uint64_t> begins;  // answers' `after`, in order
};

TEST_F(StateAnswersTest, AnAnswerGoesOutAsFastAsItIsReceived) {
  ask({}, {}, 2);
  double now_s = 2;
  std::vector<uint64_t> got = to("peer");
  EXPECT_LE(bytes, kWindow) << "one turn";
  for (int n = 0; n < 100; ++n) packing.tick(now_s += 0.02);
  for (const uint64_t more : to("peer")) got.push_back(more);
  EXPECT_LT(got.size(), kFrames / 2) << "nothing of it was received";
  EXPECT_GE(got.size(), 2u);
  EXPECT_NE(got.back(), 0u) << "no mark";
  EXPECT_GT(status("answer_bytes"), 0);
  // Packing goes on meanwhile.
  publish(kFrames + 1);
  EXPECT_EQ(sent.back().peer, "");
  for (int n = 0; n < 1000 && got.back() != 0; ++n) {
    receipt({got.back()}, packer, now_s);
    packing.tick(now_s += 0.02);
    for (const uint64_t more : to("peer")) got.push_back(more);
    EXPECT_LE(bytes, kWindow);
  }
  ASSERT_EQ(got.size(), kFrames + 1) << "what is published meanwhile is not part of it";
  for (uint64_t i = 0; i < kFrames; ++i) EXPECT_EQ(got[i], i + 1);
  EXPECT_EQ(got.back(), 0u);
  receipt({kFrames}, packer, now_s);
  EXPECT_EQ(status("answers"), 0);
}

TEST_F(StateAnswersTest, RequestsOfOneViewerAreOneAnswer) {
  for (int n = 0; n < 30; ++n) ask({}, n % 2 ? packer : InstanceId{}, 2);
  for (int n = 0; n < 100; ++n) packing.tick(2 + 0.02 * n);
  const auto first = to("peer");
  EXPECT_LE(bytes, 2 * kWindow);
  receipt({first.back()}, packer, 5);
  ask({first.back()}, packer, 5);
  packing.tick(5.1);
  EXPECT_EQ(to("peer").front(), first.back() + 1) << "it goes on where it was";
  // Over a new connection nothing is under way; the rest of the old answer is not sent.
  ask({}, {}, 6, "again");
  EXPECT_EQ(to("again").front(), 1u);
  packing.tick(6.1);
  EXPECT_TRUE(to("peer").empty());
  // The viewer lost its points.
  receipt({3}, packer, 7, "again");
  to("again");
  ask({}, packer, 7, "again");
  EXPECT_EQ(to("again").front(), 1u);
}

// It had received the answer, but sent no receipt yet.
TEST_F(StateAnswersTest, WhoThrewItAwayGetsItAgainOverTheSameConnection) {
  ask({}, {}, 2);
  EXPECT_EQ(to("peer").front(), 1u);
  ask({}, {}, 2.1, "peer", 77, true);
  EXPECT_EQ(to("peer").front(), 1u);
  ask({9}, packer, 2.2, "peer", 77, true);
  EXPECT_EQ(to("peer").front(), 10u);
  EXPECT_EQ(begins, (std::vector<uint64_t>{0, 0, 9}));
}

// A request claims a position that no replica can have: the answer starts from the empty model.
TEST_F(StateAnswersTest, WhoStandsWhereNobodyCanStandStartsFromNothing) {
  ask({kFrames + 1}, packer, 2);
  ASSERT_EQ(sent.size(), 1u);
  const auto mark = decoded<wire::StateMark>(sent[0]);
  EXPECT_NE(mark.packer, packer);
  EXPECT_FALSE(mark.answer);
}

TEST_F(StateAnswersTest, ALateJoinerDoesNotStallTheOthers) {
  for (int n = 0; n < 8; ++n) ask({}, {}, 2, "peer" + std::to_string(n), uint64_t(100 + n));
  double now_s = 2;
  std::map<std::string, uint64_t> newest;
  for (int turn = 0; turn < 40; ++turn) {
    const size_t before = sent.size();
    packing.tick(now_s += 0.02);
    uint64_t turn_bytes = 0;
    for (size_t i = before; i < sent.size(); ++i) turn_bytes += sent[i].peer.empty() ? 0 : sent[i].body.size();
    EXPECT_LE(turn_bytes, kWindow) << "a turn is short";
    for (int n = 0; n < 8; ++n) {
      const std::string peer = "peer" + std::to_string(n);
      for (const uint64_t sequence : to(peer)) newest[peer] = std::max(newest[peer], sequence);
      receipt({newest[peer]}, packer, now_s, peer);
    }
  }
  for (int n = 0; n < 8; ++n) EXPECT_GT(newest["peer" + std::to_string(n)], 10u) << "each has its turn";
}

// They ask anew, claim to have received all, or ask in the name of other viewers: bytes that wait for them are counted.
TEST_F(StateAnswersTest, WhoReadsNothingIsSentNoMoreThanItsPart) {
  constexpr int kConnections = 40;
  const auto ask_as = [&](const std::string& user, const std::string& peer, uint64_t viewer, double now_s) {
    net::Message m = message(wire::StateRequest{{viewer}, packer, {}, true}, peer);
    m.user = user, m.role = net::Role::kViewer;
    packing.take_state(socket, m, now_s);
  };
  double now_s = 2;
  for (int round = 0; round < 30; ++round) {
    for (int n = 0; n < kConnections; ++n) {
      const std::string peer = "eve" + std::to_string(n);
      ask_as("eve", peer, uint64_t(1000 + kConnections * (round % 3) + n), now_s);
      receipt({kFrames}, packer, now_s, peer);
    }
    for (int turn = 0; turn < 20; ++turn) packing.tick(now_s += 0.02);
  }
  uint64_t waiting = 0, largest = 0;
  for (const Sent& s : sent) {
    waiting += s.peer.empty() ? 0 : s.body.size();
    largest = std::max<uint64_t>(largest, s.body.size());
  }
  EXPECT_LE(waiting, kAll + kConnections * (largest + 4096));
  // Another person has a share of their own.
  ask_as("anna", "anna", 99, now_s);
  for (int turn = 0; turn < 20; ++turn) packing.tick(now_s += 0.02);
  to("anna");
  EXPECT_GT(bytes, kWindow / 2);
  EXPECT_LE(bytes, kWindow + largest);
}

TEST_F(StateAnswersTest, AnAnswerThatCannotBeSentHasNoMark) {
  takes = 2;
  ask({}, {}, 2);
  for (int n = 0; n < 10; ++n) packing.tick(2.1 + n);
  const auto got = to("peer");
  EXPECT_EQ(got, std::vector<uint64_t>{1});
  EXPECT_EQ(status("answers"), 0);
  takes = 1 << 30;
  ask({1}, packer, 20);
  EXPECT_EQ(to("peer").front(), 2u) << "it asks again";
}

TEST(Completions, AreBounded) {
  Completions completions;
  Event event;
  event.frame_complete = true;
  const auto add = [&](uint64_t viewer) {
    event.sequence = event.sequence.next(), event.viewer = {viewer};
    completions.add(event);
  };
  const auto count = [&](uint64_t viewer) {
    std::deque<Event> events;
    completions.fill(events, {viewer}, {});
    return events.size();
  };
  for (int i = 0; i < 20; ++i) add(1);
  EXPECT_EQ(count(1), Completions::kMostViews);
  std::deque<Event> newest;
  completions.fill(newest, {1}, {19});
  ASSERT_EQ(newest.size(), 1u);
  EXPECT_EQ(newest[0].sequence.value, 20u);
  for (uint64_t viewer = 2; viewer <= Completions::kMostViewers + 1; ++viewer) add(viewer);
  EXPECT_EQ(count(1), 0u) << "who waited longest for a view made room";
  EXPECT_EQ(count(2), 1u);
  for (const bool extra : {false, true}) {  // parts of a coarse pass, and extra rays
    event.step = extra ? 1 : 4, event.extra = extra;
    add(2);
  }
  EXPECT_EQ(count(2), 1u);
}

TEST_F(PointPackingTest, AnotherBoxMeansAnotherModel) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  packing.tick(1);
  const InstanceId first = decoded<wire::StateMark>(sent.back()).packer;
  ASSERT_TRUE(packing.follow(welcome(), 1));
  packing.tick(2);
  EXPECT_EQ(decoded<wire::StateMark>(sent.back()).packer, first);
  auto other = welcome();
  other.box_room.hi.x += 1;
  ASSERT_TRUE(packing.follow(other, 2));
  packing.tick(3);
  EXPECT_NE(decoded<wire::StateMark>(sent.back()).packer, first) << "viewers start anew";
}

TEST_F(PointPackingTest, SessionsOfAnotherPipelineAreNotFollowed) {
  auto volume = welcome();
  volume.facts["kind"] = "volume";
  EXPECT_FALSE(packing.follow(volume, 0));
  SlicePacking slices(outlets(), spans);
  EXPECT_FALSE(slices.follow(welcome(), 0));
  auto unknown = welcome();
  unknown.facts.clear();
  EXPECT_FALSE(packing.follow(unknown, 0));
  EXPECT_FALSE(slices.follow(unknown, 0));
  auto julia = welcome();
  julia.facts["kind"] = "julia";
  EXPECT_TRUE(packing.follow(julia, 0));
  // Messages for the other pipeline are refused.
  packing.take_state(socket, message(wire::SliceAck{{77}, {0}, 2, false}), 1);
  EXPECT_EQ(socket.rejected(), 1u);
  slices.take_state(socket, message(wire::StateRequest{{77}, {}, {}}), 1);
  EXPECT_EQ(socket.rejected(), 2u);
}

TEST_F(PointPackingTest, OneGuestDoesNotSpeakForAnothersViewer) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  const auto says = [&](const char* user, net::Role role, const auto& m) {
    net::Message out = message(m);
    out.user = user, out.role = role;
    packing.take_state(socket, out, 1);
    return socket.rejected();
  };
  const wire::StateRequest asks{{77}, {}, {}};
  const wire::AccessReport drew{.viewer = {77}, .clusters = {}, .frames = {}};
  EXPECT_EQ(says("anna", net::Role::kViewer, asks), 0u);
  EXPECT_EQ(says("ben", net::Role::kViewer, asks), 1u);
  EXPECT_EQ(says("ben", net::Role::kViewer, drew), 2u);
  EXPECT_EQ(says("anna", net::Role::kViewer, drew), 2u);
  EXPECT_EQ(says("owner", net::Role::kOperator, drew), 2u) << "who may end the session";
}

TEST_F(PointPackingTest, TilesThatMakeNoSenseAreRefused) {
  ASSERT_TRUE(packing.follow(welcome(), 0));
  auto bad = tile(1, 0);
  bad.image = {};
  test::seal_lease(bad.lease, bad.sampler);
  packing.take_sampled(socket, message(bad), 1);
  EXPECT_EQ(socket.rejected(), 1u);
  sample(tile(1, 0), 1);
  auto other = tile(1, 1);
  other.lease.camera.near_m *= 2;
  sample(other, 1);
  EXPECT_EQ(socket.rejected(), 2u);
  EXPECT_EQ(told.size(), 1u);
}

}  // namespace
}  // namespace telesplat::packer
