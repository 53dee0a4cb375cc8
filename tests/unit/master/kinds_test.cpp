// Changes of the kind of scene, and hellos of data servers that are refused. The master without sockets and clocks.
#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "common/core/log.h"
#include "common/julia/parameters.h"
#include "common/volume/session.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

wire::Hello data(uint64_t instance, const std::string& kind) {
  wire::Hello h;
  h.role = "data";
  h.name = "data" + std::to_string(instance);
  h.instance = {instance};
  h.facts = {{"kind", kind}, {"scene", kind}};
  h.endpoints = {{"chunks", "tcp://chunks" + std::to_string(instance)}};
  h.box_room = {{-1, -1, -1}, {1, 1, 1}};
  if (kind == "julia") h.parameters = julia::to_map(julia::Parameters{});
  return h;
}

wire::Hello volume_part(uint64_t instance, int slices, int part, int parts) {
  volume::Session s;
  s.grid.size = {8, 8, slices};
  s.transfer.points = {{}};
  s.part = part;
  s.parts = parts;
  wire::Hello h = data(instance, "volume");
  h.endpoints = {{"voxels", "tcp://voxels" + std::to_string(instance)}};
  h.parameters = volume::to_parameters(s);
  h.facts.merge(volume::to_facts(s));
  return h;
}

class KindsOfScenes : public ::testing::Test {
 protected:
  void hello(const wire::Hello& h) { core.on(h.name, h, now); }
  void hello(const std::string& role, uint64_t instance) {
    wire::Hello h;
    h.role = role;
    h.name = role + std::to_string(instance);
    h.instance = {instance};
    if (role == "packer") h.endpoints = {{"tiles", "t"}, {"state", "s"}};
    hello(h);
  }
  void join() {
    hello("packer", 10);
    hello("sampler", 1);
    hello("viewer", 20);
  }
  void view(uint64_t id, uint64_t buffers) {
    wire::ViewRequest r;
    r.viewer = {20};
    r.request = {id};
    r.buffers = buffers;
    r.camera = geometry::make_camera({.position_room = {0.1, 0.1, 3}}, 60, 64, 48);
    core.on("viewer20", r, now);
  }
  Status weigh(uint64_t instance, int begin, int slices, EpochId epoch = {1}) {
    wire::SliceWeights w{.data = {instance}, .epoch = epoch};
    w.begin = uint64_t(begin);
    w.voxels.assign(size_t(slices), 10);
    w.bytes_per_voxel = 3;
    return core.on("data" + std::to_string(instance), w, now);
  }
  void ask() { core.on("sampler1", wire::LeaseRequest{{1}}, now); }
  // Reports the slabs that it was assigned.
  void slabs_ready() {
    for (const auto& a : sent<wire::SlabAssignment>("sampler1"))
      core.on("sampler1", wire::SlabReady{{1}, a.partition, {1}, 10, 30}, now);
  }
  template <class M>
  std::vector<M> sent(const std::string& peer) {
    for (auto& out : core.take_outgoing()) outbox.push_back(std::move(out));
    std::vector<M> messages;
    std::erase_if(outbox, [&](const Outgoing& o) {
      if (o.peer != peer || o.type != M::kName) return false;
      auto decoded = wire::decode<M>(std::as_bytes(std::span(o.body)));
      EXPECT_TRUE(decoded) << o.type;
      if (decoded) messages.push_back(*decoded);
      return true;
    });
    return messages;
  }
  wire::Welcome told(const std::string& peer = "viewer20") {
    auto welcomes = sent<wire::Welcome>(peer);
    if (!welcomes.empty()) last[peer] = std::move(welcomes.back());
    return last[peer];
  }
  std::string command(const std::string& name) {
    core.on("ctl", wire::Control{name, {}}, now);
    for (const auto& out : core.take_outgoing())
      if (out.peer == "ctl") return wire::decode<wire::ControlReply>(std::as_bytes(std::span(out.body)))->text;
    return {};
  }

  double now = 0;
  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{{.settings = {.steering = false}}, {42}, *record};
  std::vector<Outgoing> outbox;
  std::map<std::string, wire::Welcome> last;
};

