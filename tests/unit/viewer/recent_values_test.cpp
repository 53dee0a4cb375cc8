// Values measured in the last seconds.
#include "client/viewer/record/recent_values.h"

#include <gtest/gtest.h>

namespace telesplat::viewer {
namespace {

TEST(RecentValues, TellOfTheirWindowAlone) {
  RecentValues values(5);
  EXPECT_EQ(values.figures(0).count, 0u);
  EXPECT_EQ(values.figures(0).median, 0);
  for (int i = 0; i <= 10; ++i) values.add(i, i);
  const auto f = values.figures(10);
  EXPECT_EQ(f.count, 6u) << "5 to 10";
  EXPECT_EQ(f.median, 7.5);
  EXPECT_EQ(f.p95, 9.75);
  EXPECT_EQ(values.figures(20).count, 0u);
}

TEST(RecentValues, AreNoMoreThanTheirLimit) {
  RecentValues values(1e9);
  for (size_t i = 0; i < 3 * RecentValues::kMost; ++i) values.add(double(i), double(i));
  const auto f = values.figures(1e4);
  EXPECT_EQ(f.count, RecentValues::kMost);
  EXPECT_GT(f.median, 2.0 * RecentValues::kMost) << "the newest";
}

}  // namespace
}  // namespace telesplat::viewer
