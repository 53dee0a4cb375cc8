// Samplers of a volume join, leave, die noticed or not, are slow, come back: every frame's slabs belong to one
// partition and cover the volume once, buffered requests are answered in order, and every viewer gets answers.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/volume/session.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

constexpr int kSlices = 40;

class VolumeSession : public ::testing::TestWithParam<uint64_t> {
 protected:
  struct Work {
    wire::SliceLease lease;
    double done_s;
  };
  struct Sampler {
    std::string peer, name;
    InstanceId instance;
    bool alive = true, deaf = false;  // deaf: it lives, but sends nothing for a while
    double free_s = 0, speaks_s = 0, heard_s = 0;
    int asked = 0;
    EpochId epoch;
    std::vector<Work> works;
    std::map<uint64_t, wire::SlabAssignment> slabs;
    std::map<uint64_t, double> ready_s;
  };
  struct Viewer {
    uint64_t buffers = 0;
    uint64_t asked = 0, answered = 0;
    std::vector<uint64_t> open;  // requests of a buffered viewer
  };
  struct Frame {
    wire::SliceLease first;
    std::map<uint64_t, std::pair<uint64_t, uint64_t>> slabs;
    std::set<uint64_t> done;
  };

  double uniform(double a, double b) { return std::uniform_real_distribution(a, b)(random); }
  bool chance(double p) { return uniform(0, 1) < p; }

  void hello(const std::string& peer, const std::string& role, const std::string& name, InstanceId instance) {
    wire::Hello h;
    h.role = role;
    h.name = name;
    h.instance = instance;
    if (role == "sampler") h.facts["leases"] = "2";
    if (role == "packer") h.endpoints = {{"tiles", "t"}};
    if (role == "data") {
      volume::Session s;
      s.grid.size = {8, 8, kSlices};
      s.transfer.points = {{}};
      h.parameters = volume::to_parameters(s);
      h.facts = volume::to_facts(s);
      h.facts["kind"] = "volume";
      h.endpoints = {{"voxels", "d"}};
    }
    core.on(peer, h, now);
    deliver();
  }
  void add_sampler(const std::string& name) {
    Sampler s;
    s.instance = {next_instance++};
    s.name = name;
    s.peer = "peer" + std::to_string(s.instance.value);
    samplers.push_back(s);
    hello(s.peer, "sampler", s.name, s.instance);
  }
  void weigh() {
    wire::SliceWeights w;
    w.data = {1};
    w.epoch = {epoch};
    for (int k = 0; k < kSlices; ++k) w.voxels.push_back(chance(0.2) ? 0 : uint32_t(uniform(0, 1000)));
    EXPECT_TRUE(core.on("data", w, now));
  }

  // Delivers all messages that the master sent since the last time.
  void deliver() {
    for (const auto& out : core.take_outgoing()) {
      const auto body = std::as_bytes(std::span(out.body));
      const auto s =
          std::find_if(samplers.begin(), samplers.end(), [&](const Sampler& x) { return x.peer == out.peer; });
      if (out.type == wire::Welcome::kName) {
        const auto w = *wire::decode<wire::Welcome>(body);
        epoch = w.epoch.value;
        if (s != samplers.end()) s->epoch = w.epoch;
      }
      if (s == samplers.end() || !s->alive) continue;
      if (out.type == wire::WhoAreYou::kName) lost_touch.push_back(out.peer);
      if (out.type == wire::SlabAssignment::kName) {
        const auto a = *wire::decode<wire::SlabAssignment>(body);
        s->slabs[a.partition] = a;
        if (a.begin < a.end) s->ready_s[a.partition] = now + uniform(0, 0.3);
      }
      if (out.type == wire::SliceLease::kName) take(*s, *wire::decode<wire::SliceLease>(body));
    }
  }

