// The choice of `telesplat tune`: never worse than the defaults by more than runs differ.
#include "tools/telesplat/tune/choice.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace telesplat::launcher {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

Measured measured(const std::string& name, const std::vector<double>& latencies, double psnr_db = 30,
                  double age_ms = 200, double frame_ms = 16.7) {
  Measured out{name, {}};
  for (const double latency : latencies) out.runs.push_back({latency, age_ms, psnr_db, frame_ms, 20});
  return out;
}

TEST(TuneChoice, TakesWhatIsBetterByMoreThanRunsDiffer) {
  const auto c = choose({measured("defaults", {100, 102, 101}), measured("samplers 2", {80, 81, 82})});
  EXPECT_EQ(c.verdict, Verdict::kBetter);
  EXPECT_EQ(c.chosen, 1u);
  EXPECT_NE(c.sentence.find("samplers 2 is better than the defaults: latency is better by 20.0 %, in each of 3 rounds"),
            std::string::npos)
      << c.sentence;
}

TEST(TuneChoice, AMachineThatBecomesSlowerDoesSoForAll) {
  const auto c = choose({measured("defaults", {100, 150, 200}), measured("samplers 2", {95, 142, 190})});
  EXPECT_EQ(c.verdict, Verdict::kBetter);
  EXPECT_EQ(c.chosen, 1u);
}

TEST(TuneChoice, WhatDoesNotComeToItsEndIsNotTaken) {
  const auto slow = measured("defaults", {100, 100, 100});
  auto quick = measured("samplers 2", {90, 90, 91});
  EXPECT_EQ(choose({slow, quick}).chosen, 1u);
  quick.runs[1] = {kNone, kNone, kNone, kNone, kNone};
  const auto c = choose({slow, quick});
  EXPECT_EQ(c.chosen, 0u);
  EXPECT_EQ(c.reasons[1], "its run in round 2 did not come to its end");
  quick.runs = {quick.runs[1], quick.runs[1], quick.runs[1]};
  EXPECT_EQ(choose({slow, quick}).reasons[1], "no run of it came to its end");
  // A run of the defaults that failed compares with nothing.
  auto failed = slow;
  failed.runs[1] = {kNone, kNone, kNone, kNone, kNone};
  EXPECT_EQ(choose({failed, measured("samplers 2", {90, 90, 91})}).chosen, 1u);
}

TEST(TuneChoice, NothingIsBoughtWithPicturesThatNobodyCompared) {
  auto slow = measured("defaults", {100, 100}), quick = measured("samplers 2", {90, 90});
  slow.runs[0].psnr_db = kNone, quick.runs[1].psnr_db = kNone;
  const auto c = choose({slow, quick});
  EXPECT_EQ(c.chosen, 0u);
  EXPECT_EQ(c.reasons[1], "PSNR was measured in no round of both");
}

TEST(TuneChoice, AGainThatIsNotInEveryRoundIsNone) {
  const auto c = choose({measured("defaults", {100, 104, 108}), measured("samplers 2", {103, 101, 105})});
  EXPECT_EQ(c.verdict, Verdict::kDefaultsBest);
  EXPECT_EQ(c.chosen, 0u);
  EXPECT_NE(c.sentence.find("nothing gains in every round"), std::string::npos) << c.sentence;
}

TEST(TuneChoice, SaysWhenTheMachineWasTooNoisy) {
  const auto c = choose({measured("defaults", {100, 160, 130}), measured("samplers 2", {150, 120, 118})});
  EXPECT_EQ(c.verdict, Verdict::kTooNoisy);
  EXPECT_EQ(c.chosen, 0u);
}

TEST(TuneChoice, WhatIsWorseByMoreThanTheNoiseIsTold) {
  const auto c = choose({measured("defaults", {100, 120}), measured("samplers 2", {200, 210})});
  EXPECT_EQ(c.verdict, Verdict::kDefaultsBest);
}

TEST(TuneChoice, SaysWhenTheDefaultsWereBest) {
  const auto c = choose({measured("defaults", {100, 101}), measured("samplers 2", {120, 121})});
  EXPECT_EQ(c.verdict, Verdict::kDefaultsBest);
  EXPECT_EQ(c.sentence, "the defaults were best");
  EXPECT_NE(c.reasons[1].find("latency is worse by 19.9 %"), std::string::npos) << c.reasons[1];
}

TEST(TuneChoice, LessLatencyIsNotBoughtWithPictures) {
  const auto c = choose({measured("defaults", {100, 101}, 30), measured("coarse", {50, 51}, 28)});
  EXPECT_EQ(c.chosen, 0u);
  EXPECT_NE(c.reasons[1].find("PSNR is worse by 2.00 dB"), std::string::npos) << c.reasons[1];
  // Nor with age or frames.
  EXPECT_EQ(choose({measured("defaults", {100, 101}), measured("slow", {50, 51}, 30, 250)}).chosen, 0u);
  EXPECT_EQ(choose({measured("defaults", {100, 101}), measured("late", {50, 51}, 30, 200, 25)}).chosen, 0u);
}

TEST(TuneChoice, HoweverNoisyNothingWorseByMoreThanAFewPerCentIsTaken) {
  // Latencies differ by 40 %: a candidate 10 % worse in latency and 3 dB better is refused all the same.
  const auto c = choose({measured("defaults", {100, 140, 120}, 30), measured("fine", {112, 152, 132}, 33)});
  EXPECT_EQ(c.chosen, 0u);
  // 4 % worse is within both.
  EXPECT_EQ(choose({measured("defaults", {100, 140, 120}, 30), measured("fine", {104, 133, 130}, 33)}).chosen, 1u);
}

TEST(TuneChoice, BetterPicturesCountToo) {
  const auto c = choose(
      {measured("defaults", {100, 101}, 30), measured("fine", {100, 101}, 31), measured("finer", {100, 101}, 32)});
  EXPECT_EQ(c.verdict, Verdict::kBetter);
  EXPECT_EQ(c.chosen, 2u);
}

TEST(TuneChoice, WhatWasNotMeasuredJudgesNothing) {
  const auto c = choose({measured("defaults", {100, 101}, kNone, kNone, kNone),
                         measured("samplers 2", {50, 51}, kNone, kNone, kNone), measured("failed", {})});
  EXPECT_EQ(c.chosen, 1u);
  EXPECT_EQ(c.reasons[2], "no run of it came to its end");
  const auto alone = choose({measured("defaults", {100})});
  EXPECT_EQ(alone.verdict, Verdict::kDefaultsBest);
  EXPECT_NE(alone.sentence.find("nothing else was run"), std::string::npos) << alone.sentence;
}

TEST(TuneChoice, FiguresComeFromASummary) {
  const auto f = tune_figures({{"view_update_latency_ms.median", 90}, {"quality.psnr_db.median", 31}});
  EXPECT_EQ(f.latency_ms, 90);
  EXPECT_EQ(f.psnr_db, 31);
  EXPECT_TRUE(std::isnan(f.age_ms));
}

}  // namespace
}  // namespace telesplat::launcher
