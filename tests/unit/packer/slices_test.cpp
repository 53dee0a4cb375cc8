// Slabs become frames, frames go to viewers: to each in order, as its coupling asks, and within its buffers.
#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <set>

#include "common/volume/session.h"
#include "services/packer/slices/slice_packing.h"
#include "tests/support/keys/lease_key.h"
#include "tests/support/volume/slices.h"

namespace telesplat::packer {
namespace {

constexpr EpochId kEpoch{4};

volume::Grid grid() {
  volume::Grid g{{60, 50, 40}, glm::dmat4(1)};
  g.index_to_room = glm::scale(glm::translate(glm::dmat4(1), {-0.3, -0.25, -0.2}), glm::dvec3(0.01));
  return g;
}

geometry::Camera camera(double fov = 80, double x = 0) {
  return geometry::make_camera({{x, 0, 0.6}, {1, 0, 0, 0}}, fov, 400, 300);
}

wire::SliceView view(uint64_t viewer, uint64_t request, uint64_t buffers = 0, const geometry::Camera& c = camera()) {
  return {{viewer}, {request}, c, buffers};
}

// Slab n of `slabs` equal ones.
wire::SliceLease lease(uint64_t frame, uint64_t slab, uint64_t slabs, std::vector<wire::SliceView> views) {
  wire::SliceLease l{.lease = {frame * 100 + slab}, .frame = {frame}, .epoch = kEpoch, .partition = 1};
  l.slab = slab, l.slabs = slabs;
  l.begin = 40 * slab / slabs, l.end = 40 * (slab + 1) / slabs;
  std::vector<geometry::Camera> cameras;
  for (const auto& v : views) cameras.push_back(v.camera);
  l.shear = *volume::plan_frame(grid(), cameras);
  l.views = std::move(views);
  l.moments.leased_s = 10 + double(slab);
  return l;
}

// Every pixel of every layer, in a different colour for each slab.
SliceGatherer::Slab slab(const wire::SliceLease& l, uint64_t voxels = 100) {
  auto bytes = std::make_shared<std::vector<uint8_t>>();
  for (int layer = 0; layer < int(l.shear.layers.size()); ++layer) {
    volume::SliceImage image{layer, int(l.begin), int(l.end), {0, 0, l.shear.width, l.shear.height}, {}};
    image.pixels.assign(size_t(l.shear.width) * size_t(l.shear.height), 0xff000000u + uint32_t(l.slab));
    volume::encode_slice(image, *bytes);
  }
  wire::SliceImages m{.sampler = {l.slab + 1}, .lease = l, .voxels = voxels};
  m.data = std::as_bytes(std::span(*bytes));
  return {m, bytes};
}

wire::SliceAck ack(uint64_t viewer, uint64_t frame, uint64_t buffers = 2, bool in_order = false) {
  return {{viewer}, {frame}, buffers, in_order};
}

std::vector<volume::EncodedSlice> slices_of(const SliceGatherer::Outgoing& out) {
  const auto& f = out.frame;
  auto r = volume::parse_slices(*out.bytes, f.shear.width, f.shear.height, int(f.shear.layers.size()));
  EXPECT_TRUE(r.ok());
  return r.ok() ? *r : std::vector<volume::EncodedSlice>{};
}

SliceGatherer gatherer() {
  SliceGatherer g;
  g.set_scene(grid(), kEpoch);
  return g;
}

TEST(SliceGatherer, AFrameGoesOutWhenAllOfItsSlabsAreThere) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("peer", ack(7, 0), 0));
  for (const uint64_t n : {2, 0, 1}) {
    EXPECT_FALSE(g.take_outgoing(1));
    const auto added = g.add(slab(lease(1, n, 3, {view(7, 5)})), 1);
    ASSERT_TRUE(added.ok()) << added.error().text;
    EXPECT_TRUE(added->is_new);
    EXPECT_GT(added->blocks, 0u);
    EXPECT_EQ(added->frame_complete, n == 1);
  }
  const auto out = g.take_outgoing(1);
  ASSERT_TRUE(out);
  EXPECT_EQ(out->peer, "peer");
  EXPECT_EQ(out->frame.frame.value, 1u);
  EXPECT_EQ(out->frame.viewer.value, 7u);
  EXPECT_EQ(out->frame.request.value, 5u);
  EXPECT_EQ(out->frame.slabs, 3u);
  EXPECT_EQ(out->frame.voxels, 300u);
  EXPECT_EQ(out->frame.moments.leased_s, 11) << "of the slab that completed it";
  EXPECT_EQ(out->frame.shear, lease(1, 0, 3, {view(7, 5)}).shear);
  const auto slices = slices_of(*out);
  EXPECT_EQ(slices.size(), 3 * out->frame.shear.layers.size());
  EXPECT_FALSE(g.take_outgoing(1));
  EXPECT_EQ(g.open_frames(), 0u);
}

