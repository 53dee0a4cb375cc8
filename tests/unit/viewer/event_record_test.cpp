// The record of point-model events: the replay gives back the events that a viewer applied, and a file of any content
// does no harm.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>

#include "client/viewer/points/model_cache.h"
#include "client/viewer/record/event_record.h"
#include "common/codec/depth_codec.h"
#include "common/wire/serial.h"
#include "tests/support/packer_scenes.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

constexpr Sequence kAll{std::numeric_limits<uint64_t>::max()};

ModelEvent as_received(const packer::Event& e) {
  switch (e.kind) {
    case packer::Event::Kind::kForget:
      return {wire::Forget{{5}, e.sequence, e.epoch, e.clusters, e.frames}, nullptr};
    case packer::Event::Kind::kEpoch:
      return {wire::EpochBegin{{5}, e.sequence, e.epoch}, nullptr};
    case packer::Event::Kind::kRefine:
      return {wire::Refine{{5}, e.sequence, e.epoch, e.refines, std::as_bytes(std::span(*e.blob))}, e.blob};
    case packer::Event::Kind::kPatch:
      break;
  }
  return {wire::Patch{{5},
                      e.sequence,
                      e.epoch,
                      e.frame,
                      e.viewer,
                      e.request,
                      e.tile,
                      e.tiles_in_frame,
                      e.step,
                      e.extra,
                      e.frame_complete,
                      e.left_out,
                      {e.samples, e.kept},
                      e.camera,
                      e.rect,
                      std::as_bytes(std::span(*e.blob)),
                      {e.missed, e.missed_rect},
                      {},
                      e.refinable},
          e.blob};
}

// A packer's events: three views, some clusters forgotten, a new epoch, another view.
std::vector<packer::Event> published(int width, int tile) {
  packer::Config config = test::packer_config();
  config.obsolete_after_s = 5;
  packer::PackerCore core(config, test::kEpoch);
  std::vector<packer::Event> out;
  const auto sample = [&](uint64_t frame, const glm::dvec3& eye, EpochId epoch) {
    const auto camera = test::scene_camera(eye, width, width * 3 / 4);
    for (auto& t : test::sampled_frame({frame}, camera, tile, epoch)) {
      const auto event = core.submit(std::move(t), double(frame));
      CHECK(event.ok() && event->has_value());
      if ((*event)->is_told()) out.push_back(**event);
    }
  };
  sample(1, {0, 0.3, 0.8}, test::kEpoch);
  core.allow_errors({1.0 / 8, 1, 2});
  sample(2, {0.5, 0.3, 0.6}, test::kEpoch);
  const auto refined = core.refine(0);
  CHECK(refined.has_value());
  out.push_back(*refined);
  std::vector<points::ClusterKey> drawn;
  for (const auto& [key, cluster] : core.model().clusters())
    if (key % 3) drawn.push_back(key);
  core.accessed(drawn, 6);
  for (const auto& e : core.tick(8)) out.push_back(e);
  sample(3, {-0.5, 0.4, 0.6}, test::kEpoch);
  out.push_back(*core.begin_epoch({test::kEpoch.value + 1}));
  sample(4, {0.1, 0.4, 0.7}, {test::kEpoch.value + 1});
  return out;
}

// Finer rays of a view, all of them cast.
packer::SampledTile finer_rays() {
  packer::SampledTile tile;
  tile.frame = {9}, tile.epoch = test::kEpoch, tile.tiles_in_frame = 1, tile.extra = true;
  tile.camera = test::scene_camera({0, 0.3, 0.8}, 160, 120);
  tile.rect = {0, 0, 160, 120};
  tile.image = test::sample_scene(tile.camera, tile.rect);
  tile.missed.reset(160, 120);
  for (size_t i = 0; i < tile.image.depth.size(); ++i)
    if (tile.image.depth[i] == 0) tile.missed.set(int(i % 160), int(i / 160));
  return tile;
}

// Digests of a replica after each event.
std::vector<uint64_t> digests(const std::vector<packer::Event>& events) {
  test::Replica replica(test::scene_config());
  std::vector<uint64_t> out;
  for (const auto& e : events) {
    replica.apply(e);
    out.push_back(replica.model().digest());
  }
  return out;
}

