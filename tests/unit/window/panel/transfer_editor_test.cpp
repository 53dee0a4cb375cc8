#include "client/displays/window/panel/transfer_editor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace telesplat::viewer {
namespace {

TransferEditor editor_of(const std::string& function, volume::ValueRange range,
                         std::optional<volume::Histogram> histogram = {}) {
  volume::Session session;
  session.range = range;
  session.transfer = *volume::parse_transfer(function, range);
  TransferEditor out;
  out.on_session(0, session, histogram);
  return out;
}
const volume::ValueRange kBytes{.lo = 0, .hi = 255, .typical_lo = 20, .typical_hi = 200};
const std::string kWide = "-1000:#000000:0,100:#ff0000:0.5,3000:#ffffff:1";

std::vector<double> values(const TransferEditor& e) {
  std::vector<double> out;
  for (const auto& p : e.transfer().points) out.push_back(p.value);
  return out;
}

TEST(TransferEditor, TheDataFillTheAxisWhereverThePointsLie) {
  for (const std::string& function : {kWide, std::string("0:#000000:0,254:#ffffff:1"), std::string("900:#ffffff:1")}) {
    const auto e = editor_of(function, kBytes);
    EXPECT_EQ(e.lo(), 0);
    EXPECT_EQ(e.hi(), 255);
  }
}

TEST(TransferEditor, ThereIsAnAxisForDataOfOneValue) {
  for (const double value : {0.0, 7.0, -1e30, 1e30, 9.007199254740993e15}) {
    const auto e = editor_of("0:#000000:0,1:#ffffff:1", {.lo = value, .hi = value});
    EXPECT_LT(e.lo(), value);
    EXPECT_GT(e.hi(), value);
    EXPECT_NEAR(e.share(value), 0.5, 1e-6) << value;
  }
}

TEST(TransferEditor, SharesAndValuesAreEachOthersInverse) {
  for (const volume::ValueRange range :
       {kBytes, volume::ValueRange{.lo = -1e30, .hi = 1e30}, volume::ValueRange{.lo = -9.2e18, .hi = 9.2e18},
        volume::ValueRange{.lo = 1e-30, .hi = 2e-30}}) {
    const auto e = editor_of("0:#000000:0,1:#ffffff:1", range);
    for (const double share : {0.0, 0.25, 1.0}) EXPECT_NEAR(e.share(e.value_at(share)), share, 1e-9) << range.hi;
    EXPECT_EQ(e.share(1e300), 2) << "values far beyond the axis have a place, too";
    EXPECT_EQ(e.share(-1e300), -1);
  }
}

TEST(TransferEditor, BarsLieOnTheAxisWhereverTheHistogramDoes) {
  struct Case {
    double lo, hi;
    size_t bars;
  };
  for (const Case c :
       {Case{0, 255, 4}, {-255, 255, 2}, {0, 510, 2}, {64, 65, 4}, {-1000, -1, 0}, {300, 900, 0}, {-1e308, 1e308, 1}}) {
    const auto e = editor_of(kWide, kBytes, volume::Histogram{c.lo, c.hi, {4, 1000, 4, 1, 0}});
    for (const bool logarithmic : {false, true})
      for (const auto& bar : e.bars(logarithmic)) {
        EXPECT_TRUE(bar.from >= 0 && bar.from < bar.to && bar.to <= 1) << c.lo << " " << c.hi;
        EXPECT_TRUE(bar.height > 0 && bar.height <= 1);
      }
    EXPECT_LE(e.bars(true).size(), 4u);
    EXPECT_EQ(e.bars(true).empty(), c.bars == 0) << c.lo;
  }
}

TEST(TransferEditor, LinearBarsAreAsHighAsTheirCounts) {
  const auto e = editor_of(kWide, kBytes, volume::Histogram{0, 255, {10, 1000}});
  EXPECT_NEAR(e.bars(false)[0].height, 0.01, 1e-9);
  EXPECT_NEAR(e.bars(true)[0].height, std::log1p(10) / std::log1p(1000), 1e-9);
  EXPECT_TRUE(editor_of(kWide, kBytes, volume::Histogram{0, 255, {0, 0}}).bars(true).empty());
  EXPECT_TRUE(editor_of(kWide, kBytes).bars(true).empty());
}

TEST(TransferEditor, TheCurveGoesFromEndToEndOfTheAxis) {
  const auto spots = editor_of("-255:#000000:0,127.5:#ff0000:1,510:#ffffff:0", kBytes).curve();
  ASSERT_EQ(spots.size(), 3u);
  EXPECT_EQ(spots[0].share, 0);
  EXPECT_NEAR(spots[0].opacity, 2.0 / 3, 1e-6);
  EXPECT_NEAR(spots[1].share, 0.5, 1e-9);
  EXPECT_EQ(spots[2].share, 1);
  EXPECT_NEAR(spots[2].opacity, 2.0 / 3, 1e-6);
  EXPECT_EQ(editor_of("900:#ffffff:0.3", kBytes).curve().size(), 2u) << "wholly outside the data";
}

TEST(TransferEditor, APointCanBeTypedBeyondTheAxisButNotBeyondItsNeighbours) {
  auto e = editor_of("0:#000000:0,100:#ff0000:0.5,255:#ffffff:1", kBytes);
  EXPECT_TRUE(e.move(1, 2, 5000, 1));
  EXPECT_TRUE(e.move(1, 0, -1e300, 0));
  EXPECT_EQ(values(e), (std::vector<double>{-volume::kMaxTransferValue, 100, 5000}));
  EXPECT_TRUE(e.move(1, 1, 6000, 0.5));
  EXPECT_EQ(values(e)[1], 5000) << "points at equal values";
  for (const double no : {double(NAN), double(INFINITY)}) {
    EXPECT_FALSE(e.move(1, 1, no, 0.5));
    EXPECT_FALSE(e.move(1, 1, 5, no));
    EXPECT_FALSE(e.add(1, no));
    EXPECT_FALSE(e.set_window(1, no, 0));
    EXPECT_FALSE(e.set_window(1, 1, no));
  }
}

TEST(TransferEditor, WindowAndLevelMoveAndStretchTheWholeFunction) {
  auto e = editor_of("0:#000000:0,100:#ff0000:0.5,200:#ffffff:1", kBytes);
  EXPECT_EQ(e.window(), 200);
  EXPECT_EQ(e.level(), 100);
  EXPECT_TRUE(e.set_window(1, 50, 300));
  EXPECT_EQ(values(e), (std::vector<double>{275, 300, 325}));
  EXPECT_TRUE(e.set_window(1, 0, 10));
  EXPECT_EQ(values(e), (std::vector<double>{10, 10, 10}));
  EXPECT_TRUE(e.set_window(1, 4, 10)) << "what was pressed together is spread";
  EXPECT_EQ(values(e), (std::vector<double>{8, 10, 12}));
  EXPECT_TRUE(e.set_window(1, 1e300, 0));
  EXPECT_EQ(values(e).back(), volume::kMaxTransferValue);
  EXPECT_FALSE(e.set_window(1, -1, 0));
}

TEST(TransferEditor, FitsToTheData) {
  auto e = editor_of(kWide, kBytes);
  EXPECT_TRUE(e.fit(1));
  EXPECT_EQ(values(e).front(), 0);
  EXPECT_EQ(values(e).back(), 255);
  EXPECT_NEAR(values(e)[1], 255 * 1100.0 / 4000, 1e-9);
  auto one = editor_of("5:#ffffff:1", {.lo = 7, .hi = 7});
  EXPECT_TRUE(one.fit(1));
  EXPECT_TRUE(volume::validate(one.transfer()));
}

}  // namespace
}  // namespace telesplat::viewer
