// A viewer that may ask for missed events applies all of them in order, however the network treats published ones.
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

// A packer that keeps every event, and a viewer that notes the events that it applied.
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
       [this](const wire::StateRequest& r) { asked.push_back(r.packer == packer ? r.after.value : 0); }}};

  void answer() {
    const uint64_t after = asked.front();
    asked.pop_front();
    sequencer.on_answer({packer, {after}});
    for (uint64_t s = after + 1; s <= newest; ++s) sequencer.on_replayed(event(packer, s));
    sequencer.on_mark(mark(packer, newest, true));
  }
  // Checks that every event was applied once and in order.
  void expect_complete() const {
    ASSERT_EQ(applied.size(), newest);
    for (uint64_t i = 0; i < newest; ++i) ASSERT_EQ(applied[i], i + 1);
  }
};

// The answer leaves out events 1 to 3, whose points were forgotten, and with them the event that forgot them.
TEST(EventSequencer, WhoHeardTheBeginningTakesNoAnswerThatBeginsThere) {
  Session s;
  s.sequencer.start();
  s.asked.clear();
  for (uint64_t n = 1; n <= 3; ++n) s.sequencer.on_published(event(kPacker, n));
  s.sequencer.on_answer({kPacker, {}});
  s.sequencer.on_replayed(event(kPacker, 5));
  s.sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_EQ(s.applied, (std::vector<uint64_t>{1, 2, 3}));
  EXPECT_TRUE(s.asked.empty()) << "nothing is known to be lacking";
  s.sequencer.on_mark(mark(kPacker, 6, false));
  ASSERT_EQ(s.asked, (std::deque<uint64_t>{3}));
  s.newest = 6;
  s.answer();
  s.expect_complete();
  EXPECT_TRUE(s.sequencer.synchronised());
}

TEST(EventSequencer, WhoHeardTheBeginningAndAllSinceNeedsNoAnswer) {
  Session s;
  s.sequencer.start();
  s.asked.clear();
  for (uint64_t n = 1; n <= 6; ++n) s.sequencer.on_published(event(kPacker, n));
  s.sequencer.on_answer({kPacker, {}});
  s.sequencer.on_replayed(event(kPacker, 5));
  s.sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_TRUE(s.sequencer.synchronised());
  EXPECT_EQ(s.applied.size(), 6u);
  EXPECT_EQ(s.replicas, 1);
  EXPECT_TRUE(s.asked.empty());
}

// An older answer is under way when a gap is asked for: it leaves out points that this replica must forget.
TEST(EventSequencer, AnAnswerIsTakenOnlyWhereItBegins) {
  std::vector<wire::StateRequest> asked;
  std::vector<uint64_t> applied;
  EventSequencer sequencer({[&](const ModelEvent& e) { applied.push_back(e.sequence().value); },
                            [&] { applied.clear(); }, [&](const wire::StateRequest& r) { asked.push_back(r); }});
  sequencer.start();
  sequencer.on_published(event(kPacker, 1));
  sequencer.on_published(event(kPacker, 2));
  sequencer.on_published(event(kPacker, 6));
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[1].after.value, 2u);
  EXPECT_FALSE(asked[1].anew) << "that the answer under way will not do is not known yet";
  sequencer.on_answer({kPacker, {}});
  ASSERT_EQ(asked.size(), 3u) << "now it is";
  EXPECT_EQ(asked[2].after.value, 2u);
  EXPECT_TRUE(asked[2].anew);
  sequencer.on_replayed(event(kPacker, 5));
  sequencer.on_mark(mark(kPacker, 6, true));
  EXPECT_TRUE(sequencer.waiting());
  EXPECT_EQ(applied, (std::vector<uint64_t>{1, 2}));
  EXPECT_EQ(asked.size(), 3u) << "the newer question will be answered";
  sequencer.on_answer({kPacker, {2}});
  sequencer.on_replayed(event(kPacker, 5));
  sequencer.retry();
  EXPECT_EQ(asked.back().after.value, 5u);
  EXPECT_FALSE(asked.back().anew) << "it goes on";
  sequencer.on_mark(mark(kPacker, 5, true));
  EXPECT_EQ(applied, (std::vector<uint64_t>{1, 2, 5, 6}));
  EXPECT_TRUE(sequencer.synchronised());
}

// The packer must not take it for the request that it is answering.
TEST(EventSequencer, WhoBeginsAnewSaysSo) {
  std::vector<wire::StateRequest> asked;
  std::vector<uint64_t> applied;
  EventSequencer sequencer({[&](const ModelEvent& e) { applied.push_back(e.sequence().value); },
                            [&] { applied.clear(); }, [&](const wire::StateRequest& r) { asked.push_back(r); }});
  sequencer.on_published(event(kPacker, 1));
  sequencer.start_anew();
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].packer, InstanceId{});
  EXPECT_EQ(asked[0].after.value, 0u);
  EXPECT_TRUE(asked[0].anew);
  EXPECT_TRUE(sequencer.waiting());
  sequencer.on_replayed(event(kPacker, 2));
  EXPECT_EQ(applied, (std::vector<uint64_t>{1})) << "of an answer that was thrown away";
  sequencer.on_answer({kPacker, {}});
  sequencer.on_replayed(event(kPacker, 1));
  sequencer.on_replayed(event(kPacker, 2));
  sequencer.on_mark(mark(kPacker, 2, true));
  EXPECT_EQ(applied, (std::vector<uint64_t>{1, 2}));
  EXPECT_TRUE(sequencer.synchronised());
}

// Its first question is answered late, when it follows a newer packer already.
TEST(EventSequencer, AnAnswerOfAPackerThatIsGoneChangesNothing) {
  Session s;
  s.sequencer.start();
  s.packer = kNextPacker;
  s.sequencer.on_published(event(kNextPacker, s.newest = 1));
  s.sequencer.on_answer({kPacker, {}});
  s.sequencer.on_replayed(event(kPacker, 1));
  s.sequencer.on_mark(mark(kPacker, 7, true));
  EXPECT_EQ(s.sequencer.packer(), kNextPacker);
  s.expect_complete();
  EXPECT_EQ(s.replicas, 1);
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
        s.asked.clear();  // requests to the old one stay unanswered ...
        s.sequencer.retry();
      }
      ++s.newest;
      if (!chance(20)) s.sequencer.on_published(event(s.packer, s.newest));  // one in five is lost
      if (chance(10)) s.sequencer.on_published(event(s.packer, 1 + random() % s.newest));
      if (chance(20)) s.sequencer.on_mark(mark(s.packer, s.newest, false));
      if (!s.asked.empty() && chance(50)) s.answer();
    }
    // The network works again: the next mark and its answers bring everything.
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
                              [&] { begun = true; }, [](const wire::StateRequest&) {}});
    sequencer.start();
    if (published)
      sequencer.on_published(event({0}, 1));
    else
      sequencer.on_answer({});
    sequencer.on_replayed(event({0}, 1));
    EXPECT_TRUE(begun);
  }
}

TEST(EventSequencer, AnAnswerMaySkipWhatWasForgottenSince) {
  Session s;
  s.sequencer.start();
  s.sequencer.on_answer({kPacker, {}});
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
