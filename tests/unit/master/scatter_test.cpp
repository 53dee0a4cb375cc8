// Assignment sheets: sender, receiver and round of each transfer.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "services/master/slabs/assignment.h"

namespace telesplat::master {
namespace {

// T figure 5.1: A1 -> B1, B2; A2 -> B1, B2, B3; A3 -> B1, B2, B3; A4 -> B2, B3. Numbered from 0.
const std::vector<Transfer> kFigure{{0, 0, 1}, {0, 1, 1}, {1, 0, 1}, {1, 1, 1}, {1, 2, 1},
                                    {2, 0, 1}, {2, 1, 1}, {2, 2, 1}, {3, 1, 1}, {3, 2, 1}};

// Counts pairs of transfers that share a node and a round.
int conflicts(const AssignmentSheet& sheet, const std::vector<Transfer>& transfers) {
  int out = 0;
  for (size_t i = 0; i < transfers.size(); ++i)
    for (size_t j = 0; j < i; ++j)
      out += sheet.round[i] == sheet.round[j] &&
             (transfers[i].sender == transfers[j].sender) + (transfers[i].receiver == transfers[j].receiver) > 0;
  return out;
}

TEST(Scatter, FigureWithoutConflictsTakesAsManyRoundsAsB2HasTransfers) {
  const auto sheet = schedule_scatter(kFigure);
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->rounds, 4u) << "B2 receives from four senders, so three rounds cannot do without a conflict";
  EXPECT_EQ(conflicts(*sheet, kFigure), 0);
  EXPECT_TRUE(validate(*sheet, kFigure));
}

TEST(Scatter, FigureInThreeRoundsIsAsGoodAsTheThesissBetterSheet) {
  // Sheets (c) and (d), rounds from 0. In (c) the text says A4 -> B1 where its table has A4 -> B2.
  const AssignmentSheet c{{0, 1, 0, 1, 2, 0, 1, 2, 0, 1}, 3};
  const AssignmentSheet d{{2, 0, 0, 1, 2, 1, 2, 0, 0, 1}, 3};
  const auto ours = schedule_scatter(kFigure, 3);
  ASSERT_TRUE(ours);
  EXPECT_EQ(ours->rounds, 3u);
  EXPECT_EQ(conflicts(c, kFigure), 7);
  EXPECT_EQ(conflicts(d, kFigure), 1) << "A1 and A4 both send to B2 in the first round";
  EXPECT_EQ(conflicts(*ours, kFigure), 1);
  EXPECT_TRUE(validate(*ours, kFigure));
  EXPECT_TRUE(validate(d, kFigure));
  EXPECT_FALSE(validate(c, kFigure));
}

TEST(Scatter, ThreeRoundsAreEnoughWhereNobodyHasMore) {
  auto transfers = kFigure;
  transfers.erase(transfers.begin() + 8);  // A4 -> B2
  const auto sheet = schedule_scatter(transfers);
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->rounds, 3u);
  EXPECT_EQ(conflicts(*sheet, transfers), 0);
}

TEST(Scatter, OfNothingAndOfOnePair) {
  ASSERT_TRUE(schedule_scatter({}));
  EXPECT_EQ(schedule_scatter({})->rounds, 0u);
  const std::vector<Transfer> pair{{7, 9, 5}, {7, 9, 6}, {7, 9, 7}};
  const auto sheet = schedule_scatter(pair);
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->rounds, 3u);
  EXPECT_EQ(sheet->makespan(pair), 18u);
}

TEST(Scatter, LargeTransfersShareRounds) {
  // Two senders, two receivers: large along one diagonal, small along the other.
  const std::vector<Transfer> t{{0, 0, 100}, {0, 1, 1}, {1, 0, 1}, {1, 1, 100}};
  EXPECT_EQ(schedule_scatter(t)->makespan(t), 101u);
  // Swaps repair a bad colouring: three rounds, each with one large transfer, by order of bytes.
  const std::vector<Transfer> u{{0, 0, 9}, {0, 1, 8}, {1, 1, 7}, {1, 2, 9}, {2, 2, 8}, {2, 0, 1}};
  EXPECT_LE(schedule_scatter(u)->makespan(u), schedule_scatter(u, 0, false)->makespan(u));
}