// ---- from one pipeline to the other ---------------------------------------------------------------------------------

TEST_F(KindsOfScenes, FromAMeshToAVolumeAndBackViewsStayAndEpochsBegin) {
  hello(data(1, "mesh"));
  join();
  for (uint64_t id = 1; id <= 3; ++id) view(id, 3);
  ask();
  const auto tile = sent<wire::Lease>("sampler1");
  ASSERT_EQ(tile.size(), 1u) << "the first view is in flight";
  EXPECT_EQ(told().epoch.value, 1u);

  hello(volume_part(2, 12, 0, 1));
  ASSERT_TRUE(weigh(2, 0, 12));
  EXPECT_EQ(told().epoch.value, 2u);
  EXPECT_EQ(told().facts.at("kind"), "volume");
  EXPECT_FALSE(told().endpoints.contains("voxels"));
  slabs_ready();
  ask();
  const auto slab = sent<wire::SliceLease>("sampler1");
  ASSERT_EQ(slab.size(), 1u);
  EXPECT_EQ(slab[0].epoch.value, 2u);
  EXPECT_EQ(slab[0].views[0].request.value, 1u) << "the view that was in flight waits again, before the others";
  EXPECT_GT(slab[0].frame, tile[0].frame) << "one record has both";
  EXPECT_NE(slab[0].lease, tile[0].lease);

  core.on("data2", wire::Goodbye{{2}}, now);
  hello(data(3, "mesh"));
  EXPECT_EQ(told().epoch.value, 3u);
  EXPECT_EQ(told().facts.at("kind"), "mesh");
  ask();
  const auto again = sent<wire::Lease>("sampler1");
  ASSERT_FALSE(again.empty());
  EXPECT_EQ(again[0].epoch.value, 3u);
  EXPECT_EQ(again[0].request.value, 1u);
  EXPECT_GT(again[0].frame, tile[0].frame) << "the packer knows the old frame's number";

  hello(volume_part(2, 12, 0, 1));
  EXPECT_EQ(told().epoch.value, 4u);
  EXPECT_EQ(sent<wire::SlabAssignment>("sampler1").size(), 1u) << "its slab was let go";
}

TEST_F(KindsOfScenes, WhatWasOnItsWayToAViewerOfTheMeshBeforeHoldsNoViewUp) {
  hello(data(1, "mesh"));
  join();
  core.on("packer10", wire::LinkReport{.viewer = {20}, .rate_bytes_s = 1e6, .backlog_bytes = 100'000'000}, now);
  view(1, 1);
  ask();
  EXPECT_TRUE(sent<wire::Lease>("sampler1").empty()) << "its link is busy";
  hello(volume_part(2, 12, 0, 1));
  ASSERT_TRUE(weigh(2, 0, 12));
  core.on("data2", wire::Goodbye{{2}}, now);
  hello(data(3, "mesh"));
  ask();
  EXPECT_EQ(sent<wire::Lease>("sampler1").size(), 1u) << "the packer has a new model, of which nothing is under way";
}

TEST_F(KindsOfScenes, AMeshIsShownUntilAllPartsOfAVolumeAreThere) {
  hello(data(1, "mesh"));
  join();
  hello(volume_part(2, 12, 0, 2));
  EXPECT_EQ(told().facts.at("kind"), "mesh");
  view(1, 0);
  ask();
  EXPECT_EQ(sent<wire::Lease>("sampler1").size(), 1u);
  hello(volume_part(3, 12, 1, 2));
  EXPECT_EQ(told().facts.at("kind"), "volume");
  EXPECT_EQ(told().epoch.value, 2u);
}

// ---- another volume -------------------------------------------------------------------------------------------------

