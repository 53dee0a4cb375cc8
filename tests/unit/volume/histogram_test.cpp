// Histograms as text, which other programs send, and transfer functions as ParaView's JSON.
#include "common/volume/histogram.h"

#include <gtest/gtest.h>

#include <numeric>

#include "common/volume/transfer/function.h"

namespace telesplat::volume {
namespace {

TEST(Histogram, HasEveryVoxelInAnEvenBin) {
  std::vector<uint64_t> counts(4096);
  std::iota(counts.begin(), counts.end(), 0);
  const Levels levels{.lo = -1024, .step = 0.5, .count = 4096};
  const Histogram h = histogram_of(counts, levels, 256);
  ASSERT_EQ(h.counts.size(), 256u);
  EXPECT_EQ(std::accumulate(h.counts.begin(), h.counts.end(), uint64_t{0}),
            std::accumulate(counts.begin(), counts.end(), uint64_t{0}));
  EXPECT_EQ(h.counts[0], 120u);  // 0 to 15
  EXPECT_EQ(h.lo, -1024.25);
  EXPECT_EQ(h.hi, -1024 + 4096 * 0.5 - 0.25);
  EXPECT_EQ(histogram_of(std::vector<uint64_t>{7}, {.lo = 3, .step = 1, .count = 1}).counts, std::vector<uint64_t>{7});
}

TEST(Histogram, IsTheSameAfterATextAndNothingElseIsOne) {
  const Histogram h{-1.25, 17.5, {0, 12, 18446744073709551615u}};
  const auto again = histogram_from_text(to_text(h));
  ASSERT_TRUE(again) << again.error().text;
  EXPECT_EQ(*again, h);
  for (const char* bad : {"", ":", "1:2", "1:2:", "2:1:3", "1:1:3", "1:2:3,", "1:2:-3", "1:2:3.5", "nan:2:3", "1:inf:3",
                          "1:2:3;4", "1,2:3", "a:b:c"})
    EXPECT_FALSE(histogram_from_text(bad)) << bad;
  std::string many = "0:1:1";
  for (int i = 0; i < kMostBins; ++i) many += ",1";
  EXPECT_FALSE(histogram_from_text(many));
}

TEST(ParaviewJson, IsReadAgainAsItWasWritten) {
  const ValueRange range{.lo = -1000, .hi = 3000, .typical_lo = 0, .typical_hi = 500};
  for (const auto& preset : transfer_presets()) {
    const auto transfer = transfer_preset(preset.name, range);
    ASSERT_TRUE(transfer);
    const auto again = parse_paraview_json(to_paraview_json(*transfer, "a \"name\"\n"), "test", range);
    ASSERT_TRUE(again) << preset.name << ": " << again.error().text;
    ASSERT_EQ(again->points.size(), transfer->points.size()) << preset.name;
    for (size_t i = 0; i < transfer->points.size(); ++i) {
      const auto &a = transfer->points[i], &b = again->points[i];
      EXPECT_NEAR(a.value, b.value, 1e-9 * 4000);
      EXPECT_NEAR(double(a.opacity), double(b.opacity), 1e-5);
      EXPECT_NEAR(double(a.r), double(b.r), 1e-6);
    }
  }
}

}  // namespace
}  // namespace telesplat::volume
