#include "services/packer/points/link_meter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

namespace telesplat::packer {
namespace {

constexpr InstanceId kViewer{7};

// A link between meter and viewer with events of one size: carries bytes one after the other; receipts come back.
class SimulatedLink {
 public:
  SimulatedLink(double rate_bytes_s, double rtt_s) : rate_(rate_bytes_s), rtt_s_(rtt_s) {}

  void publish(uint64_t bytes, double now_s) {
    meter.published(Sequence{++sequence_}, bytes, now_s);
    free_s_ = std::max(free_s_, now_s) + double(bytes) / rate_;
    under_way_.push_back({sequence_, free_s_ + rtt_s_ / 2});
  }
  // The viewer sends a receipt every 30 ms.
  void run_until(double until_s) {
    for (; next_receipt_s_ <= until_s; next_receipt_s_ += 0.03) {
      while (!under_way_.empty() && under_way_.front().second <= next_receipt_s_) {
        newest_ = under_way_.front().first;
        under_way_.pop_front();
      }
      if (newest_ > 0) meter.received(kViewer, Sequence{newest_}, 5000 + next_receipt_s_, next_receipt_s_ + rtt_s_ / 2);
    }
  }
  LinkFigures figures(double now_s) { return meter.figures(kViewer, now_s).value_or(LinkFigures{}); }

  LinkMeter meter;

