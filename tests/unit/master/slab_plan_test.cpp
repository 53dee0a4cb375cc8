// A volume's frames and its session at the master, without sockets and clocks.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <set>

#include "services/master/master_core.h"
#include "services/master/slabs/assignment.h"
#include "services/master/slabs/schedule.h"

namespace telesplat::master {
namespace {

volume::Session session(int part = 0, int parts = 1, int steps = 1) {
  volume::Session s;
  s.grid.size = {16, 16, 24};
  s.grid.index_to_room[0][0] = s.grid.index_to_room[1][1] = s.grid.index_to_room[2][2] = 0.05;
  s.levels = {0, 1, 256};
  s.range = {.lo = 0, .hi = 255, .typical_lo = 10, .typical_hi = 200};
  s.transfer.points = {{.value = 0, .opacity = 0}, {.value = 255, .opacity = 0.5}};
  s.part = part;
  s.parts = parts;
  s.steps = steps;
  return s;
}

wire::ViewRequest request(uint64_t viewer, uint64_t id, uint64_t buffers = 0, glm::dvec3 eye = {0.4, 0.4, 3}) {
  wire::ViewRequest r;
  r.viewer = {viewer};
  r.request = {id};
  r.buffers = buffers;
  r.camera = geometry::make_camera({.position_room = eye}, 60, 64, 48);
  return r;
}

// Returns the same partition for the same number.
std::shared_ptr<Partition> halves(uint64_t number = 1) {
  static std::map<uint64_t, std::shared_ptr<Partition>> all;
  auto& p = all[number];
  if (!p) p = std::make_shared<Partition>();
  p->number = number;
  p->slabs = {{.sampler = "a", .range = {0, 10}}, {.sampler = "b", .range = {10, 24}}};
  return p;
}

wire::TileDone done(const wire::SliceLease& l) {
  wire::TileDone m;
  m.frame = l.frame;
  m.tile = l.slab;
  m.lease = l.lease;
  return m;
}

// ---- planning -------------------------------------------------------------------------------------------------------

TEST(Plan, ViewsThatSeeTheVolumeHaveItsFrame) {
  const auto grid = session().grid;
  const auto frame = plan(grid, {request(1, 1)}, 8);
  EXPECT_TRUE(volume::validate(frame, grid));
  EXPECT_EQ(frame.axis, 2);
  EXPECT_EQ(frame.direction, -1);
  EXPECT_EQ(frame.layers.size(), 8u);
  EXPECT_GT(frame.width, 4);
}

TEST(Plan, ViewsThatSeeNothingHaveAnEmptyFrameThatIsValid) {
  for (const auto& size : {std::array{16, 16, 24}, {1, 1, 1}, {4096, 1, 1}, {1, 2, 4096}}) {
    auto grid = session().grid;
    grid.size = size;
    for (const glm::dvec3 eye : {glm::dvec3(0.4, 0.4, -3),
                                 {0, 0, 0},
                                 {0.4, 0.4, 1.2},
                                 {100, 0, 0},
                                 {0, -1e12, 0},
                                 {0.025, 0, 0},
                                 {1e300, 0, 0}}) {
      // Looks along -z from behind, from within and from far off: away from the volume, or at it, which is planned.
      const auto frame = plan(grid, {request(1, 1, 0, eye)}, 16);
      const auto valid = volume::validate(frame, grid);
      ASSERT_TRUE(valid) << valid.error().text;
      if (frame.width > 1 || frame.height > 1) continue;
      // Its pixel lies beyond the volume on each of its slices.
      ASSERT_EQ(frame.layers.size(), 1u);
      for (const double x : {0.0, 1.0}) {
        const glm::dvec3 p = frame.unproject(x, x, frame.layers[0].plane);
        EXPECT_GT(p[frame.u()], grid.size[size_t(frame.u())]);
        EXPECT_GT(p[frame.v()], grid.size[size_t(frame.v())]);
      }
    }
  }
}

// ---- frames ---------------------------------------------------------------------------------------------------------

class Slabs : public ::testing::Test {
 protected:
  Slabs() { s.set_grid(session().grid); }
  VolumeSchedule s{{.frames_in_flight = 2, .lease_timeout_s = 2}};
  std::set<std::string> lost;
  int expire(double now_s) {
    return s.expire(now_s, [&](const std::string& sampler) { lost.insert(sampler); });
  }
};

TEST_F(Slabs, EverySamplerHasASlabOfEveryFrame) {
  EXPECT_FALSE(s.begin_frame({3}, halves()));
  s.request_view(request(1, 7));
  EXPECT_FALSE(s.begin_frame({3}, nullptr));
  ASSERT_TRUE(s.begin_frame({3}, halves(5)));
  const auto a = s.lease("a", 1), b = s.lease("b", 1.5);
  ASSERT_TRUE(a && b);
  EXPECT_FALSE(s.lease("a", 1));
  EXPECT_FALSE(s.lease("c", 1)) << "it has no slab";
  EXPECT_EQ(a->frame, b->frame);
  EXPECT_NE(a->lease, b->lease);
  EXPECT_EQ(a->epoch.value, 3u);
  EXPECT_EQ(b->partition, 5u);
  EXPECT_EQ(b->slab, 1u);
  EXPECT_EQ(b->slabs, 2u);
  EXPECT_EQ(b->begin, 10u);
  EXPECT_EQ(b->end, 24u);
  EXPECT_EQ(b->moments.leased_s, 1.5);
  ASSERT_EQ(a->views.size(), 1u);
  EXPECT_EQ(a->views[0].request.value, 7u);
  EXPECT_EQ(a->shear, b->shear);
  EXPECT_TRUE(s.tile_done(done(*a), 1.6));
  EXPECT_FALSE(s.tile_done(done(*a), 1.6)) << "twice";
  auto other = done(*b);
  other.lease = {99};
  EXPECT_FALSE(s.tile_done(other, 1.6));
  other = done(*b);
  other.tile = 2;
  EXPECT_FALSE(s.tile_done(other, 1.6));
  EXPECT_EQ(s.frames_completed(), 0u);
  EXPECT_TRUE(s.tile_done(done(*b), 1.7));
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_EQ(s.frames_in_flight(), 0u);
}

TEST_F(Slabs, ViewsFromTheSamePlaceAreOneFrame) {
  s.request_view(request(1, 1));
  s.request_view(request(2, 5, 0, {0.4, 0.4, 3 - 0.019}));
  s.request_view(request(3, 1, 0, {0.4, 0.4, 3 - 0.021}));
  s.request_view(request(4, 1, 2));
  s.request_view(request(4, 2, 2));
  ASSERT_TRUE(s.begin_frame({1}, halves()));
  const auto first = s.lease("a", 0);
  ASSERT_TRUE(first);
  ASSERT_EQ(first->views.size(), 3u);
  EXPECT_EQ(first->views[0].viewer.value, 1u) << "the frame is seen from the eye of the first";
  EXPECT_EQ(first->views[1].viewer.value, 2u);
  EXPECT_EQ(first->views[2].viewer.value, 4u);
  EXPECT_EQ(first->views[2].request.value, 1u);
  EXPECT_EQ(first->views[2].buffers, 2u);
  ASSERT_TRUE(s.begin_frame({1}, halves()));
  const auto second = s.lease("a", 0);
  EXPECT_EQ(second->views.size(), 1u);
  EXPECT_EQ(second->views[0].viewer.value, 3u) << "2.1 cm away";
}

TEST_F(Slabs, ViewsInFlightAreBounded) {
  for (uint64_t viewer = 1; viewer <= 5; ++viewer) s.request_view(request(viewer, 1, 0, {double(viewer), 0.4, 3}));
  EXPECT_TRUE(s.begin_frame({1}, halves()));
  EXPECT_TRUE(s.begin_frame({1}, halves()));
  EXPECT_FALSE(s.begin_frame({1}, halves()));
  s.drop_frames();
  s.forget_viewer({1});
  for (uint64_t viewer = 2; viewer <= 5; ++viewer) s.forget_viewer({viewer});
  EXPECT_FALSE(s.view_waiting());
  for (uint64_t id = 1; id <= 8; ++id) s.request_view(request(6, id, 8));
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(s.begin_frame({1}, halves()));
  EXPECT_FALSE(s.begin_frame({1}, halves()));
}

TEST_F(Slabs, LeasesThatRunOutDropTheirFrame) {
  s.request_view(request(1, 1));
  s.begin_frame({1}, halves());
  const auto a = s.lease("a", 0), b = s.lease("b", 0);
  s.tile_done(done(*a), 0.1);
  EXPECT_EQ(expire(1.9), 0);
  s.extend(b->lease, "b", 1.9);
  s.extend({77}, "b", 1.9);
  EXPECT_EQ(expire(3.8), 0);
  EXPECT_EQ(expire(4), 1);
  EXPECT_EQ(lost, (std::set<std::string>{"b"}));
  EXPECT_EQ(s.frames_in_flight(), 0u);
  EXPECT_EQ(s.slabs_released(), 1u);
  EXPECT_TRUE(s.view_waiting()) << "the view waits again";
  EXPECT_FALSE(s.tile_done(done(*b), 4.1)) << "the frame is gone";
  EXPECT_EQ(s.lease_time_s(), 4) << "a slow sampler gets more time";
  s.request_view(request(1, 2));
  s.begin_frame({1}, halves());
  const auto c = s.lease("a", 5);
  EXPECT_EQ(c->views[0].request.value, 2u) << "a newer request has taken the place of the older one";
  const auto d = s.lease("b", 5);
  s.tile_done(done(*c), 8);
  s.tile_done(done(*d), 8);
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_GT(s.lease_time_s(), 2) << "3 s are usual here";
}

TEST_F(Slabs, PartitionsDoNotMix) {
  s.request_view(request(1, 1));
  s.request_view(request(2, 1, 0, {0, 0.4, 3}));
  ASSERT_TRUE(s.begin_frame({1}, halves(1)));
  EXPECT_FALSE(s.begin_frame({1}, halves(2))) << "its frame might be complete before the one that was begun first";
  for (const char* sampler : {"a", "b"}) s.tile_done(done(*s.lease(sampler, 0)), 0.1);
  EXPECT_TRUE(s.begin_frame({1}, halves(2)));
}

TEST_F(Slabs, ViewsInOrderAreDroppedInOrder) {
  for (uint64_t id = 1; id <= 2; ++id) s.request_view(request(1, id, 2));
  s.begin_frame({1}, halves());
  s.begin_frame({1}, halves());
  const auto first = s.lease("a", 0), second = s.lease("a", 1);
  s.tile_done(done(*second), 1.1);  // the first one's images were lost
  EXPECT_EQ(expire(2.5), 1);
  EXPECT_EQ(s.frames_in_flight(), 0u) << "or the second view would be there before the first";
  s.begin_frame({1}, halves());
  EXPECT_EQ(s.lease("b", 3)->views[0].request.value, 1u);
}

TEST_F(Slabs, SamplersThatAreGoneDropOnlyWhatLacksTheirSlab) {
  s.request_view(request(1, 1));
  s.request_view(request(2, 1, 0, {0, 0.4, 3}));
  s.begin_frame({1}, halves());
  s.begin_frame({1}, halves());
  const auto a1 = s.lease("a", 0), a2 = s.lease("a", 0), b1 = s.lease("b", 0);
  EXPECT_EQ(s.leases_of("a"), 2u);
  s.tile_done(done(*a1), 0.1);
  EXPECT_EQ(s.release_sampler("a"), 1);
  EXPECT_EQ(s.frames_in_flight(), 1u) << "the packer has its slab of the first";
  EXPECT_TRUE(s.tile_done(done(*b1), 0.2));
  EXPECT_EQ(s.frames_completed(), 1u);
  EXPECT_TRUE(s.view_waiting());
  s.forget_viewer({2});
  EXPECT_FALSE(s.view_waiting());
}

TEST_F(Slabs, BufferedViewsOfDroppedFramesWaitInOrder) {
  for (uint64_t id = 1; id <= 4; ++id) s.request_view(request(1, id, 4));
  while (s.begin_frame({1}, halves())) {
  }
  s.request_view(request(1, 2, 4));  // asked again: it is in flight
  s.drop_frames();
  std::vector<uint64_t> order;
  while (s.begin_frame({2}, halves())) {
    const auto l = s.lease("a", 0);
    order.push_back(l->views[0].request.value);
    s.tile_done(done(*l), 0);
    s.tile_done(done(*s.lease("b", 0)), 0);
  }
  EXPECT_EQ(order, (std::vector<uint64_t>{1, 2, 3, 4}));
}

TEST_F(Slabs, ViewersThatLeftDoNotWaitAgain) {
  s.request_view(request(1, 1));
  s.request_view(request(2, 1));
  s.begin_frame({1}, halves());
  s.forget_viewer({1});
  s.drop_frames();
  ASSERT_TRUE(s.begin_frame({1}, halves()));
  EXPECT_EQ(s.lease("a", 0)->views.size(), 1u);
}

TEST_F(Slabs, SaysWhoIsOverdue) {
  s.request_view(request(1, 1));
  s.begin_frame({1}, halves());
  const auto a = s.lease("a", 0), b = s.lease("b", 0);
  EXPECT_TRUE(s.overdue(1).empty()) << "nothing is known of what is usual";
  s.tile_done(done(*a), 0.1);
  EXPECT_TRUE(s.overdue(0.2).empty());
  EXPECT_EQ(s.overdue(0.5), (std::vector<std::string>{"b"}));
  s.tile_done(done(*b), 0.6);
  EXPECT_TRUE(s.overdue(0.7).empty());
}

// ---- the scene ------------------------------------------------------------------------------------------------------

wire::Hello data_hello(const volume::Session& s, const std::string& name, uint64_t instance) {
  wire::Hello h;
  h.role = "data";
  h.name = name;
  h.instance = {instance};
  h.endpoints = {{"voxels", "tcp://" + name}};
  h.parameters = volume::to_parameters(s);
  h.facts = volume::to_facts(s);
  h.facts["kind"] = "volume";
  h.facts["scene"] = "hill.nrrd";
  h.facts["content_hash"] = "abc";
  h.box_room = s.grid.box_room();
  return h;
}

wire::SliceWeights weights_of(const volume::Session& s, uint64_t instance, EpochId epoch, uint32_t each = 100) {
  wire::SliceWeights w;
  w.data = {instance};
  w.epoch = epoch;
  const int n = s.grid.size[2];
  w.begin = uint64_t(n * s.part / s.parts);
  w.voxels.assign(size_t(n * (s.part + 1) / s.parts) - w.begin, each);
  w.bytes_per_voxel = 3;
  return w;
}

TEST(VolumeScene, IsKnownOnceAllPartsAre) {
  VolumeScene scene;
  EXPECT_FALSE(scene.complete());
  auto change = scene.adopt(data_hello(session(1, 2), "d2", 2));
  ASSERT_TRUE(change) << change.error().text;
  EXPECT_FALSE(scene.complete());
  change = scene.adopt(data_hello(session(0, 2), "d1", 1));
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->values);
  EXPECT_TRUE(change->servers);
  ASSERT_TRUE(scene.complete());
  ASSERT_EQ(scene.servers().size(), 2u);
  EXPECT_EQ(scene.servers()[1].begin, 12);
  EXPECT_EQ(scene.servers()[1].end, 24);
  EXPECT_EQ(scene.facts().at("scene"), "hill.nrrd");
  EXPECT_EQ(scene.values().at("volume.part"), 0);
  // Weights count only from servers that hold the slices.
  EXPECT_FALSE(scene.weighed());
  EXPECT_FALSE(scene.weigh(weights_of(session(0, 2), 9, {1}))) << "nobody known";
  EXPECT_FALSE(scene.weigh(weights_of(session(0, 2), 2, {1}))) << "others' slices";
  auto lie = weights_of(session(0, 2), 1, {1});
  lie.voxels.push_back(1);
  EXPECT_FALSE(scene.weigh(lie));
  EXPECT_TRUE(*scene.weigh(weights_of(session(0, 2), 1, {3})));
  EXPECT_FALSE(*scene.weigh(weights_of(session(0, 2), 1, {2}))) << "of an older epoch";
  EXPECT_TRUE(*scene.weigh(weights_of(session(1, 2), 2, {1}, 50)));
  EXPECT_TRUE(scene.weighed());
  EXPECT_EQ(scene.weights()[11], 100u);
  EXPECT_EQ(scene.weights()[12], 50u);
  EXPECT_EQ(scene.bytes(scene.servers()[1], 12, 14), 300u);
  EXPECT_EQ(scene.bytes_per_voxel(), 3);
}

TEST(VolumeScene, RefusesPartsThatDoNotFit) {
  VolumeScene scene;
  ASSERT_TRUE(scene.adopt(data_hello(session(0, 2), "d1", 1)));
  auto other = session(1, 2);
  other.grid.size[0] = 17;
  EXPECT_FALSE(scene.adopt(data_hello(other, "d2", 2))) << "another grid";
  other = session(1, 2);
  other.levels.count = 100;
  EXPECT_FALSE(scene.adopt(data_hello(other, "d2", 2)));
  EXPECT_FALSE(scene.adopt(data_hello(session(1, 3), "d2", 2))) << "another number of parts";
  EXPECT_FALSE(scene.adopt(data_hello(session(0, 2), "d2", 2))) << "this part is held";
  auto bad = data_hello(session(1, 2), "d2", 2);
  bad.endpoints.clear();
  EXPECT_FALSE(scene.adopt(bad));
  bad = data_hello(session(1, 2), "d2", 2);
  bad.parameters.clear();
  EXPECT_FALSE(scene.adopt(bad));
  EXPECT_FALSE(scene.complete());
  EXPECT_TRUE(scene.adopt(data_hello(session(1, 2), "d2", 2)));
  EXPECT_TRUE(scene.complete());
}

TEST(VolumeScene, AServerThatReturnsKeepsWhatWasSet) {
  VolumeScene scene;
  ASSERT_TRUE(scene.adopt(data_hello(session(), "d", 1)));
  ASSERT_TRUE(scene.set_transfer("0:#000000:0, 100:#ff0000:0.25"));
  scene.leave({1});
  EXPECT_FALSE(scene.servers()[0].here);
  EXPECT_TRUE(scene.complete()) << "the scene stays while its server is away";
  auto change = scene.adopt(data_hello(session(), "d", 2));
  ASSERT_TRUE(change);
  EXPECT_FALSE(change->values);
  EXPECT_FALSE(change->another);
  EXPECT_TRUE(change->servers);
  EXPECT_EQ(scene.session().transfer.points.size(), 2u);
  EXPECT_EQ(scene.session().transfer.points[1].opacity, 0.25f);
  // A later server with other values is believed.
  scene.leave({2});
  auto other = session();
  other.transfer.points[1].opacity = 0.75f;
  change = scene.adopt(data_hello(other, "d", 3));
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->values);
  EXPECT_FALSE(change->another);
  EXPECT_EQ(scene.session().transfer.points[1].opacity, 0.75f);
  scene.leave({3});
  auto file = data_hello(other, "d", 4);
  file.facts["content_hash"] = "def";
  change = scene.adopt(file);
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->another) << "the file is another";
  scene.leave({4});
  other.grid.size = {4, 4, 4};
  change = scene.adopt(data_hello(other, "d", 5));
  ASSERT_TRUE(change);
  EXPECT_TRUE(change->another);
  EXPECT_EQ(scene.weights().size(), 4u);
}

