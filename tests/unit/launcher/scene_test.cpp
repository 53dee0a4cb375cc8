// The launcher's results for flags: the scene, the arguments of processes, the content of session.toml.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "common/net/master_address.h"
#include "common/options/parser.h"
#include "services/data/kinds.h"
#include "services/data/record.h"
#include "services/master/master_record.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class Scenes : public testing::Test {
 protected:
  Scenes() {
    folder_ = (fs::temp_directory_path() /
               (std::string("telesplat-scenes-") + testing::UnitTest::GetInstance()->current_test_info()->name()))
                  .string();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    std::ofstream(file("cube.raw"), std::ios::binary) << std::string(16 * 16 * 16, 'a');
    std::ofstream(file("mesh.ply")) << "ply\n";
  }
  ~Scenes() override { fs::remove_all(folder_); }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }

  // Reads a command line like `telesplat run`.
  static Result<std::shared_ptr<Scene>> settled(RunOptions& options, const std::vector<std::string>& arguments) {
    options::Parser parser("run");
    parser.add(table(options));
    parser.parse_or_exit("run", arguments);
    return settle(options, parser.given());
  }
  static bool holds(const std::vector<std::string>& list, const std::string& text) {
    return std::find(list.begin(), list.end(), text) != list.end();
  }
  std::string folder_;
};

TEST_F(Scenes, ARawVolumesSurfaceIsAMesh) {
  RunOptions o;
  const auto scene = settled(o, {file("cube.raw"), "--raw=16x16x16:u8", "--iso=90"});
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  EXPECT_EQ((*scene)->kind(), scene::Kind::kMesh);
  const auto told = data_arguments(o, 0);
  for (const char* flag : {"--raw=16x16x16:u8", "--iso=90"}) EXPECT_TRUE(holds(told, flag)) << flag;
  EXPECT_TRUE(holds(told, file("cube.raw")));
}

TEST_F(Scenes, ASessionOfPicturesOpensNoVolume) {
  RunOptions shown, volume, mesh;
  shown.viewer.coupling.mode = "images";
  const auto balls = settled(volume, {file("cube.raw"), "--raw=16x16x16:u8"}), land = settled(mesh, {file("mesh.ply")});
  ASSERT_TRUE(balls.ok() && land.ok());
  const Status refused = check_pictures(shown, balls->get());
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("slice images"), std::string::npos) << refused.error().text;
  EXPECT_TRUE(check_pictures(shown, land->get()));
  shown.viewer.coupling.mode = "async";
  EXPECT_TRUE(check_pictures(shown, balls->get()));
}

TEST_F(Scenes, WithoutASceneTheSessionThatTheEnvironmentNamesIsJoined) {
  setenv(net::kMasterVariable, "tcp://leader:7700", 1);
  RunOptions joined, told, own;
  const bool joins = settled(joined, {}).ok(), joins_another = settled(told, {"--master=tcp://other:1"}).ok(),
             starts = settled(own, {file("cube.raw"), "--raw=16x16x16:u8"}).ok();
  unsetenv(net::kMasterVariable);
  EXPECT_TRUE(joins && joins_another && starts);
  EXPECT_EQ(joined.join_master, "tcp://leader:7700");
  EXPECT_EQ(told.join_master, "tcp://other:1");
  EXPECT_EQ(own.join_master, "");
  RunOptions neither;
  EXPECT_FALSE(settled(neither, {}).ok());
}

TEST_F(Scenes, WhatSessionTomlKeepsMakesTheSameSceneAgain) {
  RunOptions o;
  const auto scene = settled(o, {file("cube.raw"), "--raw=16x16x16:u8", "--iso=90.5", "--up=-y", "--no-cache"});
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  std::ofstream(file("session.toml")) << data::scene_lines(o.data, (*scene)->kind());
  const auto again = recorded_scene(folder_);
  ASSERT_TRUE(again.ok()) << again.error().text;
  EXPECT_EQ((*again)->kind(), scene::Kind::kMesh);
  const auto& options = (*again)->options();
  EXPECT_EQ(options.scene, file("cube.raw"));
  EXPECT_EQ(options.volume.raw, "16x16x16:u8");
  EXPECT_EQ(options.mesh.iso, 90.5);
  EXPECT_EQ(options.mesh.up, "-y");
  EXPECT_FALSE(options.mesh.use_cache);
}

