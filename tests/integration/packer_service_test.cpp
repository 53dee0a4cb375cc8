// The packer process in a thread, between a master, a sampler and a viewer made for the test.
#include <gtest/gtest.h>

#include <functional>
#include <glm/gtc/matrix_transform.hpp>
#include <optional>
#include <random>
#include <thread>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/net/service.h"
#include "common/net/socket.h"
#include "common/volume/session.h"
#include "services/packer/packer_service.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/patience.h"
#include "tests/support/raw_peer.h"

namespace telesplat {
namespace {

constexpr double kDeadline_s = test::patient(20);

class PackerServiceTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto bound = master.bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound);
    options.service.master = *bound;
    options.service.log_level = "off";
    thread = std::thread([this] { code = packer::run(options).value(); });
    const auto message = next(master, wire::Hello::kName);
    ASSERT_TRUE(message);
    packer_peer = message->peer;
    hello = *wire::decode<wire::Hello>(message->body);
    ASSERT_TRUE(viewer.connect(hello.endpoints.at("state")));
    ASSERT_TRUE(sampler.connect(hello.endpoints.at("tiles")));
  }
  void TearDown() override {
    master.send(wire::Shutdown{"the test is over"}, packer_peer);
    thread.join();
    EXPECT_EQ(code, 0);
  }

  // Returns the next message of that type; drops others. ask: called now and then to send the request again.
  std::optional<net::Message> next(net::Socket& from, std::string_view type, const std::function<void()>& ask = {}) {
    double asked_s = -1e9;
    for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until;) {
      if (ask && monotonic_s() - asked_s > 0.2) {
        asked_s = monotonic_s();
        ask();
      }
      net::wait_readable({&from, &master}, 20);
      while (auto message = from.receive())
        if (message->type == type) return message;
      if (&from != &master)
        while (master.receive()) {
        }
    }
    return std::nullopt;
  }

  wire::Welcome mesh() {
    wire::Welcome w;
    w.master = {1}, w.lease_key = test::lease_key(), w.epoch = {1}, w.octree_depth = 6;
    w.hello_sent_s = hello.sent_s;
    w.box_room = {{-1, -1, -1}, {1, 1, 1}};
    w.facts["kind"] = "mesh";
    return w;
  }
  wire::Welcome a_volume() {
    volume::Session s;
    s.grid = grid;
    s.transfer.points = {{0, 1, 1, 1, 0.5f}};
    wire::Welcome w = mesh();
    w.epoch = {2};
    w.facts = volume::to_facts(s);
    w.facts["kind"] = "volume";
    w.parameters = volume::to_parameters(s);
    return w;
  }
  // Waits until the packer has answered the master.
  bool comes_round() {
    master.send(wire::WhoAreYou{{1}}, packer_peer);
    return next(master, wire::Hello::kName).has_value();
  }
  // Returns the mark that ends the answer to a viewer of points.
  std::optional<wire::StateMark> ask_for_points() {
    const auto message = next(viewer, wire::StateMark::kName, [this] {
      viewer.send(wire::StateRequest{{77}, {}, {}});
    });
    if (!message) return std::nullopt;
    return viewer.decode<wire::StateMark>(*message);
  }
  // Returns a frame of slices, as soon as the packer knows the volume.
  std::optional<wire::SliceFrame> ask_for_slices() {
    const auto camera = geometry::make_camera({{0, 0, 0.6}, {1, 0, 0, 0}}, 60, 64, 48);
    uint64_t frame = 0;
    const auto message = next(viewer, wire::SliceFrame::kName, [&] {
      viewer.send(wire::SliceAck{{77}, {0}, 2, false});
      wire::SliceLease lease{.lease = {++frame}, .frame = {frame}, .epoch = {2}, .partition = 1};
      lease.end = uint64_t(grid.size[2]);
      lease.shear = *volume::plan_frame(grid, std::span(&camera, 1));
      lease.views = {{{77}, {5}, camera, 0}};
      test::seal_lease(lease, {9});
      sampler.send(wire::SliceImages{.sampler = {9}, .lease = lease, .voxels = 3});
    });
    if (!message) return std::nullopt;
    return viewer.decode<wire::SliceFrame>(*message);
  }

  const volume::Grid grid{{16, 16, 16}, glm::scale(glm::translate(glm::dmat4(1), glm::dvec3(-0.08)), glm::dvec3(0.01))};
  net::Context context;
  net::Socket master{context, net::Kind::kRouter, "master"};
  net::Socket viewer{context, net::Kind::kDealer, "viewer", {.max_message_bytes = wire::kMaxBulkBytes}};
  net::Socket sampler{context, net::Kind::kPush, "sampler"};
  packer::PackerOptions options;
  std::thread thread;
  std::string packer_peer;
  wire::Hello hello;
  int code = -1;
};