TEST(VolumeScene, TransferFunctionsAndStepsAreSet) {
  VolumeScene scene;
  ASSERT_TRUE(scene.adopt(data_hello(session(0, 1, 5), "d", 1)));
  const auto before = scene.facts().at("transfer");
  for (const auto& p : volume::transfer_presets()) {
    EXPECT_TRUE(scene.set_transfer(std::string(p.name))) << p.name;
    EXPECT_NE(scene.facts().at("transfer"), before);
  }
  const auto last = scene.facts().at("transfer");
  EXPECT_FALSE(scene.set_transfer("no such preset"));
  EXPECT_FALSE(scene.set_transfer(""));
  EXPECT_EQ(scene.facts().at("transfer"), last);
  EXPECT_TRUE(scene.set({{"volume.step", "4"}}));
  EXPECT_EQ(scene.values().at("volume.step"), 4);
  for (const auto& [name, value] : {std::pair{"volume.step", "5"},
                                    {"volume.step", "-1"},
                                    {"volume.step", "1.5"},
                                    {"volume.step", "x"},
                                    {"volume.size.x", "3"},
                                    {"c.x", "1"},
                                    {"volume.steps-per-s", "-1"}})
    EXPECT_FALSE(scene.set({{name, value}})) << name << " " << value;
  EXPECT_FALSE(scene.set({}));
  EXPECT_FALSE(scene.set({{"volume.step", "2"}, {"c.x", "1"}}));
  EXPECT_EQ(scene.session().step, 4) << "all or nothing";
}