// A run folder may be a stranger's, and rebuilt data go into the cache.
TEST_F(Scenes, TheCacheOfARecordIsNotUsed) {
  std::ofstream(file("session.toml"))
      << "[scene]\nkind = \"mesh\"\nfile = \"a.ply\"\ncache = \"/elsewhere\"\nup = \"z\"\n";
  const auto scene = recorded_scene(folder_);
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  EXPECT_EQ((*scene)->options().mesh.cache_dir, "");
  EXPECT_EQ((*scene)->options().mesh.up, "z");
}

// The master accepts only known keys for session.toml.
TEST(ToldKeys, AreAllThatDataServersAndViewersRecord) {
  const auto is_told = [](const std::string& role, const std::string& key) {
    for (const auto& table : master::told_tables(role))
      if (std::find(table.keys.begin(), table.keys.end(), key) != table.keys.end()) return true;
    return false;
  };
  data::DataOptions data;
  viewer::ViewerOptions viewer;
  for (const auto& [role, table] : {std::pair("data", data::scene_table(data)), {"viewer", viewer::view_table(viewer)}})
    for (const options::Row& row : table)
      if (row.reach == options::Reach::kRecorded)
        EXPECT_TRUE(is_told(role, options::key_of(row))) << role << ": " << options::name_of(row);
}

TEST_F(Scenes, AJuliaSetIsRecordedWithItsParameters) {
  RunOptions o;
  const auto scene = settled(o, {"julia", "--preset=wings", "--iterations=33", "--room-size=0.5"});
  ASSERT_TRUE(scene.ok()) << scene.error().text;
  const auto served = data::open(o.data, [](const char*, double) {});
  ASSERT_TRUE(served.ok()) << served.error().text;
  std::ofstream(file("session.toml")) << data::record_of(o.data, **served);
  const auto again = recorded_scene(folder_);
  ASSERT_TRUE(again.ok()) << again.error().text;
  EXPECT_EQ((*again)->kind(), scene::Kind::kJulia);
  EXPECT_EQ((*again)->name(), (*scene)->name());
  EXPECT_NE((*again)->describe_record().find("33"), std::string::npos);
  EXPECT_FALSE((*again)->move_to("elsewhere.ply").ok());
}

TEST_F(Scenes, FlagsThatDoNotFitAreRefused) {
  const std::vector<std::pair<std::vector<std::string>, const char*>> cases{
      {{file("mesh.ply"), "--data-servers=2"}, "--data-servers"},
      {{file("mesh.ply"), "--tf=bone"}, "--tf"},
      {{file("cube.raw"), "--raw=16x16x16:u8", "--splat=disc"}, "--splat"},
      {{file("cube.raw"), "--raw=16x16x16:u8", "--record-depth"}, "--record-depth"},
      {{file("cube.raw"), "--raw=16x16x16:u8", "--sampler=ray"}, "--sampler"},
      {{file("cube.raw"), "--raw=16x16x16:u8", "--c.x=0.3"}, "cube.raw"},
      {{"julia", "--iso=3"}, "--iso"},
      {{"julia", "--series-rate=3"}, "--series-rate"},
      {{file("mesh.ply"), "--iterations=9"}, "--iterations"},
      {{"--master=tcp://127.0.0.1:1", "--tf=bone"}, "no scene"},
      {{"--master=tcp://127.0.0.1:1", "--c=0,0,0,0"}, "ctl set"},
      {{file("mesh.ply"), "--wall=2x1", "--viewers=3"}, "--viewers 3"},
      {{file("mesh.ply"), "--verify-samples=12"}, "--verify-samples: 12 rays"},
      {{file("mesh.ply"), "--coupling=images", "--stereo=side-by-side"}, "--stereo"},
      {{file("mesh.ply"), "--coupling=images", "--wall=2x1"}, "--wall"},
      {{file("mesh.ply"), "--coupling=images", "--background=transparent"}, "no alpha"},
      {{file("mesh.ply"), "--coupling=images", "--movie=" + file("m.mp4"), "--out=" + file("run")}, "recorded points"},
      {{}, "a scene is needed"},
  };
  for (const auto& [arguments, part] : cases) {
    RunOptions o;
    const auto scene = settled(o, arguments);
    ASSERT_FALSE(scene.ok()) << part;
    EXPECT_NE(scene.error().text.find(part), std::string::npos) << scene.error().text;
  }
}