// A slab whose blocks have valid places, but one cannot be decoded.
SliceGatherer::Slab damaged(const SliceGatherer::Slab& whole) {
  const auto& shear = whole.images.lease.shear;
  for (size_t at = whole.images.data.size(); at-- > 0;) {
    auto bytes =
        std::make_shared<std::vector<uint8_t>>(*std::static_pointer_cast<const std::vector<uint8_t>>(whole.owner));
    (*bytes)[at] ^= 0xff;
    const auto slices = volume::parse_slices(*bytes, shear.width, shear.height, int(shear.layers.size()));
    if (!slices || std::all_of(slices->begin(), slices->end(), [&](const auto& slice) {
          return volume::decode_slice(slice, shear.width, shear.height).ok();
        }))
      continue;
    SliceGatherer::Slab out{whole.images, bytes};
    out.images.data = std::as_bytes(std::span(*bytes));
    return out;
  }
  ADD_FAILURE() << "every slab can be decoded";
  return whole;
}

TEST(SliceGatherer, WhatAViewerCannotDecodeIsRefusedAndSentToNoOther) {
  auto g = gatherer();
  for (const uint64_t viewer : {7, 8}) ASSERT_TRUE(g.acknowledged("peer " + std::to_string(viewer), ack(viewer, 0), 0));
  const auto views = {view(7, 5), view(8, 6)};
  ASSERT_TRUE(g.add(slab(lease(1, 0, 2, views)), 1));
  const auto added = g.add(damaged(slab(lease(1, 1, 2, views))), 1);
  ASSERT_TRUE(added.ok()) << added.error().text;
  const auto out = g.take_outgoing(1);
  ASSERT_TRUE(out);
  wire::SliceAck bad = ack(out->frame.viewer.value, 1);
  bad.damaged = true;
  ASSERT_TRUE(g.acknowledged(out->peer, bad, 1));
  const auto refused = g.take_refused();
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].frame, FrameId{1});
  EXPECT_EQ(refused[0].tile, 1u);
  EXPECT_EQ(refused[0].lease, LeaseId{101});
  EXPECT_EQ(refused[0].sampler, InstanceId{2});
  EXPECT_FALSE(refused[0].why.empty());
  EXPECT_FALSE(g.take_outgoing(1)) << "the other viewer's";
  ASSERT_TRUE(g.acknowledged("late", ack(9, 0), 1));
  EXPECT_FALSE(g.take_outgoing(1)) << "one that comes late";
  ASSERT_TRUE(g.add(slab(lease(2, 0, 1, views)), 2));
  EXPECT_TRUE(g.take_outgoing(2)) << "the next frame";
}

TEST(SliceGatherer, AFrameIsNotDamagedBecauseAViewerSaysSo) {
  auto g = gatherer();
  for (const uint64_t viewer : {7, 8}) ASSERT_TRUE(g.acknowledged("peer " + std::to_string(viewer), ack(viewer, 0), 0));
  ASSERT_TRUE(g.add(slab(lease(1, 0, 1, {view(7, 5), view(8, 6)})), 1));
  const auto out = g.take_outgoing(1);
  ASSERT_TRUE(out);
  wire::SliceAck bad = ack(out->frame.viewer.value, 1);
  bad.damaged = true;
  ASSERT_TRUE(g.acknowledged(out->peer, bad, 1));
  EXPECT_TRUE(g.take_refused().empty());
  EXPECT_TRUE(g.take_outgoing(1)) << "the other viewer's";
}

TEST(SliceGatherer, EachViewerGetsWhatItMaySee) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("wide", ack(1, 0), 0));
  ASSERT_TRUE(g.acknowledged("narrow", ack(2, 0), 0));
  ASSERT_TRUE(g.add(slab(lease(1, 0, 1, {view(1, 1), view(2, 9, 0, camera(15))})), 1).ok());
  size_t bytes[2] = {}, blocks[2] = {};
  for (int n = 0; n < 2; ++n) {
    const auto out = g.take_outgoing(1);
    ASSERT_TRUE(out);
    const size_t who = out->peer == "wide" ? 0 : 1;
    bytes[who] = out->frame.data.size();
    for (const auto& s : slices_of(*out)) blocks[who] += s.blocks.size();
    EXPECT_EQ(out->frame.request.value, who == 0 ? 1u : 9u);
  }
  EXPECT_GT(blocks[1], 0u);
  EXPECT_LT(blocks[1] * 2, blocks[0]);
  EXPECT_LT(bytes[1] * 2, bytes[0]);
}

