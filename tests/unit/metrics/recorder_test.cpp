// Distributions, and measurements of processes before they are sent.
#include "common/metrics/recorder.h"

#include <gtest/gtest.h>

#include <limits>

#include "common/metrics/statistics.h"

namespace telesplat::metrics {
namespace {

TEST(Distribution, PercentilesInterpolateBetweenRanks) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  const auto d = distribution(values);
  EXPECT_DOUBLE_EQ(d.mean, 50);
  EXPECT_DOUBLE_EQ(d.median, 50);
  EXPECT_DOUBLE_EQ(d.p95, 95);
  EXPECT_DOUBLE_EQ(d.p99, 99);
  EXPECT_DOUBLE_EQ(d.max, 100);
  EXPECT_DOUBLE_EQ(distribution({1, 2}).median, 1.5);
  EXPECT_DOUBLE_EQ(distribution({1, 2}).p95, 1.95);
  EXPECT_DOUBLE_EQ(distribution({7}).p99, 7);
  EXPECT_DOUBLE_EQ(distribution({}).max, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(distribution({nan, 3, infinity, -infinity}).mean, 3);
}

TEST(Recorders, GiveWhatCameSinceTheLastTime) {
  TableRecorder table("frames", {"a", "b"});
  EXPECT_FALSE(table.flush({1}));
  table.add({1, 2});
  table.add({3, 4});
  const auto rows = table.flush({9});
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->values, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(rows->columns, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(rows->instance.value, 9u);
  EXPECT_FALSE(table.flush({9}));
  SpanRecorder spans;
  spans.add("one", 1, 2);
  spans.add("two", 2, 3, 5, {.frame = 8, .tile = 0, .request = 4});
  spans.add("one", 3, 4);
  const auto s = spans.flush({9});
  ASSERT_TRUE(s);
  EXPECT_EQ(s->columns, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(s->values, (std::vector<double>{0, 1, 2, 0, -1, -1, -1, 1, 2, 3, 5, 8, 0, 4, 0, 3, 4, 0, -1, -1, -1}));
}

TEST(Recorders, AreBoundedWhileTheMasterIsAway) {
  TableRecorder table("frames", {"a"});
  for (int i = 0; i < (1 << 20) + 1000; ++i) table.add({double(i)});
  EXPECT_EQ(table.flush({1})->values.size(), size_t{1} << 20);
}

}  // namespace
}  // namespace telesplat::metrics