class EventRecord : public testing::Test {
 protected:
  const std::string path_ =
      (fs::temp_directory_path() / (std::string("telesplat-events-") + std::to_string(getpid()) +
                                    testing::UnitTest::GetInstance()->current_test_info()->name()))
          .string();
  ~EventRecord() override { fs::remove(path_); }

  void record(const std::vector<packer::Event>& events, uint64_t max_bytes = 1u << 30) {
    auto recorder = EventRecorder::open(path_, max_bytes);
    ASSERT_TRUE(recorder.ok()) << recorder.error().text;
    (*recorder)->begin_replica(test::scene_config());
    for (const auto& e : events) (*recorder)->add(as_received(e));
  }
  std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& content) const { std::ofstream(path_, std::ios::binary | std::ios::trunc) << content; }
  static std::string part(std::string_view type, std::string_view body) {
    const auto type_bytes = uint32_t(type.size());
    const auto body_bytes = uint64_t(body.size());
    std::string out(12, '\0');
    std::memcpy(out.data(), &type_bytes, 4);
    std::memcpy(out.data() + 4, &body_bytes, 8);
    return out.append(type).append(body);
  }
  static std::string replica(float lo, float hi, uint32_t depth) {
    const float box[6] = {lo, lo, lo, hi, hi, hi};
    std::string body(32, '\0');
    std::memcpy(body.data(), box, 24);
    std::memcpy(body.data() + 24, &depth, 4);
    return part("replica", body);
  }
  static std::string event(const packer::Event& e) {
    return std::visit([](const auto& m) { return part(std::decay_t<decltype(m)>::kName, wire::encode(m)); },
                      as_received(e).body);
  }
  static std::string summary(uint64_t number, uint32_t brick) {
    std::string body(16, '\0');
    std::memcpy(body.data(), &number, 8);
    std::memcpy(body.data() + 8, &brick, 4);
    return part("summary", body);
  }
  // Replays the whole file; returns the error or "".
  std::string error_of(const std::string& content) const {
    write(content);
    auto replay = EventReplay::open(path_, true);
    if (!replay) return replay.error().text;
    const Status s = (*replay)->advance(kAll);
    return s ? "" : s.error().text;
  }
};

TEST_F(EventRecord, FinerRaysComeBack) {
  packer::PackerCore core(test::packer_config(), test::kEpoch);
  packer::SampledTile plain = finer_rays();
  plain.missed = {};
  ASSERT_TRUE(core.submit(std::move(plain), 0).ok());
  const uint64_t bytes_before = core.log_bytes();
  packer::SampledTile tile = finer_rays();
  tile.frame = {10}, tile.camera.pose.position_room.x += 0.01;
  const geometry::Camera camera = tile.camera;
  const image::PixelMask missed = tile.missed;
  ASSERT_TRUE(core.submit(std::move(tile), 0).ok());
  const auto events = core.events_since({});
  ASSERT_EQ(events.size(), 2u);
  EXPECT_FALSE(events[1].missed.empty());
  EXPECT_GE(core.log_bytes() - bytes_before, 4 * events[1].missed.size());
  record(events);
  auto replay = EventReplay::open(path_);
  ASSERT_TRUE(replay.ok());
  std::vector<float> met_m;
  ASSERT_TRUE((*replay)->advance(events[0].sequence).ok());
  EXPECT_FALSE((*replay)->fine_rays().look_up(camera, test::kEpoch, met_m));
  ASSERT_TRUE((*replay)->advance(events[1].sequence).ok());
  ASSERT_TRUE((*replay)->fine_rays().look_up(camera, test::kEpoch, met_m));
  for (size_t i = 0; i < met_m.size(); ++i)
    ASSERT_EQ(std::isinf(met_m[i]), missed.at(int(i % 160), int(i / 160))) << "ray " << i;
  packer::Event wrong = events[1];
  wrong.missed.assign(3, 0xffffffff);
  EXPECT_NE(error_of(bytes().substr(0, 8) + replica(-1, 1, 5) + event(wrong)).find("mask"), std::string::npos);
}

