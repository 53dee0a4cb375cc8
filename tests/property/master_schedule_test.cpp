// Samplers may be slow, fast, join, die noticed or not, deliver late or twice: every frame is completed, and its tiles
// cover it exactly once.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "services/master/tiles/frame_schedule.h"

namespace telesplat::master {
namespace {

struct Case {
  uint64_t seed;
  bool rows, coarse;
  int samplers;
};

class Schedule : public ::testing::TestWithParam<Case> {
 protected:
  struct Work {
    wire::Lease lease;
    double done_s;
  };
  struct Sampler {
    std::string name;
    double row_s;            // time for one row
    double free_s = 0;       // when it has finished its leases
    double released_s = -1;  // dead: when the master notices; negative: never, its leases run out
    bool dead = false;
    std::vector<Work> works;
  };
  // Tiles of a frame that the packer has.
  struct Packed {
    wire::Lease any;
    std::map<uint64_t, wire::Lease> tiles;
    bool viewed = false;
  };

  double uniform(double a, double b) { return std::uniform_real_distribution(a, b)(random); }
  bool chance(double p) { return uniform(0, 1) < p; }

  void add_sampler() {
    samplers.push_back({fmt_name(next_sampler++), std::exp(uniform(std::log(1e-5), std::log(1e-2))), now});
  }
  static std::string fmt_name(int n) { return "s" + std::to_string(n); }

  std::optional<wire::Lease> next(const std::string& name) {
    do {
      if (auto l = schedule.lease(name, now, chance(0.5))) return l;
    } while (schedule.begin_view({1}));
    return std::nullopt;
  }

  void check(const wire::Lease& l) {
    const auto inside = [](const geometry::Rect& a, const geometry::Rect& b) {
      return a.width > 0 && a.height > 0 && a.x >= b.x && a.y >= b.y && a.x + a.width <= b.x + b.width &&
             a.y + a.height <= b.y + b.height;
    };
    ASSERT_TRUE(inside(l.rect, l.block_rect));
    ASSERT_TRUE(inside(l.block_rect, {0, 0, l.camera.width, l.camera.height}));
    ASSERT_LT(l.block, l.blocks_in_frame);
    ASSERT_LT(l.tile, wire::kMaxTiles);
    ASSERT_TRUE(lease_ids.insert(l.lease.value).second);
    const auto [known, fresh] = leased.try_emplace({l.frame.value, l.tile}, l);
    if (!fresh) {
      ASSERT_EQ(known->second.rect, l.rect) << "a tile that is leased anew is the same";
      ASSERT_EQ(known->second.block, l.block);
      ASSERT_FALSE(packed[l.frame.value].tiles.contains(l.tile)) << "leased after it was done";
    }
  }

  void ask(Sampler& s) {
    while (s.works.size() < 2) {
      const auto l = next(s.name);
      if (!l) return;
      check(*l);
      if (HasFatalFailure()) return;
      const double begin = std::max(now, s.free_s);
      s.free_s = begin + s.row_s * l->rect.height * (chance(0.02) ? 100 : 1);
      s.works.push_back({*l, s.free_s});
    }
  }

  // The packer takes the first copy of a tile and reports it.
  void deliver(const Sampler& s, const Work& w) {
    auto& p = packed[w.lease.frame.value];
    p.any = w.lease;
    const bool first = p.tiles.emplace(w.lease.tile, w.lease).second;
    if (!first) return;
    wire::TileDone m;
    m.frame = w.lease.frame;
    m.tile = w.lease.tile;
    m.lease = w.lease.lease;
    m.moments.encode_end_s = s.row_s * w.lease.rect.height;
    const bool counted = schedule.tile_done(m, s.name, now);
    if (!counted) {
      ASSERT_TRUE(w.lease.step != 1) << "only a coarse frame that was dropped has tiles nobody waits for";
    }
    for (int i = 0; i < 2; ++i) ASSERT_FALSE(schedule.tile_done(m, s.name, now)) << "counted twice";
  }