TEST_F(PackerServiceTest, FollowsASessionThatChangesFromPointsToSlicesAndBack) {
  master.send(mesh(), packer_peer);
  const auto first = ask_for_points();
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->answer);
  EXPECT_EQ(first->epoch.value, 1u);

  master.send(a_volume(), packer_peer);
  const auto frame = ask_for_slices();
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->epoch.value, 2u);
  EXPECT_EQ(frame->voxels, 3u);

  auto back = mesh();
  back.epoch = {3};
  master.send(back, packer_peer);
  const auto second = ask_for_points();
  ASSERT_TRUE(second);
  EXPECT_EQ(second->epoch.value, 3u);
  EXPECT_NE(second->packer, first->packer) << "viewers start anew";
}

// The other viewer must not notice, and memory must not grow.
TEST_F(PackerServiceTest, AViewerThatReadsNothingCostsNoMoreThanItsWindow) {
  wire::Welcome session = mesh();
  session.settings.keep_redundant = 1;
  session.settings.steering = 0;
  master.send(session, packer_peer);
  ASSERT_TRUE(ask_for_points());
  // Pixels of noise: 40 patches of some 300 KB.
  constexpr int kSide = 256, kPatches = 40;
  std::minstd_rand random(1);
  uint64_t told = 0;
  std::vector<uint8_t> stream;
  wire::DepthTile m;
  for (uint64_t frame = 1; frame <= kPatches; ++frame) {
    image::DepthImage noise(kSide, kSide);
    for (size_t i = 0; i < noise.pixels(); ++i) {
      noise.depth[i] = (1u << 20) + uint32_t(random()) % (1u << 20);
      noise.colour[i] = uint32_t(random()) & 0xffffff;
      noise.normal[i] = uint16_t(random());
    }
    stream = codec::encode(noise);
    m = {.sampler = {9}};
    m.lease.lease = {frame}, m.lease.frame = {frame}, m.lease.epoch = {1}, m.lease.viewer = {77};
    m.lease.request = {frame}, m.lease.blocks_in_frame = 1;
    m.lease.camera = geometry::make_camera({{0, 0, 0.6}, {1, 0, 0, 0}}, 60, kSide, kSide);
    m.lease.rect = m.lease.block_rect = {0, 0, kSide, kSide};
    m.image = std::as_bytes(std::span(stream));
    test::seal_lease(m.lease, {9});
    while (!sampler.send(m)) std::this_thread::yield();
    if (next(master, wire::TileDone::kName)) ++told;
  }
  ASSERT_EQ(told, kPatches);
  net::Socket idle(context, net::Kind::kDealer, "idle",
                   {.high_water_mark = 1, .max_message_bytes = wire::kMaxBulkBytes});
  ASSERT_TRUE(idle.connect(hello.endpoints.at("state")));
  const double before_mb = net::resident_mb();
  for (int n = 0; n < 30; ++n) {
    while (!idle.send(wire::StateRequest{{78}, {}, {}})) std::this_thread::yield();
    ASSERT_TRUE(sampler.send(m));  // again: dropped, but reported as done
    ASSERT_TRUE(next(master, wire::TileDone::kName)) << n;
  }
  EXPECT_LT(net::resident_mb() - before_mb, 64);
  EXPECT_TRUE(next(viewer, wire::Patch::kName, [this] {
    viewer.send(wire::StateRequest{{77}, {}, {}});
  })) << "others are answered";
}