TEST(Scatter, RefusesWhatIsTooLargeAndSheetsThatAreWrong) {
  EXPECT_FALSE(schedule_scatter(std::vector<Transfer>{{kMaxScatterNodes, 0, 1}}));
  EXPECT_FALSE(schedule_scatter(std::vector<Transfer>{{0, kMaxScatterNodes, 1}}));
  EXPECT_FALSE(schedule_scatter(std::vector<Transfer>(kMaxTransfers + 1)));
  auto sheet = *schedule_scatter(kFigure);
  auto wrong = sheet;
  wrong.round.pop_back();
  EXPECT_FALSE(validate(wrong, kFigure)) << "a transfer is missing";
  wrong = sheet;
  wrong.round[0] = 4;
  EXPECT_FALSE(validate(wrong, kFigure)) << "a round that is not there";
  wrong = sheet;
  wrong.round[0] = wrong.round[1];
  EXPECT_FALSE(validate(wrong, kFigure)) << "A1 sends twice";
}

class RandomScatter : public ::testing::TestWithParam<uint32_t> {
 protected:
  std::mt19937 random{GetParam()};
  uint32_t below(uint32_t n) { return uint32_t(random() % n); }
  std::vector<Transfer> transfers() {
    const uint32_t senders = 1 + below(12), receivers = 1 + below(20), count = 1 + below(300);
    std::vector<Transfer> out;
    for (uint32_t i = 0; i < count; ++i)
      out.push_back({below(senders), below(receivers), uint64_t(std::exp(double(below(1000)) / 100))});
    return out;
  }
};

TEST_P(RandomScatter, HasAsFewRoundsAsCanBeAndNoConflict) {
  for (int i = 0; i < 20; ++i) {
    const auto t = transfers();
    for (const bool weighted : {true, false}) {
      const auto sheet = schedule_scatter(t, 0, weighted);
      ASSERT_TRUE(sheet);
      ASSERT_EQ(sheet->rounds, busiest(t));
      ASSERT_EQ(conflicts(*sheet, t), 0);
      ASSERT_TRUE(validate(*sheet, t));
    }
    const uint32_t fewer = 1 + below(busiest(t));
    const auto narrow = schedule_scatter(t, fewer);
    ASSERT_TRUE(narrow);
    ASSERT_EQ(narrow->rounds, fewer);
    const auto valid = validate(*narrow, t);
    ASSERT_TRUE(valid) << valid.error().text;
  }
}

TEST_P(RandomScatter, TakesLessTimeThanAnArbitraryColouring) {
  double ours = 0, arbitrary = 0, bound = 0;
  for (int i = 0; i < 20; ++i) {
    const auto t = transfers();
    ours += double(schedule_scatter(t)->makespan(t));
    arbitrary += double(schedule_scatter(t, 0, false)->makespan(t));
    // No node can finish sooner than all of its own transfers take.
    std::map<std::pair<int, uint32_t>, uint64_t> load;
    for (const auto& x : t) load[{0, x.sender}] += x.bytes, load[{1, x.receiver}] += x.bytes;
    uint64_t most = 0;
    for (const auto& [node, bytes] : load) most = std::max(most, bytes);
    ASSERT_GE(schedule_scatter(t)->makespan(t), most);
    bound += double(most);
  }
  EXPECT_LT(ours, 0.7 * arbitrary);
  EXPECT_LT(ours, 1.35 * bound);
}

INSTANTIATE_TEST_SUITE_P(Seeds, RandomScatter, ::testing::Range(1u, 11u));

TEST(Scatter, LargestSheetsAreBounded) {
  std::mt19937 random(1);
  std::vector<Transfer> many;
  for (uint32_t i = 0; i < kMaxTransfers; ++i) many.push_back({i % 256, i / 256, uint64_t(random())});  // all to all
  auto sheet = schedule_scatter(many);
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->rounds, 256u);
  EXPECT_TRUE(validate(*sheet, many));
  // One pair has all transfers.
  many.assign(kMaxTransfers, {kMaxScatterNodes - 1, 0, 1});
  sheet = schedule_scatter(many);
  ASSERT_TRUE(sheet);
  EXPECT_EQ(sheet->rounds, kMaxTransfers);
  EXPECT_TRUE(validate(*sheet, many));
}

}  // namespace
}  // namespace telesplat::master