  void take(Sampler& s, const wire::SliceLease& l) {
    --s.asked;
    ASSERT_EQ(l.epoch, s.epoch) << "leased before it was announced";
    ASSERT_TRUE(s.slabs.contains(l.partition)) << "of a partition it was never told of";
    const auto& a = s.slabs[l.partition];
    ASSERT_EQ(l.begin, a.begin);
    ASSERT_EQ(l.end, a.end);
    ASSERT_EQ(l.slab, a.slab);
    ASSERT_EQ(l.slabs, a.slabs);
    ASSERT_LE(newest_partition[s.peer], l.partition)
        << "old slabs may be let go when a lease of a newer partition comes";
    newest_partition[s.peer] = l.partition;
    Frame& f = frames.try_emplace(l.frame.value, Frame{l, {}, {}}).first->second;
    ASSERT_EQ(f.first.partition, l.partition) << "a frame of two partitions";
    ASSERT_EQ(f.first.shear, l.shear);
    ASSERT_EQ(f.first.slabs, l.slabs);
    ASSERT_EQ(f.first.views.size(), l.views.size());
    ASSERT_TRUE(f.slabs.try_emplace(l.slab, l.begin, l.end).second) << "leased twice";
    s.free_s = std::max(now, s.free_s) + uniform(0.001, 0.04) * (chance(0.01) ? 200 : 1);
    s.works.push_back({l, s.free_s});
  }

  void complete(const Frame& f) {
    uint64_t next = 0;
    for (const auto& [slab, range] : f.slabs) {
      ASSERT_EQ(range.first, next);
      next = range.second;
    }
    ASSERT_EQ(next, uint64_t(kSlices)) << "the slabs of a frame are the whole volume";
    for (const auto& v : f.first.views) {
      Viewer& viewer = viewers[v.viewer.value];
      if (v.buffers > 0) {
        ASSERT_FALSE(viewer.open.empty());
        ASSERT_EQ(v.request.value, viewer.open.front()) << "out of order";
        viewer.open.erase(viewer.open.begin());
      }
      viewer.answered = std::max(viewer.answered, v.request.value);
    }
  }

  void request(uint64_t id) {
    Viewer& v = viewers[id];
    if (v.buffers > 0 && v.open.size() >= v.buffers) return;
    wire::ViewRequest r;
    r.viewer = {id};
    r.request = {++v.asked};
    r.buffers = v.buffers;
    // Some viewers stand together, some look elsewhere.
    r.camera = geometry::make_camera({.position_room = {4.0 + (id > 102 ? double(id) : 0), 4, chance(0.1) ? -90 : 90}},
                                     40, 16, 16);
    if (v.buffers > 0) v.open.push_back(v.asked);
    core.on("viewer" + std::to_string(id), r, now);
  }

  void work(Sampler& s) {
    if (!s.alive || s.speaks_s > now) return;
    if (now - s.heard_s > 0.5) core.on(s.peer, wire::StatusReport{s.instance, {}}, now), s.heard_s = now;
    for (auto it = s.ready_s.begin(); it != s.ready_s.end();) {
      if (it->second > now) {
        ++it;
        continue;
      }
      core.on(s.peer, wire::SlabReady{s.instance, it->first, s.epoch, 1, 1}, now);
      it = s.ready_s.erase(it);
    }
    while (!s.works.empty() && s.works.front().done_s <= now) {
      const auto l = s.works.front().lease;
      s.works.erase(s.works.begin());
      const uint64_t before = completed();
      wire::TileDone m;
      m.frame = l.frame;
      m.tile = l.slab;
      m.lease = l.lease;
      m.sampler = s.instance;
      core.on("packer", m, now);
      if (completed() > before) {
        complete(frames.at(l.frame.value));
        if (HasFatalFailure()) return;
      }
    }
    while (s.asked + int(s.works.size()) < 2) {
      ++s.asked;
      core.on(s.peer, wire::LeaseRequest{s.instance}, now);
    }
  }
  uint64_t completed() const { return uint64_t(core.counters().at("frames_completed")); }