TEST_F(PackerServiceTest, WhatComesBeforeItsSessionWaitsForIt) {
  viewer.send(wire::StateRequest{{77}, {}, {}});
  ASSERT_TRUE(comes_round());
  EXPECT_FALSE(viewer.receive());
  master.send(mesh(), packer_peer);
  const auto message = next(viewer, wire::StateMark::kName);
  ASSERT_TRUE(message) << "it was asked for once";
}

// Waits for the packer's reports to have an expected value.
class PackerLimits : public PackerServiceTest {
 protected:
  PackerLimits() {
    options.service.max_messages = 100;
    options.service.max_connections = 4;
  }
  bool reports(const std::string& key, const std::function<bool(double)>& expected) {
    for (const double until = monotonic_s() + kDeadline_s; monotonic_s() < until;) {
      const auto message = next(master, wire::StatusReport::kName);
      const auto report = message ? master.decode<wire::StatusReport>(*message) : std::nullopt;
      if (report && report->values.contains(key) && expected(report->values.at(key))) return true;
    }
    return false;
  }
};

TEST_F(PackerLimits, WhatIsOnItsWayOfADataSetOfAnotherKindIsNoFault) {
  master.send(a_volume(), packer_peer);
  ASSERT_TRUE(ask_for_slices());
  auto other = mesh();
  other.epoch = {3};
  master.send(other, packer_peer);
  ASSERT_TRUE(ask_for_points());
  double before = -1;  // counts requests from before the packer knew of the change
  for (int i = 0; i < 2; ++i) ASSERT_TRUE(reports("messages_rejected", [&](double n) { return (before = n) >= 0; }));
  sampler.send(wire::SliceImages{.sampler = {9}});
  viewer.send(wire::SliceAck{{77}, {0}, 2, false});
  sampler.send(wire::PictureTile{});  // this session never had pictures
  EXPECT_TRUE(reports("messages_rejected", [&](double n) { return n > before; }));
  EXPECT_TRUE(reports("messages_rejected", [&](double n) { return n == before + 1; }));
}

TEST_F(PackerLimits, AFloodOfRequestsIsDroppedAndCountedAndOthersAreAnswered) {
  master.send(mesh(), packer_peer);
  ASSERT_TRUE(ask_for_points());
  net::Socket flood(context, net::Kind::kDealer, "flood");
  ASSERT_TRUE(flood.connect(hello.endpoints.at("state")));
  constexpr int kFlood = 3000;
  for (int n = 0; n < kFlood; ++n)
    while (!flood.send(wire::Receipt{{78}, {}, {}, 0})) std::this_thread::yield();
  const auto message = next(viewer, wire::StateMark::kName, [this] { viewer.send(wire::StateRequest{{77}, {}, {}}); });
  EXPECT_TRUE(message) << "others are answered";
  EXPECT_TRUE(reports("messages_refused", [&](double n) { return n >= kFlood / 2 && n <= kFlood - 200; }));
}

TEST_F(PackerLimits, ConnectionsBeyondTheLimitAreCounted) {
  master.send(mesh(), packer_peer);
  ASSERT_TRUE(ask_for_points());
  std::vector<std::unique_ptr<test::RawPeer>> strangers;
  for (int i = 0; i < 20; ++i) strangers.push_back(std::make_unique<test::RawPeer>(hello.endpoints.at("state")));
  EXPECT_TRUE(reports("connections_refused", [](double n) { return n >= 17; }));
  EXPECT_TRUE(ask_for_points()) << "friends stay";
}

}  // namespace
}  // namespace telesplat