TEST(VolumeScene, PlaysByTheClock) {
  VolumeScene scene;
  auto s = session(0, 1, 5);
  s.steps_per_s = 10;
  s.step = 3;
  ASSERT_TRUE(scene.adopt(data_hello(s, "d", 1)));
  EXPECT_TRUE(scene.playing());
  EXPECT_FALSE(scene.step(100)) << "the clock begins with the first view";
  EXPECT_EQ(scene.session().step, 3);
  EXPECT_TRUE(scene.step(100.11));
  EXPECT_EQ(scene.session().step, 4);
  EXPECT_FALSE(scene.step(100.15));
  EXPECT_TRUE(scene.step(100.41));
  EXPECT_EQ(scene.session().step, 2) << "round, leaving steps out where views are slow";
  EXPECT_TRUE(scene.animate("off"));
  EXPECT_FALSE(scene.step(200));
  EXPECT_TRUE(scene.animate("on"));
  EXPECT_FALSE(scene.step(300));
  EXPECT_TRUE(scene.step(300.11));
  EXPECT_EQ(scene.session().step, 3);
  EXPECT_TRUE(scene.set({{"volume.step", "0"}}));
  EXPECT_FALSE(scene.playing());
  EXPECT_FALSE(scene.step(400));
  EXPECT_TRUE(scene.set({{"volume.steps-per-s", "1"}}));
  EXPECT_TRUE(scene.playing());
  EXPECT_FALSE(scene.animate("c.x=0:1:2s"));
}