TEST(SliceGatherer, AnEmptyFrameIsAFrame) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("peer", ack(7, 0), 0));
  auto s = slab(lease(1, 0, 1, {view(7, 5)}));
  s.images.data = {};
  ASSERT_TRUE(g.add(s, 1).ok());
  const auto out = g.take_outgoing(1);
  ASSERT_TRUE(out);
  EXPECT_TRUE(out->frame.data.empty());
}

TEST(SliceGatherer, DuplicatesAndOtherEpochsAreCounted) {
  auto g = gatherer();
  const std::vector views{view(7, 5)};
  ASSERT_TRUE(g.add(slab(lease(1, 0, 2, views)), 1).ok());
  auto again = g.add(slab(lease(1, 0, 2, views)), 1);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->is_new);
  ASSERT_TRUE(g.add(slab(lease(1, 1, 2, views)), 1)->frame_complete);
  again = g.add(slab(lease(1, 1, 2, views)), 1);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->is_new || again->frame_complete);
  EXPECT_EQ(g.statistics().slabs_duplicate, 2u);
  auto other = lease(2, 0, 1, views);
  other.epoch = {3};
  EXPECT_FALSE(g.add(slab(other), 1)->is_new);
  EXPECT_EQ(g.statistics().slabs_other_epoch, 1u);
  EXPECT_EQ(g.statistics().frames_complete, 1u);
}

TEST(SliceGatherer, ContradictionsAreRefusedWithAReason) {
  auto g = gatherer();
  const std::vector views{view(7, 5)};
  ASSERT_TRUE(g.add(slab(lease(1, 0, 2, views)), 1).ok());
  uint64_t refused = 0;
  const auto refuse = [&](const char* why, auto&& change) {
    auto s = slab(lease(1, 1, 2, views));
    change(s.images);
    const auto r = g.add(s, 1);
    ASSERT_FALSE(r.ok()) << why;
    EXPECT_NE(r.error().text.find(why), std::string::npos) << r.error().text;
    EXPECT_NE(r.error().text.find("frame"), std::string::npos);
    EXPECT_EQ(g.statistics().slabs_refused, ++refused);
  };
  using M = wire::SliceImages;
  refuse("slab 2 of 2", [](M& m) { m.lease.slab = 2; });
  refuse("limit 1024", [](M& m) { m.lease.slabs = 5000; });
  refuse("slices 20 to 41 of 40", [](M& m) { m.lease.end = 41; });
  refuse("slices 20 to 20", [](M& m) { m.lease.end = 20; });
  refuse("0 views", [](M& m) { m.lease.views.clear(); });
  refuse("another view", [](M& m) { m.lease.views[0].request = {6}; });
  refuse("another view", [](M& m) { m.lease.views.push_back(m.lease.views[0]); });
  refuse("another view", [](M& m) { m.lease.slabs = 3; });
  refuse("another view", [](M& m) { m.lease.partition = 2; });
  refuse("another view", [](M& m) { m.lease.shear.u0 += 1e-9; });
  refuse("has slices of slab 0", [](M& m) { m.lease.begin = 19; });
  refuse("raster", [](M& m) { m.lease.shear.width = 0; });
  refuse("an image of slices 20 to 40", [](M& m) { m.lease.begin = 21; });
  refuse("", [](M& m) { m.data = m.data.first(m.data.size() - 1); });
  // The gatherer took nothing of it.
  EXPECT_TRUE(g.add(slab(lease(1, 1, 2, views)), 1)->frame_complete);
}

TEST(SliceGatherer, UnfinishedFramesDoNotPileUp) {
  auto g = gatherer();
  for (uint64_t f = 1; f <= kMaxOpenVolumeFrames + 3; ++f)
    ASSERT_TRUE(g.add(slab(lease(f, 0, 2, {view(7, f)})), 1).ok());
  EXPECT_EQ(g.open_frames(), kMaxOpenVolumeFrames);
  EXPECT_EQ(g.statistics().frames_dropped, 3u);
  EXPECT_TRUE(g.add(slab(lease(4, 1, 2, {view(7, 4)})), 1)->frame_complete);
  EXPECT_FALSE(g.add(slab(lease(3, 1, 2, {view(7, 3)})), 1)->frame_complete) << "its first slab was dropped";
  g.set_scene(grid(), kEpoch.next());
  EXPECT_EQ(g.open_frames(), 0u);
}

