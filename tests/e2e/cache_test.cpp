// The cache of chunk stores, as people meet it: told when it grows, listed, bounded, cleared.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class Cache : public testing::Test {
 protected:
  std::string cache(std::vector<std::string> arguments, int code = 0) {
    arguments.insert(arguments.begin(), "cache");
    arguments.insert(arguments.end(), {"--cache", folder_ / "cache"});
    Program program("telesplat", std::move(arguments), folder_ / "telesplat");
    EXPECT_EQ(program.wait(30), code) << program.err();
    return code == 0 ? program.out() : program.err();
  }
  // A data server that has opened the mesh.
  std::unique_ptr<Program> data(const std::string& mesh) {
    auto out = std::make_unique<Program>(
        "telesplat-data",
        std::vector<std::string>{folder_ / mesh, "--cache", folder_ / "cache", "--report-progress", "--name", "data"},
        folder_ / std::to_string(started_++));
    EXPECT_TRUE(wait_until([&] { return out->err().find("ready in") != std::string::npos; })) << out->err();
    return out;
  }
  TemporaryFolder folder_;
  int started_ = 0;
};

TEST_F(Cache, ProgressIsToldInWordsAndGrowthOnce) {
  write_terrain(folder_ / "terrain.ply", 50), write_terrain(folder_ / "small.ply", 4);
  EXPECT_EQ(data("small.ply")->out().find("note "), std::string::npos) << "a small cache is not worth a word";
  for (const auto& entry : fs::directory_iterator(folder_ / "cache"))
    if (entry.path().extension() == ".mesh") fs::resize_file(entry.path(), 1'200'000'000);
  auto first = data("terrain.ply");
  EXPECT_TRUE(wait_until([&] { return first->out().find("\nnote ") != std::string::npos; }));
  const std::string told = first->out();
  for (const char* part :
       {"progress identifying terrain.ply 1.000", "progress reading terrain.ply 1.000",
        "progress sorting into chunks 1.000", "progress writing the store 1.000",
        "note telesplat: the cache holds 2 stores, 1.2 GB, ", "telesplat cache limit 20GB bounds it"})
    EXPECT_NE(told.find(part), std::string::npos) << part << " in\n" << told;
  for (const char* part : {"hash", "classify", "progress write ", "progress chunk "})
    EXPECT_EQ(told.find(part), std::string::npos) << part << " in\n" << told;
  first.reset();
  const auto again = data("terrain.ply");
  EXPECT_EQ(again->out().find("note "), std::string::npos) << again->out();
}

TEST_F(Cache, IsListedBoundedAndCleared) {
  EXPECT_NE(cache({"list"}).find("0 stores, 0 bytes"), std::string::npos);
  write_terrain(folder_ / "a.ply", 20);
  write_terrain(folder_ / "b.ply", 30);
  data("b.ply");
  const auto used = data("a.ply");
  const std::string list = cache({"list"});
  for (const char* part :
       {"in use", "/a.ply (ply, 800 triangles)", "/b.ply (ply, 1800 triangles)", "2 stores, ", "; no limit"})
    EXPECT_NE(list.find(part), std::string::npos) << part << " in\n" << list;
  EXPECT_LT(list.find("a.ply"), list.find("b.ply")) << "what was used last comes first";
  EXPECT_NE(cache({"clear"}).find("1 store removed"), std::string::npos) << "the other one is in use";
  EXPECT_NE(cache({"list"}).find("a.ply"), std::string::npos);
  EXPECT_NE(cache({"limit", "1.5GB"}).find("limit 1.5 GB"), std::string::npos);
  EXPECT_EQ(cache({"limit"}), "limit 1.5 GB\n");
  EXPECT_EQ(cache({"limit", "none"}), "no limit\n");
  EXPECT_EQ(cache({"limit", "much"}, 2), "telesplat: size much: is not a size such as 20GB, 500MB or 1.5TB\n");
}

}  // namespace
}  // namespace telesplat::test