// ---- assignment sheets ----------------------------------------------------------------------------------------------

TEST(Assignment, CoversEverySlabAndItsNeighboursOnceWithoutConflicts) {
  VolumeScene scene;
  const int parts = 3;
  for (int p = 0; p < parts; ++p) {
    ASSERT_TRUE(scene.adopt(data_hello(session(p, parts), "d" + std::to_string(p), 1 + uint64_t(p))));
    ASSERT_TRUE(*scene.weigh(weights_of(session(p, parts), 1 + uint64_t(p), {1}, 20'000'000)));
  }
  SlabPartitions partitions;
  partitions.set_slices(24);
  for (const char* name : {"a", "b", "c", "d"}) partitions.join(name);
  const auto partition = partitions.update(0);
  const auto sheet = assignment(*partition, scene);
  EXPECT_GT(sheet.size(), 12u) << "60 MB a slice are cut";
  std::map<size_t, std::vector<int>> covered;
  std::set<std::pair<uint64_t, size_t>> sends, receives;
  for (const auto& t : sheet) {
    EXPECT_TRUE(sends.insert({t.round, t.server}).second);
    EXPECT_TRUE(receives.insert({t.round, t.slab}).second);
    EXPECT_GE(t.begin, scene.servers()[t.server].begin);
    EXPECT_LE(t.end, scene.servers()[t.server].end);
    auto& c = covered[t.slab];
    c.resize(24);
    for (int k = t.begin; k < t.end; ++k) ++c[size_t(k)];
  }
  for (size_t s = 0; s < partition->slabs.size(); ++s)
    for (int k = 0; k < 24; ++k) {
      const auto range = partition->slabs[s].range;
      EXPECT_EQ(covered[s][size_t(k)], k >= range.begin - 1 && k <= range.end) << "slab " << s << ", slice " << k;
    }
  EXPECT_TRUE(
      std::is_sorted(sheet.begin(), sheet.end(), [](const auto& a, const auto& b) { return a.round < b.round; }));
}