TEST(SliceGatherer, ALateViewerGetsTheNewestFrameAtOnce) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("first", ack(1, 0), 0));
  for (uint64_t f = 1; f <= 3; ++f) ASSERT_TRUE(g.add(slab(lease(f, 0, 1, {view(1, f, 0, camera(20))})), 1).ok());
  ASSERT_TRUE(g.acknowledged("late", ack(2, 0), 2));
  std::vector<std::string> to;
  while (const auto out = g.take_outgoing(2)) {
    to.push_back(out->peer);
    EXPECT_EQ(out->frame.frame.value, 3u);
    if (out->peer != "late") continue;
    EXPECT_EQ(out->frame.viewer.value, 2u);
    EXPECT_EQ(out->frame.request.value, 0u) << "nothing that it asked for";
  }
  EXPECT_EQ(to.size(), 2u);
  // A viewer with buffers does not want other viewers' frames.
  ASSERT_TRUE(g.acknowledged("ordered", ack(3, 0, 3, true), 2));
  EXPECT_FALSE(g.take_outgoing(2));
  // No frame of the new epoch exists yet.
  g.set_scene(grid(), kEpoch.next());
  ASSERT_TRUE(g.acknowledged("later", ack(4, 0), 3));
  EXPECT_FALSE(g.take_outgoing(3));
}

TEST(SliceGatherer, OnASlowLinkANewerFrameTakesThePlaceOfOneThatWouldWait) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("far", ack(1, 0), 0));
  ASSERT_TRUE(g.acknowledged("ordered", ack(2, 0, 2, true), 0));
  const auto sent = [&](uint64_t frame, double now_s) {
    EXPECT_TRUE(g.add(slab(lease(frame, 0, 1, {view(1, frame), view(2, frame, 2)})), now_s).ok());
    std::set<uint64_t> to;
    while (const auto out = g.take_outgoing(now_s)) to.insert(out->frame.viewer.value);
    return to;
  };
  EXPECT_EQ(sent(1, 0), (std::set<uint64_t>{1, 2}));
  ASSERT_TRUE(g.acknowledged("far", ack(1, 1), 1));
  ASSERT_TRUE(g.acknowledged("ordered", ack(2, 1, 2, true), 1));
  EXPECT_EQ(sent(2, 1), (std::set<uint64_t>{1, 2}));
  EXPECT_EQ(sent(3, 1.3), std::set<uint64_t>{2}) << "in order each frame is wanted";
  EXPECT_EQ(sent(4, 1.6), std::set<uint64_t>{}) << "its buffers are full";
  const auto out = g.take_outgoing(1.85);
  ASSERT_TRUE(out) << "the link is nearly done";
  EXPECT_EQ(out->frame.frame.value, 4u);
  EXPECT_EQ(g.statistics().frames_skipped, 1u);
}

TEST(SliceGatherer, FramesWaitForAViewerThatIsYetToIntroduceItself) {
  auto g = gatherer();
  for (uint64_t f = 1; f <= 2; ++f) ASSERT_TRUE(g.add(slab(lease(f, 0, 1, {view(1, f, 3)})), 1).ok());
  EXPECT_FALSE(g.take_outgoing(1));
  ASSERT_TRUE(g.acknowledged("peer", ack(1, 0, 3, true), 2));
  EXPECT_EQ(g.take_outgoing(2)->frame.frame.value, 1u);
  EXPECT_EQ(g.take_outgoing(2)->frame.frame.value, 2u);
  EXPECT_FALSE(g.take_outgoing(2));
}

TEST(SliceGatherer, WhatWasUnderWayToABrokenConnectionComesAgain) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("peer", ack(1, 0, 2, true), 0));
  ASSERT_TRUE(g.acknowledged("newest", ack(2, 0, 2), 0));
  for (uint64_t f = 1; f <= 3; ++f) {
    ASSERT_TRUE(g.add(slab(lease(f, 0, 1, {view(1, f, 3), view(2, f)})), 1).ok());
    while (g.take_outgoing(1)) {
    }
  }
  ASSERT_TRUE(g.acknowledged("again", ack(1, 0, 2, true), 2));
  ASSERT_TRUE(g.acknowledged("anew", ack(2, 0, 2), 2));
  std::map<std::string, std::vector<uint64_t>> got;
  while (const auto out = g.take_outgoing(2)) got[out->peer].push_back(out->frame.frame.value);
  EXPECT_EQ(got["again"], (std::vector<uint64_t>{1, 2}));
  EXPECT_EQ(got["anew"], std::vector<uint64_t>{3});
  ASSERT_TRUE(g.acknowledged("again", ack(1, 1, 2, true), 2));
  EXPECT_EQ(g.take_outgoing(2)->frame.frame.value, 3u);
}