TEST_F(KindsOfScenes, AnotherVolumesFirstServerDoesNotEndTheMaster) {
  hello(volume_part(1, 12, 0, 1));
  join();
  ASSERT_TRUE(weigh(1, 0, 12));
  slabs_ready();
  view(7, 1);
  ask();
  ASSERT_EQ(sent<wire::SliceLease>("sampler1").size(), 1u);
  core.on("data1", wire::Goodbye{{1}}, now);

  hello(volume_part(2, 20, 0, 2));
  EXPECT_TRUE(weigh(2, 0, 10)) << "of a volume of which the other half is missing";
  EXPECT_TRUE(told().facts.empty()) << "neither volume can be shown";
  ask();
  now = 10;
  core.tick(now);
  EXPECT_TRUE(sent<wire::SliceLease>("sampler1").empty());
  EXPECT_TRUE(sent<wire::SlabAssignment>("sampler1").empty());

  for (const auto& [role, instance] : {std::pair{"packer", 10}, {"sampler", 1}, {"viewer", 20}})
    hello(role, uint64_t(instance));
  hello(volume_part(3, 20, 1, 2));
  EXPECT_EQ(told().facts.at("kind"), "volume");
  EXPECT_EQ(told().epoch.value, 2u);
  ASSERT_TRUE(weigh(2, 0, 10, {2}));
  ASSERT_TRUE(weigh(3, 10, 10, {2}));
  slabs_ready();
  view(7, 1);
  ask();
  const auto leases = sent<wire::SliceLease>("sampler1");
  ASSERT_EQ(leases.size(), 1u);
  EXPECT_EQ(leases[0].end, 20u);
  EXPECT_EQ(leases[0].views[0].request.value, 7u);
}

TEST_F(KindsOfScenes, AViewInFlightOfAVolumeThatIsReplacedWaitsForTheNext) {
  hello(volume_part(1, 12, 0, 1));
  join();
  ASSERT_TRUE(weigh(1, 0, 12));
  slabs_ready();
  view(7, 1);
  ask();
  ASSERT_EQ(sent<wire::SliceLease>("sampler1").size(), 1u);
  core.on("data1", wire::Goodbye{{1}}, now);
  hello(volume_part(2, 20, 0, 2));
  hello(volume_part(3, 20, 1, 2));
  ASSERT_TRUE(weigh(2, 0, 10, {2}));
  ASSERT_TRUE(weigh(3, 10, 10, {2}));
  slabs_ready();
  ask();
  const auto leases = sent<wire::SliceLease>("sampler1");
  ASSERT_EQ(leases.size(), 1u);
  EXPECT_EQ(leases[0].views[0].request.value, 7u);
}

TEST_F(KindsOfScenes, OneConnectionThatTellsOfTwoVolumesIsHarmless) {
  for (const char* kind : {"mesh", "volume"}) {
    if (std::string(kind) == "mesh") hello(data(1, kind));
    hello(volume_part(5, 10, 0, 1));
    hello(volume_part(5, 20, 0, 2));
    EXPECT_TRUE(weigh(5, 0, 10));
    EXPECT_FALSE(weigh(5, 0, 20)) << "more slices than its part has";
  }
  EXPECT_NE(command("tf").find("parts are missing"), std::string::npos);
  EXPECT_NE(command("status").find("\"epoch\""), std::string::npos);
}

TEST_F(KindsOfScenes, SliceWeightsOfAMeshAreRefused) {
  hello(data(1, "mesh"));
  EXPECT_FALSE(weigh(1, 0, 10));
}

// ---- boxes ----------------------------------------------------------------------------------------------------------

TEST_F(KindsOfScenes, ABoxBeyondTheLimitsIsRefusedAndNotPassedOn) {
  hello(data(1, "mesh"));
  join();
  const auto before = told();
  log::initialise("master", "info");  // on stderr
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN(), kInfinite = std::numeric_limits<float>::infinity();
  uint64_t instance = 2;
  for (const float wrong : {3e6f, -3e6f, kNan, kInfinite})
    for (auto bad : {data(instance, "mesh"), data(instance + 1, "julia"), volume_part(instance + 2, 12, 0, 1)}) {
      bad.box_room.hi.y = bad.box_room.lo.y = wrong;
      ::testing::internal::CaptureStderr();
      hello(bad);
      const std::string said = ::testing::internal::GetCapturedStderr();
      EXPECT_NE(said.find(bad.name), std::string::npos) << said;
      EXPECT_NE(said.find("1e6"), std::string::npos) << said;
      instance += 3;
      for (const auto& welcome : {told(), told(bad.name)}) {
        EXPECT_EQ(welcome.box_room, before.box_room) << wrong;
        EXPECT_EQ(welcome.facts, before.facts);
        EXPECT_EQ(welcome.epoch, before.epoch);
        EXPECT_EQ(welcome.endpoints.at("chunks"), before.endpoints.at("chunks"));
      }
      core.on(bad.name, wire::Goodbye{bad.instance}, now);
    }
}

