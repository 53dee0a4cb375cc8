// Loose coupling (T6.4): the display shows one frame per view update. ChangedCouplings tests synchronous coupling.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

TEST(LooseCoupling, OneFrameForEachViewUpdate) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha");
  // Until there are 40 frames.
  PipelineRun run({"--size", "320x200", "--sampling-size", "240x150", "--coupling", "loose", "--buffers", "3",
                   "--duration", "6", "--frames", "40", "--record-points", "0"},
                  folder / "balls.mha");
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["kind"], "volume");
  EXPECT_EQ(s["coupling"], "loose");
  EXPECT_EQ(s["buffers"], 3);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  EXPECT_GT(s["frames"], 5);

  // Each frame shows the update of another request, in their order. When it ends some may be complete and not yet
  // displayed.
  const auto requests = run.column("frames.csv", "request");
  ASSERT_EQ(requests.size(), size_t(s["frames"]));
  EXPECT_TRUE(std::is_sorted(requests.begin(), requests.end()));
  const size_t shown = std::set<double>(requests.begin(), requests.end()).size();
  // One that nothing follows for 2 s is drawn again; sanitized programs may take longer.
  EXPECT_LE(requests.size() - shown, size_t(kSlow ? 4 : 0)) << "two frames of one update";
  EXPECT_GE(s["updates"], shown);
  EXPECT_LE(s["updates"], int(s["frames"]) + 3);
  const auto updates = run.column("updates.csv", "request");
  const std::set<double> known(updates.begin(), updates.end());
  for (const double r : requests) EXPECT_TRUE(known.contains(r)) << "request " << r << " has no update";

  const auto filled = run.column("frames.csv", "buffers_filled"), waits = run.column("frames.csv", "wait_ms");
  ASSERT_EQ(filled.size(), requests.size());
  ASSERT_EQ(waits.size(), requests.size());
  EXPECT_LE(*std::max_element(filled.begin(), filled.end()), 3);
  EXPECT_GE(*std::min_element(waits.begin(), waits.end()), 0);
}

}  // namespace
}  // namespace telesplat::test