// If a link takes longer for a frame than the viewer's time of silence, copies would pile up.
TEST(SliceGatherer, ASignOfLifeOverTheSameConnectionSendsNothingAgain) {
  auto g = gatherer();
  const auto sent = [&](double now_s) {
    std::vector<uint64_t> frames;
    while (const auto out = g.take_outgoing(now_s)) frames.push_back(out->frame.frame.value);
    return frames;
  };
  ASSERT_TRUE(g.acknowledged("far", ack(1, 0), 0));
  ASSERT_TRUE(g.add(slab(lease(1, 0, 1, {view(1, 1)})), 0).ok());
  EXPECT_EQ(sent(0), std::vector<uint64_t>{1});
  for (double now_s = 2; now_s <= 10; now_s += 2) {
    ASSERT_TRUE(g.acknowledged("far", ack(1, 0), now_s));
    EXPECT_TRUE(sent(now_s).empty()) << "it is under way, " << now_s;
    g.expire(now_s);
    EXPECT_EQ(g.viewers(), 1u) << "it lives";
  }
  ASSERT_TRUE(g.acknowledged("far", ack(1, 0), 12));
  EXPECT_EQ(sent(12), std::vector<uint64_t>{1}) << "it seems lost";
  for (double now_s = 14; now_s <= 60; now_s += 2) {
    ASSERT_TRUE(g.acknowledged("far", ack(1, 0), now_s));
    EXPECT_TRUE(sent(now_s).empty()) << "once is enough, " << now_s;
  }
  ASSERT_TRUE(g.acknowledged("far", ack(1, 1), 61));
  ASSERT_TRUE(g.acknowledged("far", ack(1, 0), 63));
  EXPECT_TRUE(sent(63).empty()) << "it has the newest";
  ASSERT_TRUE(g.acknowledged("again", ack(1, 0), 64));
  EXPECT_EQ(sent(64), std::vector<uint64_t>{1}) << "what it had on another connection may be lost";
  // Frames in order may wait in the viewer's buffers for long.
  ASSERT_TRUE(g.acknowledged("ordered", ack(2, 0, 2, true), 0));
  ASSERT_TRUE(g.add(slab(lease(2, 0, 1, {view(2, 1, 2)})), 65).ok());
  EXPECT_EQ(sent(65), std::vector<uint64_t>{2});
  ASSERT_TRUE(g.acknowledged("ordered", ack(2, 0, 2, true), 165));
  EXPECT_TRUE(sent(165).empty());
}

TEST(SliceGatherer, ViewersThatDoNotAnswerAreForgottenAndMayComeBack) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("peer", ack(1, 0, 1), 0));
  ASSERT_TRUE(g.acknowledged("idle", ack(2, 0, 1), 0));
  ASSERT_TRUE(g.add(slab(lease(1, 0, 1, {view(1, 1)})), 50).ok());
  EXPECT_EQ(g.take_outgoing(50)->peer, "peer");
  EXPECT_FALSE(g.take_outgoing(50));
  g.expire(50 + kViewerPatience_s);
  EXPECT_EQ(g.viewers(), 2u) << "a viewer that was not sent anything owes nothing";
  g.expire(50.5 + kViewerPatience_s);
  EXPECT_EQ(g.viewers(), 1u);
  EXPECT_EQ(g.statistics().viewers_forgotten, 1u);
  ASSERT_TRUE(g.add(slab(lease(2, 0, 1, {view(1, 2)})), 70).ok());
  EXPECT_FALSE(g.take_outgoing(70));
  ASSERT_TRUE(g.acknowledged("back", ack(1, 1, 1), 71)) << "whatever it acknowledges, it is there";
  EXPECT_EQ(g.take_outgoing(71)->peer, "back");
  g.unreachable("back");
  EXPECT_EQ(g.viewers(), 1u);
  EXPECT_FALSE(g.acknowledged("bad", ack(3, 0, 0), 71));
  EXPECT_FALSE(g.acknowledged("bad", ack(3, 0, wire::kMaxBuffers + 1), 71));
}