TEST_F(EventRecord, EverySequenceGivesTheModelThatWasShown) {
  const auto events = published(160, 40);
  const auto expected = digests(events);
  ASSERT_GT(events.size(), 30u);
  record(events);
  auto replay = EventReplay::open(path_);
  ASSERT_TRUE(replay.ok()) << replay.error().text;
  EXPECT_EQ((*replay)->model(), nullptr);
  for (size_t i = 0; i < events.size(); ++i) {
    const Status s = (*replay)->advance(events[i].sequence);
    ASSERT_TRUE(s.ok()) << s.error().text;
    EXPECT_EQ((*replay)->applied(), events[i].sequence);
    ASSERT_EQ((*replay)->model()->digest(), expected[i]) << "after event " << i;
  }
  EXPECT_GT((*replay)->model()->points(), 100u);
  ASSERT_TRUE((*replay)->advance(kAll).ok());
  EXPECT_TRUE((*replay)->at_end());
  EXPECT_EQ((*replay)->applied(), events.back().sequence);
}

TEST_F(EventRecord, EventsAreSkippedToButNeverPassed) {
  const auto events = published(120, 60);
  const auto expected = digests(events);
  record(events);
  for (size_t to = 0; to < events.size(); ++to) {
    auto replay = EventReplay::open(path_);
    ASSERT_TRUE((*replay)->advance(events[to].sequence).ok());
    EXPECT_EQ((*replay)->applied(), events[to].sequence);
    EXPECT_EQ((*replay)->model()->digest(), expected[to]);
    ASSERT_TRUE((*replay)->advance(events[to / 2].sequence).ok());  // an event already applied: nothing changes
    EXPECT_EQ((*replay)->applied(), events[to].sequence);
  }
}

TEST_F(EventRecord, AnotherPackerBeginsAnotherReplica) {
  const auto events = published(80, 80);
  const auto expected = digests(events);
  {
    auto recorder = EventRecorder::open(path_, 1u << 30);
    for (int replica = 0; replica < 2; ++replica) {
      (*recorder)->begin_replica(test::scene_config());
      (*recorder)->begin_replica(test::scene_config());  // the replica before held nothing
      for (const auto& e : events) (*recorder)->add(as_received(e));
    }
    (*recorder)->flush();
  }
  auto replay = EventReplay::open(path_);
  ASSERT_TRUE((*replay)->advance(events[3].sequence).ok());
  ASSERT_TRUE((*replay)->next_replica().ok());
  EXPECT_EQ((*replay)->applied().value, 0u);
  EXPECT_EQ((*replay)->model()->points(), 0u);
  for (size_t i = 0; i < events.size(); ++i) {
    ASSERT_TRUE((*replay)->advance(events[i].sequence).ok());
    ASSERT_EQ((*replay)->model()->digest(), expected[i]);
  }
  const Status none = (*replay)->next_replica();
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find(path_), std::string::npos);

  // Straight to the second replica, before any event was applied.
  auto second = EventReplay::open(path_);
  ASSERT_TRUE((*second)->next_replica().ok());
  ASSERT_TRUE((*second)->advance(events[0].sequence).ok());
  EXPECT_EQ((*second)->model()->digest(), expected[0]);
  EXPECT_FALSE((*second)->next_replica().ok());
}

TEST_F(EventRecord, TheLimitLeavesOutTheRest) {
  const auto events = published(160, 40);
  const auto expected = digests(events);
  record(events);
  const uint64_t whole = fs::file_size(path_);
  record(events, whole / 2);
  EXPECT_LE(fs::file_size(path_), whole / 2 + 8);
  auto replay = EventReplay::open(path_);
  ASSERT_TRUE((*replay)->advance(kAll).ok());
  EXPECT_TRUE((*replay)->at_end());
  const auto last = (*replay)->applied();
  const auto at = std::find_if(events.begin(), events.end(), [&](const auto& e) { return e.sequence == last; });
  ASSERT_NE(at, events.end());
  ASSERT_NE(at + 1, events.end());
  EXPECT_EQ((*replay)->model()->digest(), expected[size_t(at - events.begin())]);
}

