// Rows of stages.csv wait for the frame that shows their update.
#include "client/viewer/coupling/stage_table.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "services/master/record/measured.h"

namespace telesplat::viewer {
namespace {

// Completes an update that took from t_s to t_s + 0.1 s.
void complete(StageTable& table, uint64_t request, double t_s) {
  const ViewRequester::Update update{.request = {request}, .requested_s = t_s, .complete_s = t_s + 0.1, .tiles = 3};
  const ViewPart last{.frame = {7}, .tile = 2, .moments = {.received_s = t_s + 0.001}, .arrived_s = t_s + 0.09};
  table.complete({update, last});
}

double cell(const wire::MetricRows& rows, size_t row, const std::string& column) {
  const auto found = std::find(rows.columns.begin(), rows.columns.end(), column);
  EXPECT_NE(found, rows.columns.end()) << column;
  return rows.values.at(row * rows.columns.size() + size_t(found - rows.columns.begin()));
}

TEST(StageTable, RowsComeWhenAFrameHasShownTheirUpdate) {
  StageTable table;
  complete(table, 1, 5);
  complete(table, 2, 6);
  complete(table, 3, 7);
  EXPECT_FALSE(table.flush({1}, false));
  table.displayed({2}, 6.15);
  const auto rows = table.flush({1}, false);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->columns, metrics::viewer_columns("stages"));
  ASSERT_EQ(rows->values.size(), 2 * rows->columns.size());
  EXPECT_EQ(cell(*rows, 0, "request"), 1) << "a frame shows all updates before its own";
  EXPECT_NEAR(cell(*rows, 1, "display_ms"), 50, 1e-6);
  EXPECT_NEAR(cell(*rows, 1, "latency_ms"), 100, 1e-6);
  EXPECT_NEAR(cell(*rows, 1, "request_network_ms"), 1, 1e-6);
  EXPECT_NEAR(cell(*rows, 1, "insertion_ms"), 10, 1e-6);
  EXPECT_EQ(cell(*rows, 1, "frame"), 7);
  EXPECT_EQ(cell(*rows, 1, "tile"), 2);
  EXPECT_EQ(cell(*rows, 1, "patches"), 3);
  EXPECT_FALSE(table.flush({1}, false));
  const auto last = table.flush({1}, true);
  ASSERT_TRUE(last);
  EXPECT_EQ(cell(*last, 0, "request"), 3);
  EXPECT_EQ(cell(*last, 0, "display_ms"), -1) << "no frame showed it";
}

TEST(StageTable, NobodyKnowsHowAReplayedUpdateCameAbout) {
  StageTable table;
  const ViewRequester::Update update{.request = {1}, .requested_s = 1, .complete_s = 2, .tiles = 3};
  table.complete({update, ViewPart{.frame = {7}, .arrived_s = 1.9}});
  EXPECT_FALSE(table.flush({1}, true));
}

TEST(StageTable, IsBoundedWhereNothingIsDisplayed) {
  StageTable table;
  for (uint64_t i = 1; i <= 300; ++i) complete(table, i, double(i));
  const auto rows = table.flush({1}, false);
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->values.size() / rows->columns.size(), 300u - 256u);
}

}  // namespace
}  // namespace telesplat::viewer