TEST(SliceGatherer, AnotherMasterCountsAnew) {
  auto g = gatherer();
  ASSERT_TRUE(g.acknowledged("peer", ack(1, 0, 1), 0));
  ASSERT_TRUE(g.add(slab(lease(50, 0, 1, {view(1, 1)})), 1).ok());
  EXPECT_TRUE(g.take_outgoing(1));
  g.clear_frames();
  ASSERT_TRUE(g.add(slab(lease(1, 0, 1, {view(1, 2)})), 2)->frame_complete);
  const auto out = g.take_outgoing(2);
  ASSERT_TRUE(out) << "what was under way is not waited for";
  EXPECT_EQ(out->frame.frame.value, 1u);
}

// Random frames, late and lost slabs, slow viewers: each gets a complete frame at most once and in order; one that
// takes only the newest never gets an older one than there is; never more under way than it has buffers.
TEST(SliceGatherer, RandomFramesReachViewersInOrderAndWithinTheirBuffers) {
  uint64_t delivered = 0, skipped = 0;
  const auto nothing = std::make_shared<int>();  // images without content are images, too
  for (uint64_t seed = 0; seed < 30; ++seed) {
    std::mt19937_64 random(seed);
    auto g = gatherer();
    struct Viewer {
      uint64_t buffers;
      bool in_order;
      std::set<uint64_t> under_way;
      std::vector<uint64_t> got, due;
      uint64_t newest = 0;
    };
    std::map<uint64_t, Viewer> viewers;
    for (uint64_t v = 1; v <= 3; ++v) {
      viewers[v] = {1 + random() % 4, random() % 2 == 0, {}, {}, {}, 0};
      ASSERT_TRUE(g.acknowledged(std::to_string(v), ack(v, 0, viewers[v].buffers, viewers[v].in_order), 0));
    }
    std::vector<SliceGatherer::Slab> pending;
    std::map<uint64_t, std::set<uint64_t>> came;
    uint64_t next = 1;
    for (int step = 0; step < 150; ++step) {
      if (pending.size() < 6) {
        std::vector<wire::SliceView> views;
        for (const auto& [id, v] : viewers)
          if (views.empty() || random() % 2) views.push_back(view(id, next, v.in_order ? v.buffers : 0));
        const uint64_t slabs = 1 + random() % 3;
        for (uint64_t n = 0; n < slabs; ++n) {
          const SliceGatherer::Slab s{{.sampler = {1}, .lease = lease(next, n, slabs, views)}, nothing};
          if (random() % 20) pending.push_back(s);                                       // else lost
          if (random() % 8 == 0 && !pending.empty()) pending.push_back(pending.back());  // twice
        }
        ++next;
      }
      if (pending.empty()) continue;
      // Mostly the oldest slab is added first, sometimes any other one.
      const size_t which = random() % 6 ? 0 : random() % pending.size();
      const auto s = pending[which];
      pending.erase(pending.begin() + long(which));
      const auto added = g.add(s, step);
      ASSERT_TRUE(added.ok()) << added.error().text;
      if (added->frame_complete)
        for (const auto& v : s.images.lease.views) {
          auto& viewer = viewers[v.viewer.value];
          const uint64_t id = s.images.lease.frame.value;
          if (id > viewer.newest) viewer.due.push_back(id), viewer.newest = id;
        }
      while (const auto out = g.take_outgoing(step)) {
        auto& v = viewers.at(out->frame.viewer.value);
        const uint64_t id = out->frame.frame.value;
        EXPECT_TRUE(v.got.empty() || id > v.got.back()) << "in order, and only once";
        EXPECT_TRUE(v.in_order || id == v.newest) << "only the newest is worth sending";
        v.got.push_back(id);
        v.under_way.insert(id);
        EXPECT_LE(v.under_way.size(), v.buffers);
      }
      for (auto& [id, v] : viewers)
        if (!v.under_way.empty() && random() % 2 == 0) {
          const uint64_t frame = *v.under_way.begin();
          v.under_way.erase(frame);
          ASSERT_TRUE(g.acknowledged(std::to_string(id), ack(id, frame, v.buffers, v.in_order), step));
        }
    }
    // In the end every viewer gets the frames that are left.
    for (bool more = true; more;) {
      more = false;
      for (auto& [id, v] : viewers)
        for (const uint64_t frame : std::exchange(v.under_way, {}))
          ASSERT_TRUE(g.acknowledged(std::to_string(id), ack(id, frame, v.buffers, v.in_order), 200));
      while (const auto out = g.take_outgoing(200)) {
        auto& v = viewers.at(out->frame.viewer.value);
        v.got.push_back(out->frame.frame.value);
        v.under_way.insert(out->frame.frame.value);
        EXPECT_LE(v.under_way.size(), v.buffers);
        more = true;
      }
    }
    for (const auto& [id, v] : viewers) {
      delivered += v.got.size();
      skipped += v.due.size() - v.got.size();
      EXPECT_TRUE(std::includes(v.due.begin(), v.due.end(), v.got.begin(), v.got.end()));
      EXPECT_TRUE(v.due.empty() || v.got.back() == v.due.back());
      EXPECT_TRUE(!v.in_order || v.got == v.due) << "all of them";
    }
  }
  EXPECT_GT(delivered, 500u);
  EXPECT_GT(skipped, 20u);
}

