// Standard walks cost and show the figures of tests/simulation/figures.json.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/log.h"
#include "tests/simulation/digests.h"
#include "tools/lab/simulation/command.h"
#include "tools/lab/simulation/figures/figures.h"

namespace telesplat::simulation {
namespace {

const auto* const plain_functions = add_plain_functions();

class StandardWalks : public ::testing::TestWithParam<Walk> {};
INSTANTIATE_TEST_SUITE_P(All, StandardWalks, ::testing::ValuesIn(standard_walks()), [](const auto& walk) {
  std::string name = walk.param.name;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

TEST_P(StandardWalks, HaveTheirGoldenFigures) {
  const Walk& walk = GetParam();
  if (!has_data(walk)) GTEST_SKIP() << walk.scenario.file << " is not there (set TELESPLAT_DATA)";
  std::ifstream file("tests/simulation/figures.json");
  const auto all = nlohmann::json::parse(file);
  ASSERT_TRUE(all.contains(walk.name)) << "tools/update-figures writes golden figures of " << walk.name;
  log::initialise("simulation", "off");
  const auto result = run_walk(walk);
  ASSERT_TRUE(result) << result.error().text;
  const auto& failure = result->outcome.failure;
  ASSERT_FALSE(failure) << failure->at_s << " s: " << failure->check << ": " << failure->text;
  expect_digest(golden_digests(), walk.name, result->outcome.digest);
  const Comparison c = compare_figures(walk.name, result->figures, all[walk.name].get<WalkFigures>());
  for (const std::string& line : c.better)
    ADD_FAILURE() << line << ": better. tools/update-figures keeps that, so that it is not lost again";
  for (const std::string& line : c.worse)
    ADD_FAILURE() << line << ": worse. If that is meant, tools/update-figures writes the figures anew";
}

TEST(GoldenFigures, AreComparedWithinTheirTolerances) {
  const WalkFigures golden{{"rays", 1000}, {"updates", 100}, {"holes_percent", 0.5}, {"psnr_db", 30}};
  const auto with = [&](const char* name, double value) {
    WalkFigures now = golden;
    now[name] = value;
    return compare_figures("walk", now, golden);
  };
  for (const auto& [name, as_good, worse, better] : {std::tuple{"rays", 1010, 1011, 989}, {"updates", 99, 98, 102}}) {
    EXPECT_TRUE(with(name, as_good).worse.empty()) << name;
    EXPECT_EQ(with(name, worse).worse.size(), 1u) << name;
    EXPECT_EQ(with(name, better).better.size(), 1u) << name;
    EXPECT_TRUE(with(name, better).worse.empty()) << name;
  }
  EXPECT_TRUE(with("holes_percent", 0.6).worse.empty());
  EXPECT_EQ(with("holes_percent", 0.61).worse, std::vector<std::string>{"walk: holes_percent is 0.61, golden 0.50"});
  EXPECT_TRUE(with("psnr_db", 29.9).worse.empty());
  EXPECT_EQ(with("psnr_db", 29.89).worse.size(), 1u);
  EXPECT_EQ(with("psnr_db", 30.2).better.size(), 1u);
}

TEST(GoldenFigures, AreMissedWhereTheyAreGone) {
  EXPECT_EQ(compare_figures("walk", {}, {{"rays", 5}}).worse, std::vector<std::string>{"walk: rays is missing"});
  EXPECT_EQ(compare_figures("walk", {{"rays", 5}}, {}).worse, std::vector<std::string>{"walk: rays is new"});
}

TEST(GoldenFigures, HaveAWalkALine) {
  EXPECT_EQ(json_of({{"b", {{"rays", 5}, {"psnr_db", 31.2}}}, {"a", {{"first_s", 0.5}}}}),
            "{\n\"a\": {\"first_s\": 0.500},\n\"b\": {\"psnr_db\": 31.20, \"rays\": 5}\n}\n");
}

}  // namespace
}  // namespace telesplat::simulation
