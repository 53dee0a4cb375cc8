#include "tools/common/progress_line.h"

#include <gtest/gtest.h>

#include <cmath>

namespace telesplat::tools {
namespace {

TEST(TimeLeft, IsToldWhereItIsMoreThanFiveSeconds) {
  TimeLeft left;
  EXPECT_EQ(left.text("reading a.ply", 0, 100), "reading a.ply") << "stages that do not tell how far they are";
  EXPECT_EQ(left.text("reading a.ply", 0.1, 100.5), "reading a.ply 10 %") << "too early to tell";
  EXPECT_EQ(left.text("reading a.ply", 0.2, 104), "reading a.ply 20 %, 16 s left");
  EXPECT_EQ(left.text("reading a.ply", 0.8, 116), "reading a.ply 80 %") << "4 s are not worth telling";
  EXPECT_EQ(left.text("reading a.ply", 1, 120), "reading a.ply 100 %");
}

TEST(TimeLeft, EachStageIsJudgedByItself) {
  TimeLeft left;
  left.text("reading", 0, 0);
  EXPECT_EQ(left.text("reading", 0.5, 100), "reading 50 %, 2 min left");
  EXPECT_EQ(left.text("writing the store", 0.5, 100), "writing the store 50 %");
  EXPECT_EQ(left.text("writing the store", 0.6, 102), "writing the store 60 %, 8 s left");
  EXPECT_EQ(left.text("reading", 0, 200), "reading") << "it began again";
  EXPECT_EQ(left.text("reading", 0.1, 202), "reading 10 %, 18 s left");
}

TEST(TimeLeft, TakesWhatIsNoFraction) {
  TimeLeft left;
  EXPECT_EQ(left.text("a", std::nan(""), 0), "a");
  EXPECT_EQ(left.text("a", 7, 10), "a 100 %");
  EXPECT_EQ(left.text("a", -1, 20), "a");
}

TEST(TimeLeft, WritesTimesAsPeopleDo) {
  EXPECT_EQ(duration_text(12.4), "12 s");
  EXPECT_EQ(duration_text(200), "3 min");
  EXPECT_EQ(duration_text(7500), "2 h 5 min");
}

}  // namespace
}  // namespace telesplat::tools