// ---- the master -----------------------------------------------------------------------------------------------------

class VolumeMaster : public ::testing::Test {
 protected:
  template <class M>
  std::vector<M> sent(const std::string& peer) {
    for (auto& out : core->take_outgoing()) outbox.push_back(std::move(out));
    std::vector<M> messages;
    std::erase_if(outbox, [&](const Outgoing& o) {
      if (o.peer != peer || o.type != M::kName) return false;
      auto decoded = wire::decode<M>(std::as_bytes(std::span(o.body)));
      EXPECT_TRUE(decoded) << o.type << ": " << (decoded ? "" : decoded.error().text);
      if (decoded) messages.push_back(*decoded);
      return true;
    });
    return messages;
  }
  void begin(const std::string& folder = "") {
    record = std::move(metrics::RunRecord::open(folder)).value();
    core = std::make_unique<MasterCore>(
        MasterOptions{.schedule = {.frames_in_flight = 2, .lease_timeout_s = 2}, .settings = {.layers = 8}},
        InstanceId{42}, *record);
  }
  void hello(const std::string& role, uint64_t instance) {
    wire::Hello h;
    h.role = role;
    h.name = role + std::to_string(instance);
    h.instance = {instance};
    if (role == "sampler") h.facts["leases"] = "1";
    if (role == "packer") h.endpoints = {{"tiles", "t"}, {"state", "s"}};
    core->on(role + std::to_string(instance), h, now);
  }
  void join_data(const volume::Session& s) {
    const auto name = "data" + std::to_string(s.part);
    core->on(name, data_hello(s, name, 100 + uint64_t(s.part)), now);
    weigh(s);
  }
  void weigh(const volume::Session& s, EpochId epoch = {1}) {
    EXPECT_TRUE(core->on("data" + std::to_string(s.part), weights_of(s, 100 + uint64_t(s.part), epoch), now));
  }
  // Samplers 1 and 2, each with one lease at a time.
  void join_all(const volume::Session& s = session()) {
    hello("packer", 10);
    hello("sampler", 1);
    hello("sampler", 2);
    hello("viewer", 20);
    join_data(s);
  }
  void ready(uint64_t sampler) {
    const auto name = "sampler" + std::to_string(sampler);
    for (const auto& a : sent<wire::SlabAssignment>(name)) {
      assigned[sampler] = a;
      core->on(name, wire::SlabReady{{sampler}, a.partition, {1}, 10, 30}, now);
    }
  }
  void ask(uint64_t sampler) { core->on("sampler" + std::to_string(sampler), wire::LeaseRequest{{sampler}}, now); }
  std::optional<wire::SliceLease> leased(uint64_t sampler) {
    const auto leases = sent<wire::SliceLease>("sampler" + std::to_string(sampler));
    EXPECT_LE(leases.size(), 1u);
    return leases.empty() ? std::nullopt : std::optional(leases.back());
  }
  void view(uint64_t id, uint64_t buffers = 0) { core->on("viewer20", request(20, id, buffers), now); }
  void finish(const wire::SliceLease& l, uint64_t sampler) {
    auto m = done(l);
    m.sampler = {sampler};
    core->on("packer10", m, now);
  }
  wire::ControlReply control(const std::string& command, std::map<std::string, std::string> arguments = {}) {
    core->on("ctl", wire::Control{command, std::move(arguments)}, now);
    const auto replies = sent<wire::ControlReply>("ctl");
    EXPECT_EQ(replies.size(), 1u);
    return replies.empty() ? wire::ControlReply{} : replies[0];
  }

