// tools/lab/soak itself, for some seconds in which nothing happens: that each of its scenes begins, is displayed and
// ends. What it demands of an hour cannot be told from these.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

class Soak : public ::testing::TestWithParam<const char*> {
 protected:
  TemporaryFolder folder_;
};

TEST_P(Soak, ItsSceneBeginsIsDisplayedAndEnds) {
  const std::string out = folder_ / "soak";
  Program soak(
      TELESPLAT_SOURCE "/tools/lab/soak",
      {"--minutes", "0.12", "--calm", "1000", "--scene", GetParam(), "--build", TELESPLAT_BIN "/..", "--out", out},
      folder_ / "told");
  soak.wait(120);
  std::ifstream file(out + "/verdict.json");
  ASSERT_TRUE(file) << soak.err();
  const auto verdict = nlohmann::json::parse(file);
  ASSERT_EQ(verdict["scenes"].size(), 1u);
  const auto& scene = verdict["scenes"][0];
  EXPECT_EQ(scene["problems"].dump(), "[]");
  for (const auto& row : scene["measures"])
    if (row["what"] == "view updates") EXPECT_EQ(row["ok"], true) << row.dump();
  EXPECT_TRUE(std::ifstream(out + "/soak.html"));
}

INSTANTIATE_TEST_SUITE_P(Scenes, Soak, ::testing::Values("mesh", "julia", "volume"),
                         [](const auto& info) { return std::string(info.param); });

}  // namespace
}  // namespace telesplat::test
