// Configurations compared with the first one.
#include "tools/telesplat/sweep/tables.h"

#include <gtest/gtest.h>

#include <cmath>

namespace telesplat::launcher {
namespace {

// Three configurations that differ in one figure, the inter-frame delay.
SweepRecord record_of(const std::vector<std::vector<double>>& delays) {
  SweepRecord out;
  out.grid.scene = "julia";
  out.grid.axes = {{"samplers", {"1", "2", "4"}}};
  out.grid.repeat = int(delays.front().size());
  out.configurations = configurations(out.grid);
  for (size_t c = 0; c < delays.size(); ++c)
    for (size_t i = 0; i < delays[c].size(); ++i)
      out.runs.push_back({c,
                          int(i) + 1,
                          run_folder(out.configurations[c], int(i) + 1),
                          RunOutcome{.done = true},
                          {{"inter_frame_delay_ms.median", delays[c][i]}}});
  return out;
}

TEST(SweepCells, AreHeldAgainstTheFirst) {
  const auto cells = cells_of(record_of({{16.7, 17.2, 16.9}, {20, 20, 20}, {16.8, 17.1, 17.0}}));
  ASSERT_EQ(cells.size(), 3u) << "one figure was measured";
  EXPECT_FALSE(cells[0].difference);
  ASSERT_TRUE(cells[1].difference);
  EXPECT_NEAR(cells[1].difference->mean, 20 - 50.8 / 3, 1e-9);
  // Where one side does not vary there are 2 degrees of freedom, for which p is 1 - t / sqrt(2 + t^2).
  const double t = (20 - 50.8 / 3) / std::sqrt(0.19 / 3 / 3), p = 1 - t / std::sqrt(2 + t * t);
  EXPECT_NEAR(cells[1].difference->p, p, 1e-9);
  EXPECT_NEAR(cells[1].p_holm, 2 * p, 1e-9) << "there are two comparisons";
  EXPECT_LT(cells[1].p_holm, 0.05);
  EXPECT_GT(cells[2].p_holm, 0.05);
}

TEST(SweepCells, AreATable) {
  const std::string csv = cells_csv(record_of({{10, 12}, {14, 18}, {}}));
  EXPECT_NE(csv.find("configuration,flag.samplers,figure,runs,mean,median,sd,mean_low,mean_high,difference,"
                     "difference_low,difference_high,p,p_holm\n"),
            csv.npos)
      << csv;
  // 11 -+ 12.7062 sqrt(2 / 2)
  EXPECT_NE(csv.find("samplers-1,1,inter_frame_delay_ms.median,2,11,11,1.41421,-1.7062,23.7062,,,,,\n"), csv.npos)
      << csv;
  EXPECT_NE(csv.find("samplers-2,2,inter_frame_delay_ms.median,2,16,16,2.82843,-9.41241,41.4124,5,"), csv.npos) << csv;
  EXPECT_NE(csv.find("samplers-4,4,inter_frame_delay_ms.median,0,"), csv.npos) << csv;
}

TEST(SweepCells, OfTwoRunsSayThatTheyAreFew) {
  Grid grid;
  for (const auto& [repeat, told] : {std::pair{1, "one run of each configuration: there are no intervals"},
                                     {2, "two runs of each configuration: intervals are wide"}}) {
    grid.repeat = repeat;
    EXPECT_NE(too_few(grid).find(told), std::string::npos) << too_few(grid);
    EXPECT_NE(too_few(grid).find("too noisy cannot be told with fewer than 3"), std::string::npos);
  }
  grid.repeat = 3;
  EXPECT_EQ(too_few(grid), "");
}

}  // namespace
}  // namespace telesplat::launcher