  double now = 0;
  std::unique_ptr<metrics::RunRecord> record;
  std::unique_ptr<MasterCore> core;
  std::vector<Outgoing> outbox;
  std::map<uint64_t, wire::SlabAssignment> assigned;
};

TEST_F(VolumeMaster, LeadsAVolumeFromHelloToFrame) {
  begin();
  join_all();
  const auto welcome = sent<wire::Welcome>("viewer20").back();
  EXPECT_EQ(welcome.facts.at("kind"), "volume");
  EXPECT_EQ(welcome.facts.at("transfer"), volume::to_text(session().transfer));
  EXPECT_EQ(welcome.parameters.at("volume.step"), 0);
  EXPECT_EQ(welcome.settings.layers, 8u);
  EXPECT_FALSE(welcome.endpoints.contains("voxels")) << "sheets have them";
  EXPECT_EQ(welcome.box_room, session().grid.box_room());
  view(1);
  ask(1);
  ask(2);
  EXPECT_FALSE(leased(1)) << "nobody holds a slab";
  ready(1);
  EXPECT_FALSE(leased(1)) << "the other is not ready";
  ready(2);
  ASSERT_EQ(assigned[1].sheet.size(), 1u);
  EXPECT_EQ(assigned[1].sheet[0].endpoint, "tcp://data0");
  EXPECT_EQ(assigned[1].begin, 0u);
  EXPECT_EQ(assigned[1].end, 12u);
  EXPECT_EQ(assigned[1].sheet[0].end, 13u) << "a slice more";
  EXPECT_EQ(assigned[2].sheet[0].begin, 11u);
  EXPECT_NE(assigned[1].sheet[0].round, assigned[2].sheet[0].round);
  const auto a = leased(1), b = leased(2);
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->frame, b->frame);
  EXPECT_EQ(a->shear.layers.size(), 8u);
  finish(*a, 1);
  finish(*b, 2);
  ask(1);
  EXPECT_FALSE(leased(1)) << "no view waits";
  view(2);
  const auto c = leased(1);
  ASSERT_TRUE(c);
  EXPECT_EQ(c->views[0].request.value, 2u);
  const auto counters = core->counters();
  EXPECT_EQ(counters.at("frames_completed"), 1);
  EXPECT_EQ(counters.at("partitions"), 1);
  EXPECT_EQ(counters.at("bytes_per_voxel"), 3);
}

TEST_F(VolumeMaster, FramesAreBegunForSamplersThatAreIdle) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1);
  ask(1);
  ASSERT_TRUE(leased(1));
  view(2);
  EXPECT_FALSE(leased(1)) << "it has work";
  ask(2);
  EXPECT_TRUE(leased(2)) << "the other's slab of the same frame";
  ask(2);
  EXPECT_EQ(leased(2)->views[0].request.value, 2u) << "it is through: the next frame begins";
}

TEST_F(VolumeMaster, WaitsForAllPartsAndTellsThemOfANewEpoch) {
  begin();
  hello("packer", 10);
  hello("sampler", 1);
  hello("viewer", 20);
  view(1, 1);  // asked before the scene is known
  join_data(session(1, 2));
  EXPECT_TRUE(sent<wire::Welcome>("viewer20").back().facts.empty());
  join_data(session(0, 2));
  const auto welcome = sent<wire::Welcome>("data1").back();
  EXPECT_EQ(welcome.epoch.value, 2u) << "epoch 1 had no scene";
  EXPECT_EQ(welcome.facts.at("kind"), "volume");
  weigh(session(0, 2), {2});
  weigh(session(1, 2), {2});
  ready(1);
  EXPECT_EQ(assigned[1].sheet.size(), 2u);
  ask(1);
  const auto l = leased(1);
  ASSERT_TRUE(l);
  EXPECT_EQ(l->views[0].request.value, 1u);
  // Another volume is refused.
  auto other = session(0, 1);
  other.grid.size = {4, 4, 4};
  core->on("stranger", data_hello(other, "stranger", 999), now);
  EXPECT_EQ(sent<wire::Welcome>("viewer20").back().parameters.at("volume.size.x"), 16);
}

TEST_F(VolumeMaster, AnotherTransferFunctionIsAnotherEpoch) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1);
  ask(1);
  const auto old = leased(1);
  ASSERT_TRUE(old);
  auto reply = control("tf", {{"transfer", "0:#000000:0, 50%:#00ff00:0.5"}});
  EXPECT_TRUE(reply.ok) << reply.text;
  EXPECT_EQ(reply.text, "epoch 2");
  const auto welcome = sent<wire::Welcome>("packer10").back();
  EXPECT_EQ(welcome.epoch.value, 2u);
  EXPECT_NE(welcome.facts.at("transfer").find("#00ff00"), std::string::npos) << welcome.facts.at("transfer");
  finish(*old, 1);  // without effect
  ask(1);
  const auto l = leased(1);
  ASSERT_TRUE(l) << "the view waits again";
  EXPECT_EQ(l->epoch.value, 2u);
  EXPECT_EQ(l->views[0].request.value, 1u);
  EXPECT_TRUE(sent<wire::SlabAssignment>("sampler1").empty()) << "slabs stay";
  reply = control("tf", {{"transfer", "bone marrow"}});
  EXPECT_FALSE(reply.ok);
  EXPECT_FALSE(control("tf").ok);
  EXPECT_FALSE(control("set", {{"c.x", "1"}}).ok);
  EXPECT_TRUE(control("set", {{"volume.layers", "4"}}).ok);
  EXPECT_EQ(sent<wire::Welcome>("viewer20").back().settings.layers, 4u);
  ask(1);
  EXPECT_EQ(leased(1)->shear.layers.size(), 4u);
  EXPECT_FALSE(control("set", {{"volume.layers", "0"}}).ok);
  EXPECT_FALSE(control("animate", {{"timeline", "on"}}).ok) << "one step";
}

