// Whatever the network does to published events, a viewer that may ask for what it missed applies all of them in order.
#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "client/viewer/points/event_sequencer.h"

namespace telesplat::viewer {
namespace {

constexpr InstanceId kPacker{77}, kNextPacker{78};

ModelEvent event(InstanceId packer, uint64_t sequence) {
  wire::Forget e;
  e.packer = packer;
  e.sequence = {sequence};
  return {e, nullptr};
}

wire::StateMark mark(InstanceId packer, uint64_t sequence, bool answer) {
  wire::StateMark m;
  m.packer = packer;
  m.sequence = {sequence};
  m.answer = answer;
  return m;
}

// A packer that keeps every event, and a viewer that writes down what it applied.
struct Session {
  InstanceId packer = kPacker;
  uint64_t newest = 0;
  std::deque<uint64_t> asked;  // "after" of each unanswered request
  std::vector<uint64_t> applied;
  int replicas = 0;
  EventSequencer sequencer{
      {[this](const ModelEvent& e) { applied.push_back(e.sequence().value); },
       [this] {
         ++replicas;
         applied.clear();
       },
       [this](InstanceId of, Sequence after) { asked.push_back(of == packer ? after.value : 0); }}};

  void answer() {
    const uint64_t after = asked.front();
    asked.pop_front();
    for (uint64_t s = after + 1; s <= newest; ++s) sequencer.on_replayed(event(packer, s));
    sequencer.on_mark(mark(packer, newest, true));
  }
  // All there is, once each and in order.
  void expect_complete() const {
    ASSERT_EQ(applied.size(), newest);
    for (uint64_t i = 0; i < newest; ++i) ASSERT_EQ(applied[i], i + 1);
  }
};

// The answer leaves out events 1 to 3, whose points were forgotten, and with them what forgot them.
TEST(EventSequencer, WhoHeardTheBeginningTakesNoAnswerThatBeginsThere) {
  Session s;
  s.sequencer.start();
  for (uint64_t n = 1; n <= 3; ++n) s.sequencer.on_published(event(kPacker, n));
  s.sequencer.on_replayed(event(kPacker, 5));
  EXPECT_EQ(s.applied, (std::vector<uint64_t>{1, 2, 3}));
  s.sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_TRUE(s.sequencer.waiting()) << "what was thrown away is asked for anew";
  s.sequencer.on_replayed(event(kPacker, 5));
  s.sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_EQ(s.applied, (std::vector<uint64_t>{5}));
  EXPECT_TRUE(s.sequencer.synchronised());
}

TEST(EventSequencer, WhoHeardTheBeginningAndAllSinceNeedsNoAnswer) {
  Session s;
  s.sequencer.start();
  for (uint64_t n = 1; n <= 6; ++n) s.sequencer.on_published(event(kPacker, n));
  s.sequencer.on_replayed(event(kPacker, 5));
  s.sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_TRUE(s.sequencer.synchronised());
  EXPECT_EQ(s.applied.size(), 6u);
  EXPECT_EQ(s.replicas, 1);
}

// The packer cannot take it for the request that it is answering.
TEST(EventSequencer, WhoBeginsAnewNamesAPackerThatNobodyIs) {
  std::vector<std::pair<InstanceId, uint64_t>> asked;
  EventSequencer sequencer(
      {[](const ModelEvent&) {}, [] {}, [&](InstanceId of, Sequence after) { asked.emplace_back(of, after.value); }});
  sequencer.on_published(event(kPacker, 1));
  sequencer.start_anew();
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_NE(asked[0].first, InstanceId{});
  EXPECT_NE(asked[0].first, kPacker);
  EXPECT_EQ(asked[0].second, 0u);
  EXPECT_TRUE(sequencer.waiting());
  sequencer.retry();
  EXPECT_EQ(asked.back(), std::pair(InstanceId{}, uint64_t{0})) << "what it asked for then may be under way";
}

TEST(EventSequencer, LostAndRepeatedEventsEndInTheSameOrderEverywhere) {
  for (uint32_t seed = 0; seed < 200; ++seed) {
    std::mt19937 random(seed);
    const auto chance = [&](int percent) { return int(random() % 100) < percent; };
    Session s;
    s.sequencer.start();
    for (int step = 0; step < 300; ++step) {
      if (chance(3)) {  // a restarted packer begins anew
        s.packer = s.packer == kPacker ? kNextPacker : InstanceId{s.packer.value + 1};
        s.newest = 0;
        s.asked.clear();  // what was asked of the old one stays unanswered ...
        s.sequencer.retry();
      }
      ++s.newest;
      if (!chance(20)) s.sequencer.on_published(event(s.packer, s.newest));  // one in five is lost
      if (chance(10)) s.sequencer.on_published(event(s.packer, 1 + random() % s.newest));
      if (chance(20)) s.sequencer.on_mark(mark(s.packer, s.newest, false));
      if (!s.asked.empty() && chance(50)) s.answer();
    }
    // The network is kind again: the next mark and its answers bring everything.
    s.sequencer.on_mark(mark(s.packer, s.newest, false));
    for (int i = 0; i < 10 && (s.sequencer.waiting() || !s.asked.empty()); ++i) {
      if (s.asked.empty()) s.sequencer.retry();
      s.answer();
    }
    EXPECT_TRUE(s.sequencer.synchronised()) << "seed " << seed;
    s.expect_complete();
    ASSERT_FALSE(HasFailure()) << "seed " << seed;
  }
}

TEST(EventSequencer, FollowsANewPackerFromItsFirstEventWithoutAsking) {
  Session s;
  for (uint64_t i = 1; i <= 3; ++i) s.sequencer.on_published(event(kPacker, s.newest = i));
  EXPECT_TRUE(s.asked.empty());
  s.packer = kNextPacker;
  s.sequencer.on_published(event(kNextPacker, s.newest = 1));
  EXPECT_TRUE(s.asked.empty());
  EXPECT_EQ(s.replicas, 2);
  s.expect_complete();
}

TEST(EventSequencer, CountsAGapOnceAndAsksFromWhereItStands) {
  Session s;
  s.sequencer.on_published(event(kPacker, 1));
  s.newest = 5;
  s.sequencer.on_published(event(kPacker, 4));
  s.sequencer.on_published(event(kPacker, 5));
  EXPECT_EQ(s.sequencer.gaps(), 1u);
  ASSERT_EQ(s.asked, (std::deque<uint64_t>{1}));
  EXPECT_EQ(s.applied.size(), 1u);
  s.answer();
  s.expect_complete();
}

TEST(EventSequencer, AMarkTellsOfLostLastEvents) {
  Session s;
  s.sequencer.on_published(event(kPacker, 1));
  s.newest = 3;
  s.sequencer.on_mark(mark(kPacker, 1, false));
  EXPECT_FALSE(s.sequencer.waiting());
  s.sequencer.on_mark(mark(kPacker, 3, false));
  EXPECT_TRUE(s.sequencer.waiting());
  s.answer();
  s.expect_complete();
}

TEST(EventSequencer, APackerWithTheIdZeroIsFollowedBeforeItsFirstEventIsApplied) {
  for (const bool published : {false, true}) {
    bool begun = false;
    EventSequencer sequencer({[&](const ModelEvent&) { EXPECT_TRUE(begun) << "there is no replica to apply it to"; },
                              [&] { begun = true; }, [](InstanceId, Sequence) {}});
    sequencer.start();
    if (published)
      sequencer.on_published(event({0}, 1));
    else
      sequencer.on_replayed(event({0}, 1));
    EXPECT_TRUE(begun);
  }
}

TEST(EventSequencer, AnAnswerMaySkipWhatWasForgottenSince) {
  Session s;
  s.sequencer.start();
  s.sequencer.on_replayed(event(kPacker, 4));
  s.sequencer.on_replayed(event(kPacker, 9));
  s.sequencer.on_mark(mark(kPacker, 10, true));
  EXPECT_EQ(s.applied, (std::vector<uint64_t>{4, 9}));
  EXPECT_EQ(s.sequencer.applied().value, 10u);
  s.sequencer.on_published(event(kPacker, 11));
  EXPECT_EQ(s.applied.back(), 11u);
  EXPECT_EQ(s.sequencer.gaps(), 0u);
}

}  // namespace
}  // namespace telesplat::viewer
