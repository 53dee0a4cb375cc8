// A viewer's reception: it refuses sessions that it cannot show, and follows a session that changes its kind picture by
// picture.
#include <gtest/gtest.h>

#include <limits>

#include "client/viewer/points/received_points.h"
#include "client/viewer/received.h"
#include "client/viewer/succession.h"
#include "common/core/clock.h"
#include "tests/support/patience.h"
#include "tests/support/points_scenes.h"

namespace telesplat::viewer {
namespace {

class Receiving : public testing::Test {
 protected:
  wire::Welcome session() const {
    wire::Welcome w;
    w.octree_depth = 5;
    w.box_room = test::scene_config().box_room;
    return w;
  }
  std::shared_ptr<Received> make(scene::Pipeline pipeline) {
    return make_received(pipeline, {},
                         {.viewer = {5},
                          .gate = gate,
                          .feeds = feeds,
                          .spans = spans,
                          .on_part = [](const ViewPart&) {},
                          .on_epoch = [] {},
                          .requested_s = [](RequestId) { return std::nullopt; },
                          .to_master_s = [](double s) { return s; }});
  }

  net::Context context;
  CouplingGate gate{0};
  Feeds feeds{context, "viewer"};
  metrics::SpanRecorder spans;
};

TEST_F(Receiving, PointsTakeASessionThatAModelCanHave) {
  EXPECT_TRUE(make(scene::Pipeline::kPoints)->follow(session()).ok());
}

TEST_F(Receiving, PointsRefuseBoxesAndDepthsThatNoModelCanHave) {
  const auto received = make(scene::Pipeline::kPoints);
  const auto refused = [&](const wire::Welcome& w) {
    const Status s = received->follow(w);
    return s.ok() ? std::string() : s.error().text;
  };
  for (const float side : {3e6f, std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    wire::Welcome w = session();
    w.box_room.hi.y = side;
    EXPECT_NE(refused(w).find("outside [-1e6, 1e6]"), std::string::npos) << refused(w);
  }
  for (const uint64_t depth : {uint64_t{11}, uint64_t{1} << 32, ~uint64_t{0}}) {
    wire::Welcome w = session();
    w.octree_depth = depth;
    EXPECT_NE(refused(w).find("is outside 0..10"), std::string::npos) << refused(w);
  }
  EXPECT_TRUE(received->follow(session()).ok()) << "what was refused left nothing behind";
}

TEST_F(Receiving, SlicesRefuseASessionWithoutAVolume) {
  EXPECT_FALSE(make(scene::Pipeline::kSlices)->follow(session()).ok());
}

TEST_F(Receiving, FeedsAreConnectedAnewWhereASessionIsElsewhere) {
  wire::Welcome w = session();
  const auto points = make(scene::Pipeline::kPoints), slices = make(scene::Pipeline::kSlices);
  w.endpoints = {{"state", "inproc://state"}};
  EXPECT_FALSE(feeds.connect(points->feeds(), w)) << "it is not known where patches come from";
  EXPECT_FALSE(feeds.connected());
  w.endpoints["patches"] = "inproc://patches";
  EXPECT_TRUE(feeds.connect(points->feeds(), w));
  EXPECT_NE(feeds.find("patches"), nullptr);
  EXPECT_FALSE(feeds.connect(points->feeds(), w));
  w.endpoints["state"] = "inproc://other";
  EXPECT_TRUE(feeds.connect(points->feeds(), w));
  EXPECT_TRUE(feeds.connect(slices->feeds(), w)) << "another packer, at the same place";
  EXPECT_EQ(feeds.find("patches"), nullptr);
  EXPECT_NE(feeds.find("state"), nullptr);
  w.endpoints.clear();
  EXPECT_FALSE(feeds.connect(slices->feeds(), w));
  EXPECT_TRUE(feeds.connected()) << "nobody serves it now: what is open stays";
}

// A packer begins another model as soon as it gets another box. Its first event comes over another connection than the
// viewer's welcome.
TEST_F(Receiving, ABoxThatComesAfterItsPackersFirstEventCounts) {
  net::Socket patches(context, net::Kind::kPub, "patches"), state(context, net::Kind::kRouter, "state");
  ASSERT_TRUE(patches.bind("inproc://patches") && state.bind("inproc://state"));
  wire::Welcome w = session();
  w.endpoints = {{"patches", "inproc://patches"}, {"state", "inproc://state"}};
  const auto received = make(scene::Pipeline::kPoints);
  auto& points = dynamic_cast<ReceivedPoints&>(*received);
  const auto follow = [&] {
    EXPECT_TRUE(received->follow(w).ok());
    if (!feeds.connect(received->feeds(), w)) return false;
    received->on_connected();
    return true;
  };
  // Answers requests with the events that this packer has published, until `until` is true.
  const auto serve = [&](InstanceId packer, const auto& until) {
    for (const double deadline = monotonic_s() + test::patient(20); !until() && monotonic_s() < deadline;) {
      while (const auto message = state.receive())
        if (message->type == wire::StateRequest::kName) {
          state.send(wire::StateBegin{packer, {}}, message->peer);
          state.send(wire::EpochBegin{packer, {1}, {packer.value}}, message->peer);
          state.send(wire::StateMark{packer, {1}, {packer.value}, true, 0}, message->peer);
        }
      patches.receive();
      patches.send(wire::StateMark{packer, {1}, {packer.value}, false, 0});
      received->receive(64);
      received->tick(monotonic_s());
      net::wait_readable({&state}, 5);
    }
    return until();
  };
  const auto epoch = [&] { return points.cache().has_replica() ? points.cache().epoch().value : 0; };
  ASSERT_TRUE(follow());
  EXPECT_FALSE(follow()) << "nothing has changed";
  ASSERT_TRUE(serve({1}, [&] { return epoch() == 1; }));
  ASSERT_TRUE(serve({2}, [&] { return epoch() == 2; }));
  EXPECT_TRUE(points.cache().config().box_room == session().box_room);
  w.box_room.hi.x += 1;
  EXPECT_TRUE(follow()) << "what came before is of another box";
  ASSERT_TRUE(serve({2}, [&] { return points.cache().config().box_room == w.box_room && epoch() == 2; }));
}

TEST_F(Receiving, ABaseIsAskedForWhereTheSessionHasOne) {
  net::Socket patches(context, net::Kind::kPub, "patches"), state(context, net::Kind::kRouter, "state");
  ASSERT_TRUE(patches.bind("inproc://patches") && state.bind("inproc://state"));
  wire::Welcome w = session();
  w.endpoints = {{"patches", "inproc://patches"}, {"state", "inproc://state"}};
  const auto received = make(scene::Pipeline::kPoints);
  // Requests for a base in ten seconds. Each tick asks for the model anew, too: there is no answer.
  const auto requests = [&](const char* kind, uint64_t base_triangles, bool keep) {
    w.facts["kind"] = kind;
    w.settings.base_triangles = base_triangles, w.settings.keep_redundant = keep;
    EXPECT_TRUE(received->follow(w).ok());
    feeds.close();
    EXPECT_TRUE(feeds.connect(received->feeds(), w));
    received->on_connected();
    for (int second = 3; second <= 12; ++second) received->tick(monotonic_s() + second);
    int models = 0, bases = 0;
    for (const double deadline = monotonic_s() + test::patient(20); models < 11 && monotonic_s() < deadline;)
      if (const auto message = state.receive()) ++(message->type == wire::BaseRequest::kName ? bases : models);
    EXPECT_EQ(models, 11);
    return bases;
  };
  EXPECT_EQ(requests("julia", 400'000, false), 0);
  EXPECT_EQ(requests("mesh", 0, false), 0);
  EXPECT_EQ(requests("mesh", 400'000, true), 0);
  w.facts["format"] = "LAS 1.4 points (format 7)";
  EXPECT_EQ(requests("mesh", 400'000, false), 0);
  w.facts["format"] = "PLY (ascii)";
  EXPECT_GE(requests("mesh", 400'000, false), 10);
}

class Successors : public Receiving {
 protected:
  std::shared_ptr<Received> begin(scene::Pipeline pipeline) {
    auto out = make(pipeline);
    succession.begin(out);
    return out;
  }
  Succession succession;
};

TEST_F(Successors, TheFirstIsDrawnBeforeItHasAPicture) {
  EXPECT_EQ(succession.at({}), nullptr);
  const auto first = begin(scene::Pipeline::kPoints);
  EXPECT_EQ(succession.at({}), first);
  const auto second = begin(scene::Pipeline::kSlices);
  EXPECT_EQ(succession.at({}), second) << "the first never had one";
}

TEST_F(Successors, TheNextIsDrawnOnceItHasAPicture) {
  const auto first = begin(scene::Pipeline::kPoints);
  succession.on_update({3});
  const auto second = begin(scene::Pipeline::kSlices);
  EXPECT_EQ(succession.at(Succession::kNewest), first);
  succession.on_update({7});
  EXPECT_EQ(succession.at({6}), first) << "an update of the first still waits for the display";
  EXPECT_EQ(succession.at({7}), second);
  EXPECT_EQ(succession.at(Succession::kNewest), second);
}

TEST_F(Successors, OneWithoutAPictureIsPassedOver) {
  const auto first = begin(scene::Pipeline::kPoints);
  succession.on_update({3});
  begin(scene::Pipeline::kSlices);
  const auto third = begin(scene::Pipeline::kPoints);
  EXPECT_EQ(succession.at(Succession::kNewest), first);
  succession.on_update({9});
  EXPECT_EQ(succession.at(Succession::kNewest), third);
}

TEST_F(Successors, NothingIsFreedThatTheDisplayHolds) {
  auto first = begin(scene::Pipeline::kPoints);
  succession.on_update({1});
  const std::weak_ptr<Received> watched = first;
  begin(scene::Pipeline::kSlices);
  succession.on_update({2});
  succession.at({2});
  succession.free_dropped();
  EXPECT_FALSE(watched.expired());
  first.reset();
  EXPECT_FALSE(watched.expired()) << "not freed by the display";
  succession.free_dropped();
  EXPECT_TRUE(watched.expired());
}

}  // namespace
}  // namespace telesplat::viewer
