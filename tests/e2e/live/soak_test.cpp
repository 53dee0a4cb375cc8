// tools/lab/soak itself, for some seconds in which nothing happens: that a scene begins, is displayed and ends. What it
// demands of an hour cannot be told from these.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

TEST(Soak, ItsSceneBeginsIsDisplayedAndEnds) {
  const TemporaryFolder folder;
  const std::string out = folder / "soak";
  Program soak(TELESPLAT_SOURCE "/tools/lab/soak",
               {"--minutes", "0.12", "--calm", "1000", "--scene", "mesh", "--build", TELESPLAT_BIN "/..", "--out", out},
               folder / "told");
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

}  // namespace
}  // namespace telesplat::test
