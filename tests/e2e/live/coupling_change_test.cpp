// `telesplat ctl coupling` of a running session.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

TEST(ChangedCouplings, EachFrameSaysWhichWasInForce) {
  PipelineRun run({"--duration", "0", "--size", "320x200", "--sampling-size", "240x150", "--record-points", "0"});
  ASSERT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "frames") > 3; })) << run.program().err();
  std::string out, err;
  // In each coupling some more updates are displayed.
  const auto goes_on_with = [&](double mode, double buffers) {
    double before = -1;
    return run.wait_status([&](const auto& s) {
      if (value(s, "viewer-1", "coupling") != mode || value(s, "viewer-1", "buffers") != buffers) return false;
      const double updates = value(s, "viewer-1", "updates"), frames = value(s, "viewer-1", "frames");
      if (before < 0) before = updates + frames;
      return updates + frames > before + 6;
    });
  };
  for (const auto& [words, mode, buffers] : {std::tuple{std::vector<std::string>{"sync"}, 1, 1},
                                             {{"loose", "--buffers", "2"}, 2, 2},
                                             {{"async"}, 0, 0},
                                             {{"loose", "--viewer", "viewer-1"}, 2, 3},
                                             {{"async"}, 0, 0}}) {
    auto order = words;
    order.insert(order.begin(), "coupling");
    EXPECT_EQ(ctl(run, order, &out, &err), 0) << err;
    EXPECT_TRUE(out.starts_with("viewer-1: " + words.front())) << out;
    EXPECT_TRUE(goes_on_with(mode, buffers)) << words.front();
  }
  EXPECT_EQ(ctl(run, {"coupling", "images"}, &out, &err), 2) << out;
  EXPECT_NE(err.find("is of a session from its beginning"), std::string::npos) << err;
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  const auto s = run.summary();
  EXPECT_EQ(s["coupling"], "async") << "as it began";
  EXPECT_EQ(s["coupling_changes"], 5);
  EXPECT_EQ(s["frames_by_coupling"].size(), 4u) << s["frames_by_coupling"];
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  const auto mode = run.column("frames.csv", "coupling"), buffers = run.column("frames.csv", "buffers"),
             request = run.column("frames.csv", "request");
  ASSERT_EQ(mode.size(), size_t(s["frames"]));
  ASSERT_EQ(buffers.size(), mode.size());
  const auto waits = run.column("frames.csv", "wait_ms");
  double longest_sync_ms = 0;
  for (size_t i = 0; i < mode.size(); ++i)
    if (mode[i] == 1) longest_sync_ms = std::max(longest_sync_ms, waits[i]);
  EXPECT_GT(longest_sync_ms, 0) << "it never waited for data";
  std::vector<std::pair<double, double>> order;
  for (size_t i = 0; i < mode.size(); ++i)
    if (order.empty() || order.back() != std::pair(mode[i], buffers[i])) order.emplace_back(mode[i], buffers[i]);
  EXPECT_EQ(order, (std::vector<std::pair<double, double>>{{0, 0}, {1, 1}, {2, 2}, {0, 0}, {2, 3}, {0, 0}}));
  // Where the display waits, each frame shows the next update: none twice, none left out.
  const auto updates = run.column("updates.csv", "request");
  const std::set<double> complete(updates.begin(), updates.end());
  for (size_t i = 1; i < mode.size(); ++i) {
    EXPECT_GE(request[i], request[i - 1]);
    if (mode[i] == 0 || mode[i - 1] == 0) continue;
    EXPECT_GT(request[i], request[i - 1]) << "frame " << i;
    EXPECT_EQ(complete.upper_bound(request[i - 1]), complete.find(request[i])) << "frame " << i << " left one out";
  }
}

}  // namespace
}  // namespace telesplat::test