class SlicePackingTest : public testing::Test {
 protected:
  wire::Welcome welcome(EpochId epoch, InstanceId master = {1}) {
    volume::Session s;
    s.grid = grid();
    s.transfer.points = {{0, 1, 1, 1, 0.5f}};
    wire::Welcome w;
    w.master = master;
    w.lease_key = test::lease_key();
    w.epoch = epoch;
    w.facts = volume::to_facts(s);
    w.facts["kind"] = "volume";
    w.parameters = volume::to_parameters(s);
    return w;
  }
  Status receive(SliceGatherer::Slab s, double now, InstanceId master = {1}) {
    test::seal_lease(s.images.lease, s.images.sampler, master);
    return packing.receive({"", "slice_images", s.images.data, s.owner}, s.images, now);
  }
  std::vector<wire::TileDone> told;
  std::vector<wire::TileRefused> refused;
  std::vector<std::pair<wire::SliceFrame, std::string>> sent;
  std::set<std::string> gone;
  std::deque<std::string> bodies;  // `sent` points into these
  metrics::SpanRecorder spans;
  SlicePacking packing{{.tell = [this](const wire::TileDone& m) { told.push_back(m); },
                        .refuse = [this](const wire::TileRefused& m) { refused.push_back(m); },
                        .to_viewer =
                            [this](std::string_view peer, std::string_view type, std::string body) {
                              if (gone.contains(std::string(peer))) return false;
                              EXPECT_EQ(type, wire::SliceFrame::kName);
                              const auto& kept = bodies.emplace_back(std::move(body));
                              sent.emplace_back(*wire::decode<wire::SliceFrame>(std::as_bytes(std::span(kept))), peer);
                              return true;
                            },
                        .master_now = [] { return 99.0; },
                        .to_master_s = [](double s) { return s + 50; }},
                       spans};
};

TEST_F(SlicePackingTest, TellsTheMasterOfEverySlab) {
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 0));
  ASSERT_TRUE(packing.acknowledged("peer", ack(7, 0), 0));
  for (const uint64_t n : {0, 1}) ASSERT_TRUE(receive(slab(lease(1, n, 2, {view(7, 5)})), 3));
  ASSERT_TRUE(receive(slab(lease(1, 1, 2, {view(7, 5)})), 4)) << "a duplicate is done, too";
  ASSERT_EQ(told.size(), 3u);
  ASSERT_EQ(sent.size(), 1u);
  EXPECT_NE(sent[0].first.packer.value, 0u);
  EXPECT_EQ(sent[0].first.moments.published_s, 99);
  const auto& first = told[0];
  EXPECT_EQ(first.tile, 0u);
  EXPECT_EQ(first.frame.value, 1u);
  EXPECT_EQ(first.lease.value, 100u);
  EXPECT_EQ(first.sampler.value, 1u);
  EXPECT_EQ(first.samples, 100u);
  EXPECT_GT(first.kept, 0u);
  EXPECT_EQ(first.kept % 4096, 0u);
  EXPECT_EQ(first.rect.width, lease(1, 0, 2, {view(7, 5)}).shear.width);
  EXPECT_EQ(first.moments.receive_s, 53);
  EXPECT_EQ(first.bytes_sent, 0u);
  EXPECT_EQ(first.moments.published_s, 0) << "published with the slab that completed the frame";
  EXPECT_EQ(told[1].moments.published_s, 99);
  EXPECT_EQ(told[1].bytes_sent, sent[0].first.data.size()) << "counted to the slab that completed the frame";
  EXPECT_EQ(told[2].bytes_sent, 0u);
}