TEST_F(VolumeMaster, MeshesHaveNoTransferFunction) {
  begin();
  EXPECT_FALSE(control("tf", {{"transfer", "bone"}}).ok);
  wire::Hello h;
  h.role = h.name = "data";
  h.instance = {1};
  h.facts = {{"kind", "mesh"}};
  core->on("d", h, 0);
  EXPECT_NE(control("tf", {{"transfer", "bone"}}).text.find("mesh"), std::string::npos);
}

TEST_F(VolumeMaster, ASamplerThatJoinsDoesNotStopTheDisplay) {
  begin();
  join_all();
  ready(1);
  ready(2);
  hello("sampler", 3);
  const auto third = sent<wire::SlabAssignment>("sampler3");
  ASSERT_EQ(third.size(), 1u);
  EXPECT_EQ(third[0].partition, 2u);
  EXPECT_EQ(third[0].slabs, 3u);
  view(1);
  ask(3);
  EXPECT_FALSE(leased(3)) << "it is not part of the old partition";
  ask(1);
  const auto old = leased(1);
  ASSERT_TRUE(old);
  EXPECT_EQ(old->partition, 1u);
  ready(1);
  ready(2);
  core->on("sampler3", wire::SlabReady{{3}, 2, {1}, 1, 1}, now);
  view(2);
  EXPECT_FALSE(leased(3)) << "frames of the old one are finished first, with its slabs";
  ask(2);
  auto l = leased(2);
  ASSERT_TRUE(l);
  EXPECT_EQ(l->partition, 1u);
  EXPECT_EQ(l->frame, old->frame);
  finish(*old, 1);
  finish(*l, 2);
  const auto fresh = leased(3);
  ASSERT_TRUE(fresh);
  EXPECT_EQ(fresh->partition, 2u);
}

TEST_F(VolumeMaster, SpareSamplersAreToldSo) {
  begin();
  hello("packer", 10);
  for (uint64_t sampler = 1; sampler <= 30; ++sampler) hello("sampler", sampler);
  join_data(session());
  size_t spare = 0;
  for (uint64_t sampler = 1; sampler <= 30; ++sampler) {
    const auto a = sent<wire::SlabAssignment>("sampler" + std::to_string(sampler));
    ASSERT_EQ(a.size(), 1u);
    spare += a[0].begin == a[0].end;
    EXPECT_EQ(a[0].slabs, 24u);
  }
  EXPECT_EQ(spare, 6u) << "there are 24 slices";
}

TEST_F(VolumeMaster, ADeadSamplersSlabMoves) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1, 1);
  ask(1);
  ask(2);
  const auto a = leased(1), b = leased(2);
  ASSERT_TRUE(a && b);
  finish(*a, 1);
  core->undeliverable("sampler2");
  core->tick(now);
  ready(1);
  EXPECT_EQ(assigned[1].slabs, 1u);
  EXPECT_EQ(assigned[1].end, 24u);
  ask(1);
  const auto again = leased(1);
  ASSERT_TRUE(again);
  EXPECT_EQ(again->slabs, 1u);
  EXPECT_EQ(again->views[0].request.value, 1u);
  EXPECT_EQ(core->counters().at("leases_expired"), 1);
}

TEST_F(VolumeMaster, ASilentSamplersSlabMovesUntilItAsksAgain) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1);
  ask(1);
  ask(2);
  const auto a = leased(1);
  now = 0.05;
  finish(*a, 1);
  ASSERT_TRUE(leased(2));
  for (const char* sampler : {"sampler1", "sampler2"}) sent<wire::Welcome>(sampler);
  now = 0.5;
  core->tick(now);
  EXPECT_EQ(sent<wire::Welcome>("sampler2").size(), 1u) << "whether it is still there";
  EXPECT_TRUE(sent<wire::Welcome>("sampler1").empty());
  core->tick(0.6);
  EXPECT_TRUE(sent<wire::Welcome>("sampler2").empty()) << "not all the time";
  now = 2.1;
  core->tick(now);
  ready(1);
  EXPECT_EQ(assigned[1].slabs, 1u);
  ask(1);
  EXPECT_TRUE(leased(1)) << "alone";
  ask(2);
  ready(1);
  ready(2);
  EXPECT_EQ(assigned[2].slabs, 2u) << "it was slow, not dead";
}

// No message of the packer reaches the master.
TEST_F(VolumeMaster, SamplersThatAskAgainKeepTheirSlabsThoughThePackerIsSilent) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1);
  ask(1);
  ask(2);
  ASSERT_TRUE(leased(1));
  ASSERT_TRUE(leased(2));
  now = 0.1;
  ask(1);
  ask(2);
  now = 2.3;
  core->tick(now);
  core->tick(now);
  ready(1);
  ready(2);
  core->tick(now);
  EXPECT_EQ(assigned[1].slabs, 2u);
  EXPECT_TRUE(leased(1));
  EXPECT_TRUE(leased(2));
}

