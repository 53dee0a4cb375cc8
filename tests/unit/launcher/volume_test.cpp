// Records of volume runs and pictures of walls, as the launcher reads and makes them.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/image/file.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/run/wall.h"
#include "tools/telesplat/scene/volume_scene.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

using tools::csv_fields;
using viewer::WallLayout;

Result<WallLayout> parse_wall(const std::string& text) { return viewer::parse_wall(text, kMaxViewers); }

// The scene of a run folder; it is a volume.
struct RecordedVolume {
  std::unique_ptr<Scene> scene;
  const data::DataOptions* operator->() const { return &scene->options(); }
  Result<VolumeScene::Epoch> at(EpochId epoch) const { return static_cast<const VolumeScene&>(*scene).at(epoch); }
};
Result<RecordedVolume> read_recorded_volume(const std::string& directory) {
  auto scene = recorded_scene(directory);
  if (!scene) return scene.error();
  EXPECT_EQ((*scene)->kind(), scene::Kind::kVolume);
  return RecordedVolume{std::move(*scene)};
}

TEST(CsvLine, QuotedTextsHoldCommasAndQuotes) {
  using Fields = std::vector<std::string>;
  EXPECT_EQ(csv_fields("a,b,,c"), (Fields{"a", "b", "", "c"}));
  EXPECT_EQ(csv_fields(""), (Fields{""}));
  EXPECT_EQ(csv_fields("1,\"0:#000000:0,80:#ff8800:0.1\",2"), (Fields{"1", "0:#000000:0,80:#ff8800:0.1", "2"}));
  EXPECT_EQ(csv_fields("\"a \"\"b\"\" c\",\"\""), (Fields{"a \"b\" c", ""}));
  EXPECT_EQ(csv_fields("a\"b,c"), (Fields{"a\"b", "c"}));
  EXPECT_FALSE(csv_fields("1,\"open"));
  EXPECT_FALSE(csv_fields("\"a\"b,c"));
}

TEST(Wall, LayoutsAreReadOrRefused) {
  const auto wall = parse_wall("3x2");
  ASSERT_TRUE(wall.ok());
  EXPECT_EQ(wall->columns, 3);
  EXPECT_EQ(wall->rows, 2);
  for (const char* text : {"", "2", "2x", "x2", "0x1", "1x0", "-1x2", "2x1x1", "65x1", "9x8", "2 x1 ", "99999999999x1"})
    EXPECT_FALSE(parse_wall(text).ok()) << text;
}

class RunFolder : public testing::Test {
 protected:
  RunFolder() {
    path_ = (fs::temp_directory_path() /
             (std::string("telesplat-volume-run-") + testing::UnitTest::GetInstance()->current_test_info()->name()))
                .string();
    fs::remove_all(path_);
    fs::create_directories(path_ + "/images");
  }
  ~RunFolder() override { fs::remove_all(path_); }
  void write(const std::string& name, const std::string& text) const { std::ofstream(path_ + "/" + name) << text; }
  void picture(int viewer, int frame, int width, int height, uint32_t colour) const {
    const std::string folder = viewer_directory(path_, viewer) + "/images";
    fs::create_directories(folder);
    ASSERT_TRUE(image::write_png(folder + "/frame-" + std::to_string(frame) + ".png",
                                 {width, height, std::vector<uint32_t>(size_t(width) * height, colour), {}}));
  }
  std::string path_;
};

TEST_F(RunFolder, TheNewestPicturesOfAllTilesBecomeOne) {
  picture(1, 9, 4, 3, 0xff0000);
  picture(1, 10, 4, 3, 0x00ff00);  // a later frame than 9, though an earlier name
  picture(2, 7, 4, 3, 0x0000ff);
  write("frames.csv", "t_s,viewer,frame\n0.5,viewer-1,9\n1.25,viewer-1,10\n1.5,viewer-2,7\n2,viewer-2,8\n");
  const auto tiles = stitch_wall(path_, {2, 1, 0, {}});
  ASSERT_TRUE(tiles.ok()) << tiles.error().text;
  ASSERT_EQ(tiles->size(), 2u);
  EXPECT_EQ((*tiles)[0].frame, 10u);
  EXPECT_EQ((*tiles)[0].t_s, 1.25);
  EXPECT_EQ((*tiles)[1].viewer, "viewer-2");
  EXPECT_EQ((*tiles)[1].t_s, 1.5);
  const auto wall = image::read_view(path_ + "/images/wall.png");
  ASSERT_TRUE(wall.ok());
  ASSERT_EQ(wall->width, 8);
  ASSERT_EQ(wall->height, 3);
  EXPECT_EQ(wall->colour[3], 0x00ff00u);
  EXPECT_EQ(wall->colour[4], 0x0000ffu);
}