TEST_F(SlicePackingTest, SlabsAheadOfTheirEpochWaitForIt) {
  EXPECT_FALSE(packing.follow(
      [] {
        wire::Welcome w;
        w.facts["kind"] = "mesh";
        return w;
      }(),
      0));
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 5)})), 1)) << "nothing is known yet";
  ASSERT_TRUE(packing.follow(welcome({kEpoch.value - 1}), 1.1));
  EXPECT_TRUE(told.empty());
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 1.2));
  EXPECT_EQ(told.size(), 1u);
  auto old = lease(2, 0, 1, {view(7, 6)});
  old.epoch = {kEpoch.value - 1};
  ASSERT_TRUE(receive(slab(old), 1.3));
  EXPECT_EQ(told.size(), 1u) << "the master dropped that frame itself";
  auto later = lease(3, 0, 1, {view(7, 7)});
  later.epoch = kEpoch.next();
  ASSERT_TRUE(receive(slab(later), 1.3));
  packing.tick(3);
  ASSERT_TRUE(packing.follow(welcome(kEpoch.next()), 3));
  EXPECT_EQ(told.size(), 1u) << "it waited too long";
  net::MasterLink::Values values;
  packing.add_status(values);
  EXPECT_EQ(values["slabs_other_epoch"], 2);
}

TEST_F(SlicePackingTest, OthersFramesAreTakenForOthersAfterAMastersRestart) {
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 0));
  ASSERT_TRUE(packing.acknowledged("peer", ack(7, 0, 1), 0));
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 5)})), 1));
  ASSERT_TRUE(packing.follow(welcome(kEpoch, {2}), 2));
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 6)})), 2, {2}));
  ASSERT_EQ(sent.size(), 2u);
  EXPECT_NE(sent[0].first.packer, sent[1].first.packer);
  // A viewer that is gone does not keep the others waiting.
  gone.insert("peer");
  ASSERT_TRUE(packing.acknowledged("other", ack(8, 0, 1), 2));
  ASSERT_TRUE(packing.acknowledged("peer", ack(7, 1, 1), 2));
  ASSERT_TRUE(receive(slab(lease(2, 0, 1, {view(7, 7), view(8, 1)})), 2, {2}));
  net::MasterLink::Values values;
  packing.add_status(values);
  EXPECT_EQ(values["volume_viewers"], 1);
  EXPECT_EQ(values["volume_frames_complete"], 3);
}

TEST_F(SlicePackingTest, SlabsOfAMasterThatIsGoneCompleteNothing) {
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 0));
  ASSERT_TRUE(packing.follow(welcome(kEpoch, {2}), 1));
  ASSERT_TRUE(packing.acknowledged("peer", ack(7, 0, 1), 1));
  ASSERT_TRUE(receive(slab(lease(50, 0, 1, {view(7, 5)})), 1, {1}));
  EXPECT_TRUE(told.empty());
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 6)})), 2, {2}));
  ASSERT_EQ(sent.size(), 1u) << "frame 50 of the earlier master keeps nobody from frame 1 of this one";
  EXPECT_EQ(sent[0].first.request.value, 6u);
}

TEST_F(SlicePackingTest, AFrameThatNobodyLeasedStarvesNoViewer) {
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 0));
  ASSERT_TRUE(packing.acknowledged("peer", ack(7, 0, 1), 0));
  auto made_up = slab(lease(uint64_t{1} << 50, 0, 1, {view(7, 5)}));
  made_up.images.lease.master = {1};
  EXPECT_FALSE(packing.receive({"", "slice_images", made_up.images.data, made_up.owner}, made_up.images, 1));
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 6)})), 2));
  EXPECT_EQ(sent.size(), 1u);
}

TEST_F(SlicePackingTest, ARefusedSlabIsToldTheMaster) {
  ASSERT_TRUE(packing.follow(welcome(kEpoch), 0));
  auto bad = slab(lease(1, 0, 2, {view(7, 5)}));
  const std::string rubbish = "no slices";
  bad.images.data = std::as_bytes(std::span(rubbish));
  EXPECT_FALSE(receive(bad, 1));
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_EQ(refused[0].lease.value, 100u);
  EXPECT_EQ(refused[0].sampler.value, 1u);
}

TEST_F(SlicePackingTest, BadSessionsArePackedByNobody) {
  auto bad = welcome(kEpoch);
  bad.parameters.erase("volume.size.x");
  EXPECT_TRUE(packing.follow(bad, 0));
  ASSERT_TRUE(receive(slab(lease(1, 0, 1, {view(7, 5)})), 0));
  EXPECT_TRUE(told.empty());
}

}  // namespace
}  // namespace telesplat::packer
