// `telesplat build` as a person types it: makes a store once, tells where it lies, and refuses what has no store.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "tests/integration/commands/here.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class Build : public testing::Test {
 protected:
  Said build(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), "build");
    arguments.insert(arguments.end(), {"--cache", folder_ / "cache"});
    return telesplat(arguments);
  }
  // Its line tells all parts and an existing store; returns the store.
  std::string built(const std::vector<std::string>& arguments, const std::vector<std::string>& parts) const {
    const Said said = build(arguments);
    EXPECT_EQ(said.code, 0) << said.err;
    EXPECT_EQ(std::count(said.out.begin(), said.out.end(), '\n'), 1) << said.out;
    for (const std::string& part : parts) EXPECT_NE(said.out.find(part), std::string::npos) << said.out;
    const size_t path = said.out.rfind(": ") + 2;
    const std::string store = said.out.substr(path, said.out.size() - path - 1);
    EXPECT_TRUE(fs::exists(store)) << store;
    return store;
  }
  void expect_refused(const std::vector<std::string>& arguments, const std::string& named) const {
    const Said said = build(arguments);
    EXPECT_EQ(said.code, 2) << named;
    EXPECT_NE(said.err.find(named), std::string::npos) << said.err;
    EXPECT_EQ(said.out, "");
  }
  TemporaryFolder folder_;
};

TEST_F(Build, MakesAStoreOncePerSetting) {
  write_terrain(folder_ / "hill.ply", 4), write_volume(folder_ / "balls.mha");
  const std::string first =
      built({folder_ / "hill.ply"}, {"hill.ply: 32 triangles, 0 levels", " bytes a triangle, made in "});
  EXPECT_EQ(built({folder_ / "hill.ply"}, {"32 triangles", ", already there: "}), first);
  EXPECT_NE(built({folder_ / "hill.ply", "--up", "x"}, {"made in "}), first);
  built({folder_ / "balls.mha", "--iso", "100"}, {"balls.mha: ", "made in "});
  const Said inspected = telesplat({"inspect", folder_ / "hill.ply", "--cache", folder_ / "cache"});
  EXPECT_NE(inspected.out.find("from the cache"), std::string::npos) << inspected.out << inspected.err;
  for (const auto& entry : fs::directory_iterator(folder_ / "cache")) EXPECT_NE(entry.path().extension(), ".part");
}

TEST_F(Build, RefusesWhatHasNoStore) {
  write_volume(folder_ / "balls.mha");
  expect_refused({folder_ / "missing.ply"}, "missing.ply: no such file");
  expect_refused({"julia"}, "julia: is a Julia set, which has no chunk store");
  expect_refused({folder_ / "balls.mha"}, "balls.mha: is a volume, which has no chunk store; its surface has one");
  write_terrain(folder_ / "hill.ply", 4);
  expect_refused({folder_ / "hill.ply", "--tf", "skin"}, "--tf");
}

TEST_F(Build, GoesOnWithoutACacheNever) {
  write_terrain(folder_ / "hill.ply", 4);
  std::ofstream(folder_ / "cache") << "a file, not a folder";
  expect_refused({folder_ / "hill.ply"}, "cache cannot be written");
}

}  // namespace
}  // namespace telesplat::test
