// Reads the tables of runs that ended in any way, and shortens long measurements for a report.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "common/core/utf8.h"
#include "tools/telesplat/report/reading/run_tables.h"
#include "tools/telesplat/report/reading/thinning.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

Result<LooseTable> table_of(const std::string& text, const std::vector<std::string>& numbers,
                            const std::vector<std::string>& texts = {}) {
  const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
  const fs::path path = fs::temp_directory_path() / ("telesplat-loose-" + name + ".csv");
  std::ofstream(path, std::ios::binary) << text;
  auto out = LooseTable::read(path.string(), numbers, texts);
  fs::remove(path);
  return out;
}

TEST(LooseTable, FindsColumnsByNameAndToleratesOthers) {
  const auto t = table_of("x,viewer,new,y\n1,\"a, b\",9,2.5\n3,c,9,nan\n", {"y", "x", "gone"}, {"viewer", "nobody"});
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->rows(), 2u);
  EXPECT_EQ(t->numbers("x"), (std::vector<double>{1, 3}));
  EXPECT_EQ(t->numbers("y")[0], 2.5);
  EXPECT_TRUE(std::isnan(t->numbers("y")[1]));
  EXPECT_TRUE(std::isnan(t->numbers("gone")[1]));
  EXPECT_FALSE(t->has("gone"));
  EXPECT_EQ(t->texts("viewer"), (std::vector<std::string>{"a, b", "c"}));
  EXPECT_EQ(t->texts("nobody").size(), 2u);
}

TEST(LooseTable, LeavesOutWhatIsCutOffOrDamaged) {
  // The last line may end within a number; a quoted text that does not end is no row either.
  const auto t = table_of("a,b\r\n1,2\r\n3\n4,5,6\n\"7,8\n9,10\n11,1", {"a", "b"});
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->numbers("a"), (std::vector<double>{1, 9}));
  EXPECT_EQ(t->numbers("b"), (std::vector<double>{2, 10}));
  EXPECT_EQ(t->damaged(), 4u);
}

TEST(LooseTable, EveryBeginningOfAFileIsReadWithoutHarm) {
  const std::string whole = "viewer,t_s,v\n\"v\xc3\xa9\",1.5,inf\nb,2,-3e2\n";
  for (size_t n = 1; n <= whole.size(); ++n) {
    const auto t = table_of(whole.substr(0, n), {"t_s", "v"}, {"viewer"});
    ASSERT_TRUE(t.ok()) << n;
    EXPECT_EQ(t->numbers("t_s").size(), t->rows());
    for (const auto& text : t->texts("viewer")) EXPECT_TRUE(valid_utf8(text));
  }
  EXPECT_FALSE(table_of("", {"a"}).ok());
  EXPECT_FALSE(LooseTable::read("/no/such/file.csv", {"a"}).ok());
}