TEST_F(EventRecord, CutAtEveryLengthItEndsBeforeTheCut) {
  const auto events = published(20, 20);
  const auto expected = digests(events);
  record(events);
  const std::string whole = bytes();
  std::vector<size_t> ends;  // end of each event
  size_t end = 8 + part("replica", std::string(32, '\0')).size();
  for (const auto& e : events) ends.push_back(end += event(e).size());
  ASSERT_EQ(ends.back(), whole.size());
  for (size_t length = whole.size(); length-- > 0;) {
    fs::resize_file(path_, length);
    auto replay = EventReplay::open(path_);
    if (length < 8) {
      ASSERT_FALSE(replay.ok()) << length;
      EXPECT_NE(replay.error().text.find(path_), std::string::npos);
    } else {
      ASSERT_TRUE(replay.ok()) << length;
      ASSERT_TRUE((*replay)->advance(kAll).ok()) << length;
      EXPECT_TRUE((*replay)->at_end());
      const auto complete = size_t(std::upper_bound(ends.begin(), ends.end(), length) - ends.begin());
      ASSERT_EQ((*replay)->applied(), complete ? events[complete - 1].sequence : Sequence{}) << length;
      if (complete && length == ends[complete - 1]) {
        EXPECT_EQ((*replay)->model()->digest(), expected[complete - 1]) << length;
      }
    }
  }
}

// A replayed frame has the draw list that it had on display, though summaries were made between the frames.
TEST_F(EventRecord, SummariesAreMadeAgainAtTheirPlace) {
  const auto events = published(120, 60);
  ASSERT_GT(events.size(), 8u);
  ModelCache cache;
  cache.begin_replica(test::scene_config());
  struct Shown {
    EventReplay::Moment moment;
    size_t items;
    uint64_t points;
  };
  std::vector<Shown> shown;
  const auto far = test::scene_camera({0.4, 0.5, 2.5}, 160, 120);
  splat::DrawList list;
  refinement::BoundedPatches bounded;
  {
    auto recorder = EventRecorder::open(path_, 1u << 30);
    (*recorder)->begin_replica(test::scene_config());
    for (const auto& e : events) {
      const ModelEvent event = as_received(e);
      if (e.kind == packer::Event::Kind::kEpoch) break;
      if (e.kind == packer::Event::Kind::kForget) {
        cache.forget(e.sequence, e.clusters, e.frames);
      } else if (e.kind == packer::Event::Kind::kRefine) {
        auto refinement = bounded.refine(test::scene_config(), e.sequence, e.refines, *e.blob);
        ASSERT_TRUE(refinement.ok() && refinement->has_value());
        cache.refine(**refinement);
      } else {
        if (e.refinable) bounded.add(e.sequence, e.camera, e.rect, *e.blob);
        auto tile = codec::decode(*e.blob);
        ASSERT_TRUE(tile.ok());
        cache.insert(points::prepare_patch(test::scene_config(), e.sequence, e.camera, e.rect, *tile, e.frame),
                     e.epoch);
      }
      (*recorder)->add(event);
      for (int frame = 0; frame < 2; ++frame) {
        cache.select(far, {}, list);
        cache.end_frame();
        shown.push_back({{list.applied, list.summaries}, list.items.size(), list.points});
        uint64_t number = cache.summaries_made();
        for (const auto brick : cache.summarise(3)) (*recorder)->add_summary(++number, brick);
      }
    }
  }
  ASSERT_GT(shown.back().moment.summaries, 10u);
  auto replay = EventReplay::open(path_, true);
  ASSERT_TRUE(replay.ok()) << replay.error().text;
  size_t with = 0;
  for (const Shown& s : shown) {
    const Status advanced = (*replay)->advance(s.moment);
    ASSERT_TRUE(advanced.ok()) << advanced.error().text;
    ASSERT_EQ((*replay)->applied(), s.moment.sequence);
    splat::select_view(*(*replay)->model(), far, {}, list, &(*replay)->summaries());
    ASSERT_EQ(list.items.size(), s.items) << "event " << s.moment.sequence.value << ", " << s.moment.summaries;
    ASSERT_EQ(list.points, s.points);
    with += !(*replay)->summaries().empty();
  }
  EXPECT_GT(with, shown.size() / 2);
}

TEST_F(EventRecord, ARecordOfAnEarlierVersionIsRead) {
  const auto events = published(40, 40);
  record(events);
  std::string content = bytes();
  content[7] = '2';
  EXPECT_EQ(error_of(content), "");
}

