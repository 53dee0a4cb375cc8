// The kind of a data set, the options that fit it, and its facts for the session.
#include "services/data/kinds.h"

#include <gtest/gtest.h>

#include "common/core/utf8.h"
#include "common/options/parser.h"
#include "services/data/data_service.h"
#include "services/data/served.h"
#include "tests/support/files/data_files.h"

namespace telesplat::data::test {
namespace {

using scene::Kind;

class Kinds : public testing::Test {
 protected:
  DataOptions of(const std::string& scene) const {
    DataOptions o;
    o.scene = scene;
    o.mesh.use_cache = scene == julia::kSceneWord || scene.ends_with(".raw");  // others have no cache
    return o;
  }
  // 4 x 4 x 4 voxels, 0 in one half and 200 in the other.
  std::string raw_volume() const { return folder_.write("half.raw", std::string(32, '\0') + std::string(32, '\xc8')); }
  std::string mesh(const std::string& name = "grid.ply") const { return folder_.write(name, ply_of(wavy_grid(4))); }
  static std::string refusal(const DataOptions& o) {
    const auto kind = kind_of(o);
    EXPECT_FALSE(kind.ok());
    const auto opened = open(o, [](const char*, double) {});
    EXPECT_FALSE(opened.ok());
    if (kind || opened) return "";
    EXPECT_EQ(kind.error().text, opened.error().text) << "launcher and data server must decide alike";
    return kind.error().text;
  }
  const TempFolder folder_;
};

TEST_F(Kinds, AreToldByContentAndByOptions) {
  EXPECT_EQ(*kind_of(of(mesh())), Kind::kMesh);
  EXPECT_EQ(*kind_of(of("julia")), Kind::kJulia);
  DataOptions volume = of(raw_volume());
  EXPECT_EQ(refusal(volume), volume.scene + ": raw voxels need --raw SIZExSIZExSIZE:TYPE; it has 64 bytes");
  volume.volume.raw = "4x4x4:u8";
  EXPECT_EQ(*kind_of(volume), Kind::kVolume);
}

TEST_F(Kinds, TheSurfaceOfARawVolumeIsAMesh) {
  DataOptions o = of(raw_volume());
  o.volume.raw = "4x4x4:u8", o.mesh.iso = 100, o.mesh.use_cache = false;
  const auto kind = kind_of(o);
  ASSERT_TRUE(kind.ok()) << kind.error().text;
  EXPECT_EQ(*kind, Kind::kMesh);
  const auto served = open(o, [](const char*, double) {});
  ASSERT_TRUE(served.ok()) << served.error().text;
  EXPECT_EQ((*served)->kind(), Kind::kMesh);
  const wire::Hello hello = make_hello(**served, "data", "inproc://chunks");
  EXPECT_EQ(hello.facts.at("kind"), "mesh");
  EXPECT_EQ(hello.facts.at("format"), "iso");
  EXPECT_EQ(hello.endpoints.at("chunks"), "inproc://chunks");
}

TEST_F(Kinds, ASurfaceStandsWhereItsVolumeStands) {
  DataOptions o = of(raw_volume());
  o.volume.raw = "4x4x4:u8";
  const auto volume = open(o, [](const char*, double) {});
  o.mesh.iso = 100, o.mesh.use_cache = false;
  const auto surface = open(o, [](const char*, double) {});
  ASSERT_TRUE(volume.ok() && surface.ok());
  EXPECT_EQ(make_hello(**volume, "data", "").box_room, (geometry::Box{{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}}));
  // Half-way up, from the first voxel's centre to the last one's, 0.2 m a voxel; z is up, as in the volume.
  const geometry::Box box = make_hello(**surface, "data", "").box_room;
  for (int a = 0; a < 3; ++a) {
    EXPECT_NEAR(box.lo[a], a == 1 ? 0 : -0.3, 1e-6);
    EXPECT_NEAR(box.hi[a], a == 1 ? 0 : 0.3, 1e-6);
  }
}

TEST_F(Kinds, WhatIsThereButNoSceneIsRefused) {
  EXPECT_EQ(refusal(of(folder_ / "none.nrrd")), (folder_ / "none.nrrd") + ": no such file");
  EXPECT_NE(refusal(of(folder_ / "")).find("is a folder, and not one of DICOM slices"), std::string::npos);
  DataOptions surface = of(mesh());
  surface.mesh.iso = 1;
  EXPECT_EQ(refusal(surface), "--iso: " + surface.scene + " is no volume");
}

TEST_F(Kinds, OptionsOfOthersAreRefused) {
  DataOptions tf = of(mesh());
  tf.volume.transfer = "bone";
  EXPECT_EQ(refusal(tf), "--tf: " + tf.scene + " is no volume but a mesh");
  DataOptions part = of(mesh());
  part.volume.part = "0/2";
  EXPECT_EQ(refusal(part), "--part: " + part.scene + " is no volume but a mesh");
  DataOptions constant = of(mesh());
  constant.julia.c = "0,0,0,0";
  EXPECT_EQ(refusal(constant), "--c: " + constant.scene + " is no Julia set but a mesh");
  DataOptions julia = of("julia");
  julia.volume.raw = "4x4x4:u8";
  EXPECT_EQ(refusal(julia), "--raw: julia is a Julia set, which has no --raw");
  DataOptions upright = of("julia");
  upright.mesh.up = "z";
  EXPECT_EQ(refusal(upright), "--up: julia is a Julia set, which has no --up");
  DataOptions kept = of("julia");
  kept.mesh.cache_dir = "somewhere";
  EXPECT_TRUE(kind_of(kept).ok()) << "a loop over files needs no exception";
  DataOptions lit = of(raw_volume());
  lit.volume.raw = "4x4x4:u8", lit.mesh.iso = 100, lit.mesh.use_cache = false, lit.volume.lit = false;
  EXPECT_EQ(refusal(lit), "--lighting: " + lit.scene + " is shown as a surface (--iso), which has no --lighting");
  DataOptions draped = of(raw_volume());
  draped.volume.raw = "4x4x4:u8", draped.mesh.elevation.texture = "photo.png";
  EXPECT_EQ(refusal(draped), "--texture: " + draped.scene + " is no mesh but a volume");
}

TEST_F(Kinds, TheSessionIsToldUtf8WhateverTheFilesName) {
  const auto served = open(of(mesh("caf\xe9.ply")), [](const char*, double) {});
  ASSERT_TRUE(served.ok()) << served.error().text;
  const wire::Hello hello = make_hello(**served, "data-\xe9", "");
  EXPECT_EQ(hello.facts.at("scene"), "caf\xef\xbf\xbd.ply");
  EXPECT_TRUE(valid_utf8(hello.name));
  for (const auto& [name, value] : hello.facts) EXPECT_TRUE(valid_utf8(value)) << name;
  EXPECT_TRUE(hello.endpoints.empty());
}

TEST_F(Kinds, AJuliaSetHasNothingToAskFor) {
  const auto served = open(of("julia"), [](const char*, double) {});
  ASSERT_TRUE(served.ok()) << served.error().text;
  EXPECT_TRUE((*served)->requests().endpoint.empty());
  const wire::Hello hello = make_hello(**served, "data", "");
  EXPECT_EQ(hello.facts.at("kind"), "julia");
  EXPECT_EQ(hello.facts.at("scene"), "julia (coral)");
  EXPECT_FALSE(hello.parameters.empty());
  EXPECT_FALSE(hello.box_room.empty());
}

// ---- the table of flags --------------------------------------------------------------------------------------------

TEST(DataFlags, WhatTheLauncherHandsOnIsReadAgain) {
  DataOptions o, usual;
  o.mesh.room_size_m = 0.5, o.mesh.up = "-z", o.mesh.use_cache = false, o.mesh.iso = 1.5;
  o.mesh.elevation.z_scale = 2, o.mesh.elevation.texture = "photo.png";
  o.volume.raw = "4x4x4:u8", o.volume.transfer = "bone", o.volume.lit = false, o.volume.steps_per_s = 0;
  o.julia.c = "0.1,0.2,0.3,0.4";
  const auto arguments = options::arguments(scene_table(o), scene_table(usual));
  EXPECT_EQ(arguments, (std::vector<std::string>{"--room-size=0.5", "--up=-z", "--z-scale=2", "--texture=photo.png",
                                                 "--no-cache", "--raw=4x4x4:u8", "--iso=1.5", "--tf=bone",
                                                 "--lighting=off", "--series-rate=0", "--c=0.1,0.2,0.3,0.4"}));
  DataServiceOptions again;
  options::Parser parser("data");
  parser.add(table(again));
  auto all = arguments;
  all.push_back("scene.raw");
  parser.parse_or_exit("data", all);
  EXPECT_EQ(again.scene, "scene.raw");
  EXPECT_EQ(options::arguments(scene_table(again), scene_table(usual)), arguments);
}

TEST(DataFlags, AFolderForTheCacheIsNamedWhole) {
  DataOptions o, usual;
  ASSERT_TRUE(options::set(*options::find(scene_table(o), "--cache"), "some/cache").ok());
  EXPECT_EQ(o.mesh.cache_dir, (std::filesystem::current_path() / "some/cache").string());
  EXPECT_EQ(options::recorded(scene_table(o), scene_table(usual)),
            "cache = " + options::quoted(o.mesh.cache_dir) + "\n");
}

TEST(DataFlags, ASessionsFileKeepsWhatPicturesDependOn) {
  DataOptions o, usual;
  o.mesh.room_size_m = 0.5, o.mesh.use_cache = false, o.mesh.iso = 1.5, o.volume.raw = "4x4x4:u8";
  o.volume.transfer = "bone", o.volume.lit = false, o.volume.steps_per_s = 3;
  EXPECT_EQ(options::recorded(scene_table(o), scene_table(usual)),
            "room_size = 0.5\nno_cache = true\nraw = \"4x4x4:u8\"\niso = 1.5\ntf = \"bone\"\nlighting = \"off\"\n");
}

}  // namespace
}  // namespace telesplat::data::test