TEST_F(RunFolder, TilesThatLackOrDoNotFitAreNamed) {
  picture(1, 1, 4, 3, 0);
  auto tiles = stitch_wall(path_, {1, 2, 0, {}});
  ASSERT_FALSE(tiles.ok());
  EXPECT_NE(tiles.error().text.find("viewer-2"), std::string::npos) << tiles.error().text;
  picture(2, 1, 5, 3, 0);
  tiles = stitch_wall(path_, {1, 2, 0, {}});
  ASSERT_FALSE(tiles.ok());
  EXPECT_NE(tiles.error().text.find("5x3"), std::string::npos) << tiles.error().text;
}

TEST_F(RunFolder, EpochsTellTransferFunctionAndStep) {
  write("session.toml",
        "[scene]\nfile = \"/a/b.nrrd\"\nroom_size = 0.5\nup = \"y\"\nkind = \"volume\"\nlighting = \"off\"\nraw = "
        "\"4x4x4:u8\"\ntf = \"bone\"\n");
  const auto plain = read_recorded_volume(path_);
  ASSERT_TRUE(plain.ok()) << plain.error().text;
  EXPECT_EQ((*plain)->scene, "/a/b.nrrd");
  EXPECT_EQ((*plain)->mesh.up, "y");
  EXPECT_EQ((*plain)->mesh.room_size_m, 0.5);
  EXPECT_EQ((*plain)->volume.raw, "4x4x4:u8");
  EXPECT_EQ((*plain)->volume.transfer, "bone");
  EXPECT_FALSE((*plain)->volume.lit);
  ASSERT_TRUE(plain->at(EpochId{5}).ok());
  EXPECT_EQ(plain->at(EpochId{5})->transfer, "");

  write("epochs.csv", "epoch,t_s,volume.step,transfer\n1,0,0,\"0:#000000:0,9:#ffffff:1\"\n2,1.5,3,\"1:#ff0000:0.5\"\n");
  const auto run = read_recorded_volume(path_);
  ASSERT_TRUE(run.ok()) << run.error().text;
  EXPECT_EQ(run->at(EpochId{1})->transfer, "0:#000000:0,9:#ffffff:1");
  EXPECT_EQ(run->at(EpochId{2})->step, 3);
  const auto unknown = run->at(EpochId{3});
  ASSERT_FALSE(unknown.ok());
  EXPECT_NE(unknown.error().text.find("epoch 3"), std::string::npos);
}

TEST_F(RunFolder, WrongEpochsNameTheLine) {
  write("session.toml", "[scene]\nfile = \"/a/b.nrrd\"\nkind = \"volume\"\n");
  const std::vector<std::pair<std::string, const char*>> cases{
      {"", "is empty"},
      {"epoch,t_s,transfer\n", "no column volume.step"},
      {"epoch,volume.step\n", "no column transfer"},
      {"epoch,volume.step,transfer\n1,0\n", ":2: 2 values instead of 3"},
      {"epoch,volume.step,transfer\n1,0,\"open\n", ":2: a quoted text"},
      {"epoch,volume.step,transfer\n1,0,a\nx,0,a\n", ":3: epoch is \"x\""},
      {"epoch,volume.step,transfer\n-1,0,a\n", ":2: epoch is -1, limits"},
      {"epoch,volume.step,transfer\n1,4096,a\n", ":2: volume.step is 4096, limits are 0..4095"},
      {"epoch,volume.step,transfer\n1,nan,a\n", ":2: volume.step is \"nan\""},
  };
  for (const auto& [text, part] : cases) {
    write("epochs.csv", text);
    const auto run = read_recorded_volume(path_);
    ASSERT_FALSE(run.ok()) << text;
    EXPECT_NE(run.error().text.find("epochs.csv"), std::string::npos) << run.error().text;
    EXPECT_NE(run.error().text.find(part), std::string::npos) << run.error().text;
  }
}

}  // namespace
}  // namespace telesplat::launcher
