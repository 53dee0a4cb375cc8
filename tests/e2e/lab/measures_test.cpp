// `telesplat-lab scaling` with real processes.
#include <gtest/gtest.h>

#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {
namespace {

TEST(Scaling, EveryPictureIsSampledWhole) {
  TemporaryFolder folder;
  // The same view again, with two samplers: half the waits are left, not less.
  Program scaling("telesplat-lab",
                  {"scaling", "--nodes", "1,2", "--frames", "2", "--row-cost", "1.5", "--size", "64x40", "--out",
                   folder / "scaling"},
                  folder / "scaling-run");
  ASSERT_EQ(scaling.wait(120), 0) << scaling.err();
  const auto table = tools::CsvTable::read(folder / "scaling/scaling.csv", {});
  ASSERT_TRUE(table) << table.error().text;
  const auto simulated = *table->column("simulated");
  size_t rows = 0, computed = 0;
  for (size_t row = 0; row < table->rows(); ++row) {
    if (*table->number(row, simulated) == 0) {
      ++computed;
      continue;
    }
    ++rows;
    const double nodes = *table->number(row, *table->column("nodes")),
                 time_s = *table->number(row, *table->column("time_s"));
    EXPECT_GE(time_s, 0.9 * 1.5 / nodes) << nodes << " nodes";
  }
  EXPECT_EQ(rows, 2u);
  EXPECT_GE(computed, 1u);
}

}  // namespace
}  // namespace telesplat::test