  void step(bool faults) {
    now += uniform(0.001, 0.02);
    for (auto& [id, v] : viewers)
      if (asking && chance(0.3)) request(id);
    for (size_t i = 0; i < samplers.size(); ++i) {
      work(samplers[i]);
      deliver();
      if (HasFatalFailure()) return;
    }
    for (const auto& peer : std::exchange(lost_touch, {}))
      for (auto& s : samplers)
        if (s.peer == peer && s.alive) {
          s.asked = 0;
          hello(s.peer, "sampler", s.name, s.instance);
        }
    if (now - others_s > 0.5) {
      others_s = now;
      core.on("data", wire::StatusReport{{1}, {}}, now);
      core.on("packer", wire::StatusReport{{2}, {}}, now);
      for (auto& [id, v] : viewers) core.on("viewer" + std::to_string(id), wire::StatusReport{{id}, {}}, now);
    }
    if (faults) {
      if (chance(0.01) && samplers.size() < 60) add_sampler("s" + std::to_string(samplers.size()));
      if (chance(0.01)) {
        Sampler& s = samplers[size_t(uniform(0, double(samplers.size())))];
        const int what = int(uniform(0, 5));
        if (what == 0) s.speaks_s = now + uniform(0, 8);  // hangs
        if (what >= 1 && s.alive) {
          s.alive = false;
          if (what == 2) core.undeliverable(s.peer);
          if (what == 3) core.on(s.peer, wire::Goodbye{s.instance}, now);
          if (what == 4) add_sampler(std::string(s.name));  // started again under its name
        }
      }
      if (chance(0.005)) weigh();
      if (chance(0.003)) core.on("ctl", wire::Control{"epoch", {}}, now);
      if (chance(0.002)) hello("packer", "packer", "packer", {next_instance++});
    }
    core.tick(now);
    deliver();
  }

  std::mt19937_64 random{GetParam()};
  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{.schedule = {.frames_in_flight = 2, .lease_timeout_s = 0.5}}, {99}, *record};
  double now = 0, others_s = 0;
  uint64_t next_instance = 1000, epoch = 1;
  bool asking = true;
  std::vector<Sampler> samplers;
  std::map<uint64_t, Viewer> viewers;
  std::map<uint64_t, Frame> frames;
  std::map<std::string, uint64_t> newest_partition;
  std::vector<std::string> lost_touch;
};

TEST_P(VolumeSession, EveryoneIsServedInOrder) {
  hello("data", "data", "data", {1});
  hello("packer", "packer", "packer", {2});
  for (uint64_t id = 101; id <= 105; ++id) {
    hello("viewer" + std::to_string(id), "viewer", "v" + std::to_string(id), {id});
    viewers[id].buffers = std::array<uint64_t, 5>{0, 3, 1, 0, 8}[id - 101];
  }
  weigh();
  for (int i = 0; i < 3; ++i) add_sampler("s" + std::to_string(i));
  for (int i = 0; i < 3000; ++i) {
    step(true);
    if (HasFatalFailure()) return;
  }
  const uint64_t during = completed();
  EXPECT_GT(during, 10u) << "the display goes on";
  // The faults end; all open requests are answered.
  asking = false;
  add_sampler("last");
  for (auto& [id, v] : viewers)
    if (v.buffers == 0) request(id);
  const double end = now + 120;
  const auto served = [&] {
    return std::all_of(viewers.begin(), viewers.end(),
                       [](const auto& v) { return v.second.open.empty() && v.second.answered == v.second.asked; });
  };
  while (now < end && !served()) {
    step(false);
    if (HasFatalFailure()) return;
  }
  for (const auto& [id, v] : viewers) {
    EXPECT_EQ(v.open.size(), 0u) << "viewer " << id;
    EXPECT_EQ(v.answered, v.asked) << "viewer " << id;
    EXPECT_GT(v.answered, 0u);
  }
}

INSTANTIATE_TEST_SUITE_P(Seeds, VolumeSession, ::testing::Range<uint64_t>(1, 31));

}  // namespace
}  // namespace telesplat::master