TEST_F(KindsOfScenes, ARefusedServersEndpointsAreToldNobody) {
  join();
  auto bad = data(2, "mesh");
  bad.box_room.hi.x = 3e6f;
  hello(bad);
  EXPECT_FALSE(told().endpoints.contains("chunks"));
  EXPECT_TRUE(told().box_room.empty());
  // A later hello may be valid.
  hello(data(2, "mesh"));
  hello("viewer", 20);
  EXPECT_TRUE(told().endpoints.contains("chunks"));
  EXPECT_EQ(told().box_room.hi.x, 1);
}

// ---- what was not given ---------------------------------------------------------------------------------------------

TEST_F(KindsOfScenes, WhatWasNotGivenIsAsTheKindHasIt) {
  join();
  const auto expect = [&](double sampling, bool progressive) {
    const auto s = told().settings;
    EXPECT_EQ(s.least_sampling, sampling);
    EXPECT_EQ(told().octree_depth, 5u);
    EXPECT_EQ(core.progressive(), progressive);
    EXPECT_EQ(core.settings(), s);
  };
  expect(0.5, false);  // before any data server joins
  hello(data(1, "julia"));
  expect(0.4, true);
  hello(data(2, "mesh"));
  expect(0.5, false);
  hello(volume_part(3, 12, 0, 1));
  expect(0.5, false);
  EXPECT_EQ(told().settings.layers, 16u);
}

// Volumes have no rays that a plan could choose; pictures, and models that keep everything, need all rays.
TEST(Settings, RaysArePlannedForPointsUnlessAllAreNeeded) {
  for (const auto kind : scene::kKinds) EXPECT_EQ(settings({}, kind).steering, kind != scene::Kind::kVolume);
  EXPECT_FALSE(settings({.settings = {.keep_redundant = true}}, scene::Kind::kMesh).steering);
  EXPECT_FALSE(settings({.settings = {.pictures = true}}, scene::Kind::kMesh).steering);
  EXPECT_FALSE(settings({.settings = {.steering = false}}, scene::Kind::kMesh).steering);
}

TEST(Settings, WhatWasGivenIsToldOfEveryKind) {
  MasterOptions o;
  o.settings.max_points = 5;
  o.progressive = Progressive::kOff;
  for (const auto kind : scene::kKinds) {
    EXPECT_EQ(settings(o, kind).max_points, 5u);
    EXPECT_FALSE(settings(o, kind).keep_redundant);
    EXPECT_FALSE(progressive(o, kind));
  }
  o.progressive = Progressive::kOn;
  o.settings.keep_redundant = true;
  for (const auto kind : scene::kKinds) {
    EXPECT_TRUE(settings(o, kind).keep_redundant);
    EXPECT_TRUE(progressive(o, kind));
  }
}

// ---- text -----------------------------------------------------------------------------------------------------------

TEST_F(KindsOfScenes, StatusShowsTextThatIsNotUtf8) {
  auto mesh = data(1, "mesh");
  mesh.facts["scene"] = "caf\xe9.ply";
  hello(mesh);
  wire::StatusReport report;
  report.values = {{"\xff", 1}};
  core.on("data1", report, now);
  const auto status = nlohmann::json::parse(command("status"), nullptr, false);
  ASSERT_TRUE(status.is_object());
  EXPECT_EQ(status["processes"][0]["facts"]["scene"], "caf\xef\xbf\xbd.ply");
}

}  // namespace
}  // namespace telesplat::master