 private:
  double rate_, rtt_s_, free_s_ = 0, next_receipt_s_ = 0.03;
  uint64_t sequence_ = 0, newest_ = 0;
  std::deque<std::pair<uint64_t, double>> under_way_;
};

TEST(LinkMeter, MeasuresABusyLink) {
  SimulatedLink link(2.5e6, 0.04);
  for (int i = 0; i < 200; ++i) link.publish(10000, 1);  // 0.8 s
  link.run_until(1.5);
  EXPECT_NEAR(link.figures(1.5).rate_bytes_s, 2.5e6, 0.1e6);
  const double waits_s = 1.82 - 1.5;
  EXPECT_NEAR(double(link.figures(1.5).backlog_bytes), waits_s * 2.5e6, 0.04 * 2.5e6 + 0.03 * 2.5e6);
  EXPECT_LE(link.figures(1.5).oldest_s, 0.03) << "something came with each receipt";
  link.run_until(2);
  EXPECT_EQ(link.figures(2).backlog_bytes, 0u);
  EXPECT_EQ(link.figures(2).oldest_s, 0);
  EXPECT_GE(link.figures(2).rtt_s, 0.04);
  EXPECT_LE(link.figures(2).rtt_s, 0.04 + 0.03 + 0.01) << "at most a receipt late";
}

TEST(LinkMeter, TellsTheSlowestLinkAndWhetherAllAreFree) {
  SimulatedLink link(2.5e6, 0.04);
  EXPECT_EQ(link.meter.slowest_bytes_s(), 0) << "nothing is known";
  EXPECT_TRUE(link.meter.all_free(0.05, 1000, 0)) << "nobody waits";
  for (int i = 0; i < 200; ++i) link.publish(10000, 1);  // 0.8 s
  link.run_until(1.2);
  EXPECT_GT(link.figures(1.2).rate_bytes_s, 0);
  EXPECT_EQ(link.meter.slowest_bytes_s(), 0) << "it was not busy for long";
  link.run_until(1.5);
  EXPECT_FALSE(link.meter.all_free(0.05, 1000, 1.5));
  EXPECT_TRUE(link.meter.all_free(0.05, 2000000, 1.5)) << "so much may wait anyway";
  link.run_until(1.81);
  EXPECT_NEAR(link.meter.slowest_bytes_s(), 2.5e6, 0.1e6);
  EXPECT_TRUE(link.meter.all_free(0.1, 1000, 1.81)) << "it carries the rest in less";
}

TEST(LinkMeter, ALinkWithLittleToDoIsNotTakenForASlowOne) {
  SimulatedLink link(12.5e6, 0.02);
  for (int i = 0; i < 40; ++i) link.publish(50000, 1);
  link.run_until(1.3);
  const double fast = link.figures(1.3).rate_bytes_s;
  EXPECT_NEAR(fast, 12.5e6, 0.6e6);
  for (int i = 0; i < 100; ++i) {
    link.publish(2000, 2 + 0.1 * i);  // 20 KB/s
    link.run_until(2.05 + 0.1 * i);
  }
  EXPECT_NEAR(link.figures(12).rate_bytes_s, fast, 1);
}

TEST(LinkMeter, FollowsALinkThatBecomesSlower) {
  SimulatedLink fast(12.5e6, 0.02);
  for (int i = 0; i < 100; ++i) fast.publish(50000, 1);
  fast.run_until(1.6);
  LinkMeter& meter = fast.meter;
  // From here on by hand: 1 MB/s, 20 KB each 20 ms, and a receipt for each.
  for (int i = 0; i < 200; ++i) meter.published(Sequence{uint64_t(101 + i)}, 20000, 2);
  for (int i = 0; i < 200; ++i) meter.received(kViewer, Sequence{uint64_t(101 + i)}, 5002 + 0.02 * i, 2.2 + 0.02 * i);
  EXPECT_NEAR(meter.figures(kViewer, 6.3)->rate_bytes_s, 1e6, 0.1e6);
}

TEST(LinkMeter, AViewerThatDoesNotReadShowsByTheAgeOfWhatWaits) {
  LinkMeter meter;
  meter.published(Sequence{1}, 100, 1);
  meter.received(kViewer, Sequence{1}, 1, 1.02);
  for (int i = 2; i < 50; ++i) meter.published(Sequence{uint64_t(i)}, 1000, double(i));
  const auto f = meter.figures(kViewer, 60);
  ASSERT_TRUE(f);
  EXPECT_EQ(f->backlog_bytes, 48000u);
  EXPECT_NEAR(f->oldest_s, 58, 1e-9);
  meter.received(kViewer, Sequence{2}, 50, 60);
  EXPECT_EQ(meter.figures(kViewer, 61)->oldest_s, 1) << "slow, but it reads";
  meter.expire(71);
  EXPECT_EQ(meter.viewers(), 0u);
  EXPECT_FALSE(meter.figures(kViewer, 71));
}

// A viewer that joins late or had a gap: its receipts count all that was ever published; little was sent to it.
TEST(LinkMeter, LearnsNothingFromAReplay) {
  LinkMeter meter;
  for (uint64_t i = 1; i <= 100; ++i) meter.published(Sequence{i}, 1'000'000, double(i));
  for (uint64_t v = 100; v < 100 + 2 * LinkMeter::kMostViewers; ++v) meter.replayed({v});  // they send no receipt
  meter.replayed(kViewer);
  meter.received(kViewer, {}, 0, 100.00);
  meter.received(kViewer, Sequence{60}, 0.03, 100.03);
  meter.received(kViewer, Sequence{100}, 0.06, 100.06);
  EXPECT_EQ(meter.figures(kViewer, 101)->rate_bytes_s, 0) << "100 MB in 60 ms they were not";
  EXPECT_EQ(meter.figures(kViewer, 101)->rtt_s, 0);
  EXPECT_EQ(meter.figures(kViewer, 101)->backlog_bytes, 0u);
  for (uint64_t i = 101; i <= 120; ++i) meter.published(Sequence{i}, 100'000, 101);
  for (uint64_t i = 101; i <= 120; ++i) {
    const double after_s = 0.1 * double(i - 100);
    meter.received(kViewer, Sequence{i}, 1 + after_s, 101 + after_s);
  }
  EXPECT_NEAR(meter.figures(kViewer, 103.1)->rate_bytes_s, 1e6, 0.2e6);
}

TEST(LinkMeter, AViewerThatHasNothingYetWaitsForAll) {
  LinkMeter meter;
  for (uint64_t i = 1; i < 5; ++i) meter.published(Sequence{i}, 1000, 1);
  meter.received(kViewer, {}, 1, 1.1);
  ASSERT_TRUE(meter.figures(kViewer, 2));
  EXPECT_EQ(meter.figures(kViewer, 2)->backlog_bytes, 4000u);
  EXPECT_EQ(meter.figures(kViewer, 2)->rtt_s, 0);
}

// Without clear() a viewer would go on waiting for events of the old model.
TEST(LinkMeter, OfANewModelNothingIsUnderWay) {
  LinkMeter meter;
  for (uint64_t i = 1; i < 5; ++i) meter.published(Sequence{i}, 1000, 1);
  meter.received(kViewer, Sequence{2}, 1, 1.1);
  EXPECT_EQ(meter.figures(kViewer, 2)->backlog_bytes, 2000u);
  meter.clear();
  EXPECT_FALSE(meter.figures(kViewer, 2));
  meter.received(kViewer, {}, 2, 2.1);
  ASSERT_TRUE(meter.figures(kViewer, 3));
  EXPECT_EQ(meter.figures(kViewer, 3)->backlog_bytes, 0u);
}

TEST(LinkMeter, LatenessIsNotTakenForASlowLink) {
  LinkMeter meter;
  // Small events; the viewer looks at each 60 ms late.
  for (uint64_t i = 1; i < 200; ++i) {
    meter.published(Sequence{i}, 1000, 0.1 * double(i));
    meter.received(kViewer, Sequence{i - 1}, 0.1 * double(i) + 0.03, 0.1 * double(i) + 0.04);
    meter.received(kViewer, Sequence{i}, 0.1 * double(i) + 0.06, 0.1 * double(i) + 0.07);
  }
  EXPECT_EQ(meter.figures(kViewer, 20)->rate_bytes_s, 0);
}

TEST(LinkMeter, NonsenseTellsNothing) {
  LinkMeter meter;
  meter.received(kViewer, Sequence{3}, 1, 1);
  EXPECT_EQ(meter.viewers(), 0u) << "nothing was published";
  meter.published(Sequence{1}, 100, 1);
  meter.published(Sequence{2}, 100, 1);
  meter.received(kViewer, Sequence{2}, 1, 2);
  meter.received(kViewer, Sequence{1}, 9, 3);  // older than its last receipt
  meter.received(kViewer, Sequence{99}, 1.0 / 0.0, 4);
  EXPECT_EQ(meter.figures(kViewer, 5)->backlog_bytes, 0u);
  for (uint64_t v = 100; v < 100 + 2 * LinkMeter::kMostViewers; ++v) meter.received({v}, Sequence{2}, 1, 2);
  EXPECT_EQ(meter.viewers(), LinkMeter::kMostViewers);
}

}  // namespace
}  // namespace telesplat::packer