  void step() {
    now += uniform(0, 0.004);
    if (requests < kViews && (!schedule.view_waiting() || chance(0.1))) {
      wire::ViewRequest r;
      r.viewer = {1 + uint64_t(chance(0.5))};
      r.request = {++requests};
      r.camera.width = 1 + int(uniform(0, 300));
      r.camera.height = 1 + int(uniform(0, 300));
      schedule.request_view(r);
      newest[r.viewer.value] = r.request.value;
    }
    for (auto& s : samplers) {
      if (!s.dead) {
        if (chance(0.1)) schedule.heard_of(s.name);
        ask(s);
      }
      if (HasFatalFailure()) return;
      if (s.dead && s.released_s >= 0 && now >= s.released_s) {
        schedule.release_sampler(s.name);
        s.released_s = -1;
      }
      // Messages of a dead sampler still arrive, late.
      for (size_t i = 0; i < s.works.size();)
        if (s.works[i].done_s <= now) {
          deliver(s, s.works[i]);
          if (HasFatalFailure()) return;
          s.works.erase(s.works.begin() + std::ptrdiff_t(i));
        } else {
          ++i;
        }
      if (!s.dead && chance(0.002)) {
        s.dead = true;
        if (chance(0.5)) s.released_s = now + uniform(0, 0.1);
        if (chance(0.5))
          s.works.clear();
        else
          for (auto& w : s.works) w.done_s += uniform(0, 1);
      }
    }
    if (chance(0.01) || std::all_of(samplers.begin(), samplers.end(), [](const auto& s) { return s.dead; }))
      if (samplers.size() < 200) add_sampler();
    schedule.expire(now, [](const std::string&) {});
  }

  static constexpr uint64_t kViews = 40;
  std::mt19937_64 random{GetParam().seed};
  FrameSchedule schedule{{.tile_size = 64, .frames_in_flight = 2, .lease_timeout_s = 0.5}};
  double now = 0;
  int next_sampler = 0;
  uint64_t requests = 0;
  std::map<uint64_t, uint64_t> newest;  // request of each viewer
  std::vector<Sampler> samplers;
  std::set<uint64_t> lease_ids;
  std::map<std::pair<uint64_t, uint64_t>, wire::Lease> leased;
  std::map<uint64_t, Packed> packed;
};

TEST_P(Schedule, EveryFrameIsCoveredExactlyOnce) {
  schedule.set_cut({GetParam().rows, GetParam().coarse});
  for (int i = 0; i < GetParam().samplers; ++i) add_sampler();
  for (int i = 0; i < 200'000; ++i) {
    step();
    if (HasFatalFailure()) return;
    if (requests == kViews && !schedule.view_waiting() && !schedule.frames_in_flight()) break;
  }
  ASSERT_EQ(schedule.frames_in_flight(), 0u) << "not complete after " << now << " s";
  ASSERT_FALSE(schedule.view_waiting());
  uint64_t views = 0;
  std::map<uint64_t, uint64_t> answered;
  for (const auto& [id, p] : packed) {
    const int width = p.any.camera.width, height = p.any.camera.height;
    std::vector<uint8_t> pixels(size_t(width) * size_t(height), 0);
    std::map<uint64_t, int64_t> block_pixels;
    std::map<uint64_t, geometry::Rect> blocks;
    for (const auto& [tile, l] : p.tiles) {
      ASSERT_EQ(l.camera, p.any.camera);
      ASSERT_EQ(l.blocks_in_frame, p.any.blocks_in_frame);
      ASSERT_EQ(blocks.try_emplace(l.block, l.block_rect).first->second, l.block_rect);
      block_pixels[l.block] += int64_t(l.rect.width) * l.rect.height;
      for (int y = l.rect.y; y < l.rect.y + l.rect.height; ++y)
        for (int x = l.rect.x; x < l.rect.x + l.rect.width; ++x)
          ASSERT_EQ(pixels[size_t(y) * size_t(width) + size_t(x)]++, 0) << "sampled twice";
    }
    const bool covered = std::count(pixels.begin(), pixels.end(), 1) == int64_t(pixels.size());
    if (p.any.step != 1 && !covered) continue;  // its view was complete before
    ASSERT_TRUE(covered) << "frame " << id;
    ASSERT_EQ(blocks.size(), p.any.blocks_in_frame);
    int64_t sum = 0;
    for (const auto& [block, rect] : blocks) {
      ASSERT_EQ(block_pixels[block], int64_t(rect.width) * rect.height) << "the tiles of a block are all of it";
      sum += block_pixels[block];
    }
    ASSERT_EQ(sum, int64_t(pixels.size()));
    views += p.any.step == 1;
    if (p.any.step == 1) answered[p.any.viewer.value] = std::max(answered[p.any.viewer.value], p.any.request.value);
  }
  EXPECT_EQ(views, schedule.frames_completed());
  EXPECT_EQ(answered, newest) << "newer requests replace older ones, but each viewer's newest is answered";
}

std::vector<Case> cases() {
  std::vector<Case> out;
  for (uint64_t seed = 1; seed <= 40; ++seed)
    out.push_back({seed, seed % 4 != 0, seed % 3 != 0, 1 + int(seed * 7 % 23)});
  return out;
}
INSTANTIATE_TEST_SUITE_P(Seeds, Schedule, ::testing::ValuesIn(cases()),
                         [](const auto& info) { return std::to_string(info.param.seed); });

}  // namespace
}  // namespace telesplat::master