TEST(LooseTable, TakesNoLongLineAndNoNumberBeyondMeasure) {
  const auto t = table_of("a,b\n1,2\n" + std::string(200'000, '3') + ",4\n1e13,-1e13\n5,1e12\n", {"a", "b"});
  ASSERT_TRUE(t.ok());
  EXPECT_EQ(t->damaged(), 1u);
  ASSERT_EQ(t->rows(), 3u);
  EXPECT_TRUE(std::isnan(t->numbers("a")[1]));
  EXPECT_TRUE(std::isnan(t->numbers("b")[1]));
  EXPECT_EQ(t->numbers("b")[2], 1e12);
  EXPECT_FALSE(table_of(std::string(200'000, 'a') + "\n1\n", {"a"}).ok());
}

TEST(LooseTable, MakesTextsValid) {
  const auto t = table_of("viewer\n\xff\xfe" + std::string(300, 'x') + "\n", {}, {"viewer"});
  ASSERT_TRUE(t.ok());
  EXPECT_TRUE(valid_utf8(t->texts("viewer")[0]));
  EXPECT_LT(t->texts("viewer")[0].size(), 220u);
}

TEST(Thinning, KeepsEverySpikeAndBothEnds) {
  Series s;
  for (int i = 0; i < 100'000; ++i) s.add(i * 0.01, 16.0 + std::sin(i * 0.1));
  s.values[31'337] = 900;
  s.values[77'777] = 0.5;
  const Series few = thinned(s, 500);
  EXPECT_LE(few.size(), 1000u);
  EXPECT_GT(few.size(), 900u);
  EXPECT_EQ(*std::max_element(few.values.begin(), few.values.end()), 900);
  EXPECT_EQ(*std::min_element(few.values.begin(), few.values.end()), 0.5);
  EXPECT_TRUE(std::is_sorted(few.t_s.begin(), few.t_s.end()));
  for (size_t i = 0; i < few.size(); ++i)
    EXPECT_EQ(s.values[size_t(std::lround(few.t_s[i] * 100))], few.values[i]) << "a point that was not measured";
}

TEST(Thinning, LeavesShortSeriesAsTheyAre) {
  Series s;
  for (int i = 0; i < 10; ++i) s.add(i, i * i);
  EXPECT_EQ(thinned(s, 5).values, s.values);
  EXPECT_EQ(thinned(Series{}, 5).size(), 0u);
  Series one_moment;
  for (int i = 0; i < 100; ++i) one_moment.add(3, i);
  EXPECT_EQ(thinned(one_moment, 5).values, (std::vector<double>{0, 99}));
}

TEST(Thinning, TidyDropsWhatIsNoNumberAndSorts) {
  Series s;
  s.add(2, 20), s.add(NAN, 1), s.add(1, 10), s.add(3, INFINITY), s.add(4, NAN);
  const Series t = tidy(s);
  EXPECT_EQ(t.t_s, (std::vector<double>{1, 2}));
  EXPECT_EQ(t.values, (std::vector<double>{10, 20}));
}

TEST(Thinning, RoundsToSignificantDigits) {
  EXPECT_DOUBLE_EQ(rounded(123456.789, 5), 123460);
  EXPECT_DOUBLE_EQ(rounded(0.000123456, 3), 0.000123);
  EXPECT_DOUBLE_EQ(rounded(-99999.6, 5), -100000);
  EXPECT_EQ(rounded(0), 0);
  EXPECT_TRUE(std::isnan(rounded(NAN)));
  EXPECT_EQ(rounded_json({1.23456789, NAN}, 3).dump(), "[1.23,null]");
}

TEST(Thinning, RatesAddUpToWhatCame) {
  std::vector<double> t, bytes;
  for (int i = 0; i < 1000; ++i) t.push_back(i * 0.0107), bytes.push_back(i % 7);
  t.push_back(NAN), bytes.push_back(1e9);
  t.push_back(1), bytes.push_back(NAN);
  t.push_back(-5), bytes.push_back(1e9);
  double all = 0;
  for (int i = 0; i < 1000; ++i) all += i % 7;
  const Series r = rate(t, bytes, 0, 10.75, 0.5);
  double sum = 0;
  for (size_t k = 0; k < r.size(); ++k) sum += r.values[k] * (k + 1 < r.size() ? 0.5 : 0.25);
  EXPECT_NEAR(sum, all, 1e-6);
  EXPECT_EQ(rate(t, bytes, 3, 3, 0.5).size(), 0u);
}

TEST(Thinning, SpreadsTellSharesWithinADisplaysPeriod) {
  std::vector<double> ms(80, 16.7);
  ms.insert(ms.end(), 15, 11.0);
  ms.insert(ms.end(), 5, 40.0);
  ms.push_back(NAN);
  const auto s = spread_json(ms);
  EXPECT_EQ(s.at("n"), 100);
  EXPECT_EQ(s.at("within").at("60"), 0.95);
  EXPECT_EQ(s.at("within").at("72"), 0.15);
  EXPECT_EQ(s.at("within").at("90"), 0.15);
  size_t counted = 0;
  for (const auto& bin : s.at("bins")) {
    counted += bin[1].get<size_t>();
    const double from = std::pow(2, bin[0].get<double>() / 16);
    EXPECT_TRUE((from <= 11 && from > 10) || (from <= 16.7 && from > 15.9) || (from <= 40 && from > 38));
  }
  EXPECT_EQ(counted, 100u);
  EXPECT_TRUE(spread_json({NAN}).is_null());
  EXPECT_TRUE(spread_json({}).is_null());
  EXPECT_EQ(spread_json({0, 0}).at("n"), 2) << "a delay of nothing has a logarithm of its own";
}

TEST(UpdateStages, AreGroupedByTheirNames) {
  EXPECT_STREQ(stage_group("tile_network_ms"), "network");
  EXPECT_STREQ(stage_group("view_queue_ms"), "queue");
  EXPECT_STREQ(stage_group("sampling_ms"), "work");
  EXPECT_EQ(std::size(kUpdateStages), 17u);
}

}  // namespace
}  // namespace telesplat::launcher