TEST_F(VolumeMaster, ASamplerThatNeverDeliversHasItsSlabMoreAndMoreSeldom) {
  begin();
  join_all();
  int delivered = 0, stood_still = 0;
  uint64_t views = 0;
  ask(1);
  for (; now < 130; now += 0.05) {
    ready(1);
    ready(2);
    view(++views);
    if (views % 20 == 1) ask(2);
    (void)sent<wire::SliceLease>("sampler2");
    core->tick(now);
    const auto lease = leased(1);
    if (lease) finish(*lease, 1), ask(1);
    ++(lease ? delivered : stood_still);
  }
  // Its leases of 2 s run out after rests of 0, 2, 4, ... 32 s; the next rest outlasts the test.
  EXPECT_NEAR(stood_still * 0.05, 7 * 2, 3);
  EXPECT_GT(delivered, 0);
}

TEST_F(VolumeMaster, RestartedPeersFindTheirPlace) {
  begin();
  join_all();
  ready(1);
  ready(2);
  view(1, 1);
  ask(1);
  ASSERT_TRUE(leased(1));
  // The packer: frames begin anew.
  core->undeliverable("packer10");
  hello("packer", 11);
  ask(1);
  EXPECT_EQ(leased(1)->views[0].request.value, 1u);
  // The data server: the session stays; samplers get the new address.
  ASSERT_TRUE(control("tf", {{"transfer", "0:#000000:0, 200:#0000ff:1"}}).ok);
  const auto epoch = sent<wire::Welcome>("viewer20").back().epoch;
  core->undeliverable("data0");
  auto again = data_hello(session(), "data0", 500);
  again.endpoints["voxels"] = "tcp://elsewhere";
  core->on("data0b", again, now);
  EXPECT_EQ(sent<wire::Welcome>("viewer20").back().epoch, epoch);
  EXPECT_NE(sent<wire::Welcome>("data0b").back().facts.at("transfer").find("#0000ff"), std::string::npos);
  const auto a = sent<wire::SlabAssignment>("sampler1");
  ASSERT_EQ(a.size(), 1u);
  EXPECT_EQ(a[0].sheet[0].endpoint, "tcp://elsewhere");
  // A restarted sampler with its old name has no slab.
  wire::Hello h;
  h.role = "sampler";
  h.name = "sampler2";
  h.instance = {77};
  core->on("sampler2b", h, now);
  EXPECT_EQ(sent<wire::SlabAssignment>("sampler2b").size(), 1u);
}

TEST_F(VolumeMaster, SeriesPlayFrameByFrame) {
  begin();
  auto s = session(0, 1, 4);
  s.steps_per_s = 10;
  join_all(s);
  hello("viewer", 21);
  ready(1);
  ready(2);
  view(1);
  core->on("viewer21", request(21, 1, 0, {0, 0.4, 3}), now);
  const auto frame = [&] {
    ask(1);
    ask(2);
    const auto a = leased(1), b = leased(2);
    EXPECT_TRUE(a && b);
    if (a && b) finish(*a, 1), finish(*b, 2);
    return a;
  };
  const auto first = frame(), second = frame();
  EXPECT_EQ(first->epoch.value, 1u);
  EXPECT_EQ(second->epoch.value, 1u) << "both viewers are served from it";
  EXPECT_NE(first->views[0].viewer, second->views[0].viewer);
  now = 0.25;
  view(2);
  EXPECT_EQ(frame()->epoch.value, 2u);
  EXPECT_EQ(sent<wire::Welcome>("data0").back().parameters.at("volume.step"), 2);
  EXPECT_TRUE(control("set", {{"volume.step", "1"}}).ok);
  now = 5;
  view(3);
  EXPECT_EQ(frame()->epoch.value, 3u);
  EXPECT_EQ(sent<wire::Welcome>("data0").back().parameters.at("volume.step"), 1) << "it does not play any more";
}

TEST_F(VolumeMaster, StatusTellsWhoHoldsWhat) {
  begin();
  join_all();
  ready(1);
  ready(2);
  const auto s = nlohmann::json::parse(control("status").text, nullptr, false);
  ASSERT_TRUE(s.contains("volume"));
  const auto& v = s["volume"];
  EXPECT_EQ(v["partition"]["slabs"].size(), 2u);
  EXPECT_EQ(v["partition"]["slabs"][1]["sampler"], "sampler2");
  EXPECT_EQ(v["partition"]["slabs"][1]["begin"], 12);
  EXPECT_EQ(v["partition"]["slabs"][1]["voxels"], 10);
  EXPECT_EQ(v["partition"]["in_use"], true);
  EXPECT_EQ(v["layers"], 8);
  EXPECT_EQ(v["data_servers"][0]["end"], 24);
  EXPECT_EQ(s["parameters"]["volume.size.x"], 16);
  EXPECT_EQ(s["animation"], "off");
}

TEST_F(VolumeMaster, RecordsEpochsAndSheets) {
  std::string pattern = (std::filesystem::temp_directory_path() / "telesplat-master-XXXXXX").string();
  const std::string folder = mkdtemp(pattern.data());
  begin(folder);
  join_all();
  control("tf", {{"transfer", "0:#000000:0, 100:#ff0000:1"}});
  core.reset();
  record.reset();
  const auto text = [&](const char* name) {
    std::ifstream in(folder + "/" + name);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  const auto epochs = text("epochs.csv");
  EXPECT_NE(epochs.find(",transfer\n"), std::string::npos) << epochs;
  EXPECT_NE(epochs.find("\"" + volume::to_text(session().transfer) + "\"\n"), std::string::npos) << epochs;
  EXPECT_EQ(std::count(epochs.begin(), epochs.end(), '\n'), 3);
  EXPECT_EQ(text("assignment.csv"),
            "partition,round,data_server,sampler,begin,end,bytes\n"
            "1,0,\"data0\",\"sampler1\",0,13,3900\n1,1,\"data0\",\"sampler2\",11,24,3900\n");
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace telesplat::master
