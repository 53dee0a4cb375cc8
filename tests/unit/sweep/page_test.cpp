// The report of a sweep: which flag goes where, scales, and that nothing that people typed becomes markup.
#include <gtest/gtest.h>

#include <cmath>

#include "tools/telesplat/sweep/page.h"
#include "tools/telesplat/sweep/plot.h"

namespace telesplat::launcher {
namespace {

size_t count(const std::string& text, const std::string& what) {
  size_t out = 0;
  for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++out;
  return out;
}

Manifest manifest_of(const Grid& grid) { return begin_manifest(grid, "1.0", "/here"); }

SweepRecord record_of(const Grid& grid) {
  SweepRecord out{grid, configurations(grid), {}};
  for (size_t c = 0; c < out.configurations.size(); ++c)
    for (int r = 1; r <= grid.repeat; ++r)
      out.runs.push_back({c,
                          r,
                          run_folder(out.configurations[c], r),
                          RunOutcome{.done = true},
                          {{"fps", 30.0 + double(c) + r}, {"inter_frame_delay_ms.median", 10.0 * double(c + 1) * r}}});
  return out;
}

TEST(SweepLayout, NumbersGoAcrossAndTheNextFlagHasColours) {
  Grid grid;
  grid.axes = {{"link", {"local", "far"}}, {"samplers", {"4", "1", "2"}}, {"coupling", {"sync", "async"}}};
  const PlotLayout layout = layout_of(grid);
  EXPECT_EQ(layout.across, 1u);
  EXPECT_TRUE(layout.numeric);
  EXPECT_EQ(layout.colours, 0u);
  EXPECT_EQ(layout.panels, std::vector<size_t>{2});
}

TEST(SweepLayout, WithoutNumbersTheLongestFlagGoesAcross) {
  Grid grid;
  grid.axes = {{"coupling", {"sync", "loose", "async"}}, {"splat", {"disc", "ewa"}}};
  EXPECT_EQ(layout_of(grid).across, 0u);
  EXPECT_FALSE(layout_of(grid).numeric);
  EXPECT_EQ(layout_of(grid).colours, 1u);
  EXPECT_FALSE(layout_of(Grid{}).across);
}

TEST(SweepLayout, TooManyValuesForColoursMakePanels) {
  Grid grid;
  grid.axes = {{"samplers", {"1", "2", "3", "4", "5", "6", "7", "8", "9", "10"}},
               {"background", {"a", "b", "c", "d", "e", "f", "g", "h", "i"}}};
  EXPECT_EQ(layout_of(grid).across, 0u);
  EXPECT_FALSE(layout_of(grid).colours);
  EXPECT_EQ(layout_of(grid).panels, std::vector<size_t>{1});
}

TEST(SweepLayout, WhatIsNoFiniteNumberIsAWord) {
  Grid grid;
  for (const char* word : {"nan", "inf", "1e999"}) {
    grid.axes = {{"scene", {"1", word, "3"}}};
    EXPECT_FALSE(layout_of(grid).numeric) << word;
  }
}

TEST(SweepScale, TakesWhatDiffersByRoundingForOneValue) {
  const Scale s = scale_of(30, std::nextafter(30, 31), false);
  EXPECT_LT(s.low, 30);
  EXPECT_GT(s.high, 30);
  EXPECT_GT(s.step, 1) << "an axis with a mark for each rounding has no end";
}

TEST(SweepScale, IsRoundAndHoldsEverything) {
  for (const auto& [least, most, zero] : {std::tuple{0.013, 0.92, true},
                                          {16.7, 16.7, true},
                                          {31.2, 33.9, false},
                                          {0.0, 0.0, true},
                                          {-4.0, 1e6, true},
                                          {40.0, 40.0, false},
                                          {99.9, 100.0, false}}) {
    const Scale s = scale_of(least, most, zero);
    EXPECT_LE(s.low, least + 1e-9);
    EXPECT_GE(s.high, most - 1e-9);
    EXPECT_GT(s.high, s.low);
    EXPECT_LE((s.high - s.low) / s.step, 8.01) << least << " " << most;
    EXPECT_GE((s.high - s.low) / s.step, 1.99) << least << " " << most;
    if (zero && least >= 0) {
      EXPECT_EQ(s.low, 0);
    }
  }
}

TEST(SweepPage, HasAPlotForEachFigureAndPanel) {
  Grid grid;
  grid.scene = "julia";
  grid.axes = {{"samplers", {"1", "2", "4"}}, {"coupling", {"sync", "async"}}, {"splat", {"disc", "ewa"}}};
  grid.repeat = 1;
  const std::string page = to_html(record_of(grid), manifest_of(grid), "/nowhere/mine");
  EXPECT_EQ(count(page, "<svg "), 4u) << "2 figures x 2 splats";
  EXPECT_EQ(count(page, "data-tip="), 24u);
  EXPECT_EQ(count(page, "<circle "), 24u);
  EXPECT_EQ(count(page, "<polyline "), 8u);
  EXPECT_NE(page.find("<h1>Sweep of julia: samplers, coupling, splat</h1>"), std::string::npos);
  EXPECT_EQ(page.find("http"), std::string::npos) << "it needs nothing from elsewhere";
  EXPECT_EQ(page.find("nan"), std::string::npos);
}

TEST(SweepPage, NumbersStandInTheirOrder) {
  Grid grid;
  grid.scene = "julia";
  grid.axes = {{"samplers", {"10", "2", "1"}}};
  grid.repeat = 1;
  const std::string page = to_html(record_of(grid), manifest_of(grid), "/nowhere");
  const size_t one = page.find(">1<title>"), two = page.find(">2<title>"), ten = page.find(">10<title>");
  ASSERT_NE(ten, std::string::npos);
  EXPECT_LT(one, two);
  EXPECT_LT(two, ten);
}

TEST(SweepPage, ValuesOfUpTo24LettersStandWhole) {
  Grid grid;
  grid.scene = "data/lucy.ply";
  grid.axes = {{"link", {"local", "50ms:20mbit", "rtt=40ms,rate=100mbit,jitter=5ms"}}};
  const std::string page = to_html(record_of(grid), manifest_of(grid), "/nowhere/sweep");
  EXPECT_NE(page.find(">50ms:20mbit<title>"), std::string::npos);
  EXPECT_EQ(page.find(">rtt=40ms,rate=100mbit,jitter=5ms<title>"), std::string::npos) << "a plot has a width";
  EXPECT_NE(page.find("<h1>Sweep of lucy.ply: link</h1>"), std::string::npos);
}

TEST(SweepPage, TellsNoiseAndFailures) {
  Grid grid;
  grid.scene = "julia";
  grid.axes = {{"samplers", {"1", "2"}}};
  auto record = record_of(grid);
  record.runs[5].outcome = RunOutcome{.attempts = 2, .exit_code = 1, .reason = "exit code 1: <gone>"};
  record.runs[5].figures.clear();
  const std::string page = to_html(record, manifest_of(grid), "/nowhere");
  EXPECT_NE(page.find("samplers=1: 3 runs differ by 100 %"), std::string::npos);
  EXPECT_NE(page.find("class=\"p c0 noisy\""), std::string::npos);
  EXPECT_NE(page.find("samplers=2, run 3: exit code 1: &lt;gone&gt;"), std::string::npos);
  EXPECT_NE(page.find("5 of 6 done"), std::string::npos);
}

TEST(SweepPage, WhatPeopleTypedIsNoMarkup) {
  Grid grid;
  grid.scene = "<script>alert(1)</script>.ply";
  grid.flags = {"--background", "\"><img src=x>"};
  grid.axes = {{"background", {"<b>", "'\"&"}}, {"splat", {"</svg><script>", "disc"}}};
  const std::string page = to_html(record_of(grid), manifest_of(grid), "/a/<i>");
  EXPECT_EQ(count(page, "<script>"), 1u) << "our own";
  EXPECT_EQ(page.find("<img"), std::string::npos);
  EXPECT_EQ(page.find("<b>"), std::string::npos);
  EXPECT_EQ(page.find("<i>,"), std::string::npos);
  EXPECT_NE(page.find("&lt;script&gt;alert(1)"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::launcher