TEST_F(EventRecord, WhatIsNoRecordIsRefusedByName) {
  for (const std::string& content :
       {std::string(), std::string("TSEVENT"), std::string("TSEVENT1 and more"), std::string(1000, '\xff')}) {
    const std::string error = error_of(content);
    EXPECT_NE(error.find(path_), std::string::npos) << error;
  }
  const auto missing = EventReplay::open(path_ + ".none");
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().text.find(path_ + ".none"), std::string::npos);
  EXPECT_FALSE(EventReplay::open(fs::temp_directory_path().string()).ok());
  EXPECT_FALSE(EventRecorder::open("/proc/no/such/place", 1000).ok());
}

TEST_F(EventRecord, EventsThatCannotBeAreErrorsThatNameTheFile) {
  const auto events = published(40, 40);
  const std::string magic = "TSEVENT3", good = replica(-0.4f, 0.4f, 6);
  packer::Event outside = events[0];
  outside.rect.x += 7;
  packer::Event undecodable = events[0];
  undecodable.blob = std::make_shared<const std::vector<uint8_t>>(100, uint8_t(0x5a));
  packer::Event unfit = events[0];
  unfit.rect.width -= 8;
  const std::pair<std::string, std::string> cases[] = {
      {magic + event(events[0]), "replica"},
      {magic + good + event(events[1]) + event(events[0]), "does not follow"},
      {magic + good + event(events[0]) + event(events[0]), "does not follow"},
      {magic + good + part("nonsense", "body"), "no event"},
      {magic + good + part(wire::Patch::kName, "no map"), "patch"},
      {magic + good + part(wire::Forget::kName, ""), "forget"},
      {magic + good + event(outside), "not inside"},
      {magic + good + event(undecodable), "patch"},
      {magic + good + event(unfit), "patch"},
      {magic + part("summary", "short"), "5 bytes instead of 16"},
      {magic + summary(1, 0), "before any replica"},
      {magic + good + event(events[0]) + summary(1, 0xdeadbeef), "holds no points"},
      {magic + part("replica", "short"), "5 bytes instead of 32"},
      {magic + replica(0.4f, -0.4f, 6), "replica"},
      {magic + replica(std::numeric_limits<float>::quiet_NaN(), 1, 6), "replica"},
      {magic + replica(-1e30f, 1e30f, 6), "replica"},
      {magic + replica(-1, 1, 99), "replica"},
      {magic + replica(-1, 1, 0xffffffff), "replica"}};
  for (const auto& [content, reason] : cases) {
    const std::string error = error_of(content);
    EXPECT_NE(error.find(path_), std::string::npos) << reason << ": " << error;
    EXPECT_NE(error.find(reason), std::string::npos) << reason << ": " << error;
  }
}

TEST_F(EventRecord, ClaimedLengthsAllocateNothing) {
  for (const uint64_t claimed : {uint64_t(1) << 40, ~uint64_t(0), ~uint64_t(0) - 11}) {
    std::string content = "TSEVENT3" + replica(-1, 1, 6) + part("patch", "abc");
    std::memcpy(content.data() + content.size() - 16, &claimed, 8);
    EXPECT_EQ(error_of(content), "") << "it ends before that event";
  }
}

TEST_F(EventRecord, ASparseFileAllocatesNothing) {
  std::string content = "TSEVENT3" + replica(-1, 1, 6) + part("patch", "abc");
  const uint64_t claimed = uint64_t{1} << 40;
  std::memcpy(content.data() + content.size() - 16, &claimed, 8);
  std::ofstream(path_, std::ios::binary) << content;
  fs::resize_file(path_, uint64_t{1} << 41);  // a hole: the size claimed lies within the file
  auto replay = EventReplay::open(path_);
  ASSERT_TRUE(replay.ok());
  EXPECT_TRUE((*replay)->advance(Sequence{100}).ok());
  EXPECT_TRUE((*replay)->at_end()) << "it ends before that event";
}

TEST_F(EventRecord, DamagedBytesNeverEndTheProgram) {
  record(published(40, 40));
  const std::string whole = bytes();
  std::mt19937 random(7);
  int refused = 0;
  for (int round = 0; round < 200; ++round) {
    std::string content = whole;
    for (int n = 1 + round % 5; n > 0; --n) content[8 + random() % (content.size() - 8)] = char(random());
    const std::string error = error_of(content);
    refused += !error.empty();
    if (!error.empty()) {
      EXPECT_NE(error.find(path_), std::string::npos) << error;
    }
  }
  EXPECT_GT(refused, 20);
}

}  // namespace
}  // namespace telesplat::viewer