TEST_F(Scenes, NumbersOfARunHaveLimits) {
  RunOptions o;
  const auto rows = table(o);
  for (const auto& [flag, text] : {std::pair{"--samplers", "two"},
                                   {"--samplers", "99"},
                                   {"--iso", "nan"},
                                   {"--room-size", "nan"},
                                   {"--image-quality", "0"},
                                   {"--image-samples", "2"}}) {
    const auto* row = options::find(rows, flag);
    ASSERT_NE(row, nullptr) << flag;
    EXPECT_FALSE(options::set(*row, text).ok()) << flag << " " << text;
  }
}

// Each flag of a service reaches its process, though the launcher names none of them.
TEST_F(Scenes, EveryFlagOfAServiceReachesItsProcess) {
  RunOptions o;
  ASSERT_TRUE(settled(o, {file("mesh.ply"), "--up=z", "--least-detail=0.5", "--detail-budget=off", "--exr",
                          "--packing.max_points=5", "--packing.redundancy=keep", "--tile-size=64", "--sampler=raster",
                          "--sampler-threads=3", "--record-depth", "--out=" + file("run")})
                  .ok());
  EXPECT_TRUE(holds(data_arguments(o, 0), "--up=z"));
  for (const char* flag : {"--least-detail=0.5", "--detail-budget=off", "--exr"})
    EXPECT_TRUE(holds(viewer_arguments(o, 1, 0), flag)) << flag;
  for (const char* flag : {"--packing.max_points=5", "--packing.redundancy=keep", "--tile-size=64"})
    EXPECT_TRUE(holds(master_arguments(o), flag)) << flag;
  for (const char* flag : {"--sampler=raster", "--threads=3"}) EXPECT_TRUE(holds(sampler_arguments(o), flag)) << flag;
  EXPECT_TRUE(holds(packer_arguments(o), "--record-depth=" + file("run/depth")));
}

TEST_F(Scenes, AWallHasAViewerATile) {
  RunOptions o;
  ASSERT_TRUE(settled(o, {file("mesh.ply"), "--wall=2x1", "--verify=5", "--out=" + file("run")}).ok());
  EXPECT_EQ(o.viewers, 2);
  const auto second = viewer_arguments(o, 2, 0);
  EXPECT_TRUE(holds(second, "--wall-tile=1"));
  EXPECT_FALSE(holds(second, "--verify=5")) << "only the first one's frames are verified";
  EXPECT_TRUE(holds(viewer_arguments(o, 1, 0), "--verify=5"));
}

TEST_F(Scenes, EveryKindHasARow) {
  for (const scene::Kind kind : scene::kKinds) {
    const auto rows = std::count_if(scene_kinds().begin(), scene_kinds().end(),
                                    [&](const SceneKind& row) { return row.kind == kind; });
    EXPECT_EQ(rows, 1) << scene::name_of(kind);
  }
}

TEST_F(Scenes, FlagsOfVolumesNeedASceneWhereASessionIsJoined) {
  for (const char* flag : {"--data-servers=2", "--layers=8", "--tf=hot"}) {
    RunOptions o;
    EXPECT_FALSE(settled(o, {"--master=tcp://127.0.0.1:1", flag})) << flag;
  }
}

}  // namespace
}  // namespace telesplat::launcher
