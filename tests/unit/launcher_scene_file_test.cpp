#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tools/telesplat/scene_file.h"

namespace telesplat::launcher {
namespace {

class SceneFile : public testing::Test {
 protected:
  std::string write(const std::string& text) {
    path_ =
        (std::filesystem::temp_directory_path() /
         (std::string("telesplat-scene-") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".toml"))
            .string();
    std::ofstream(path_) << text;
    return path_;
  }
  ~SceneFile() override { std::filesystem::remove(path_); }
  std::string path_;
};

TEST_F(SceneFile, KeysBecomeFlagsAndTheFileIsRelativeToTheScene) {
  const auto flags = read_scene_file(write(
      "[scene]\nfile = \"a.ply\"\nroom_size = 1.5\n[view]\nexr = true\nframes = 7\n[packing]\nmax_points = 5e6\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  EXPECT_EQ(flags->back(), (std::filesystem::path(path_).parent_path() / "a.ply").string());
  for (const char* flag : {"--room-size=1.5", "--exr", "--frames=7", "--packing.max_points=5000000"})
    EXPECT_NE(std::find(flags->begin(), flags->end(), flag), flags->end()) << flag;
}

TEST_F(SceneFile, SwitchesCanBeTurnedOff) {
  const auto flags = read_scene_file(
      write("file = \"a.ply\"\n[view]\ndetail_budget = false\nspeed_detail = true\nfinish = false\nexr = false\n"));
  ASSERT_TRUE(flags.ok()) << flags.error().text;
  for (const char* flag : {"--detail-budget=off", "--speed-detail=on", "--finish=off"})
    EXPECT_NE(std::find(flags->begin(), flags->end(), flag), flags->end()) << flag;
  EXPECT_EQ(flags->size(), 4u);  // and the file; exr = false is no flag
}

TEST_F(SceneFile, TheCommandLineComesAfterTheFile) {
  std::string program = "telesplat", run = "run", flag = "--frames=9",
              scene = write("file = \"a.ply\"\n[view]\nframes = 7\n");
  char* argv[] = {program.data(), run.data(), scene.data(), flag.data()};
  const auto arguments = expand_scene_file(4, argv);
  ASSERT_TRUE(arguments.ok());
  EXPECT_EQ(arguments->front(), "run");
  const auto first = std::find(arguments->begin(), arguments->end(), "--frames=7"),
             second = std::find(arguments->begin(), arguments->end(), "--frames=9");
  EXPECT_LT(first, second);
  EXPECT_NE(second, arguments->end());
}

TEST_F(SceneFile, ErrorsNameFileAndPlace) {
  for (const char* text : {"file = ", "up = \"z\"", "[scene]\nfile = \"a.ply\"\n[scene.deeper]\nx = 1\n",
                           "file = \"a.ply\"\nsize = [1, 2]\n"}) {
    const auto flags = read_scene_file(write(text));
    ASSERT_FALSE(flags.ok()) << text;
    EXPECT_NE(flags.error().text.find(path_), std::string::npos) << flags.error().text;
  }
  EXPECT_FALSE(read_scene_file("/nonexistent.toml").ok());
}

}  // namespace
}  // namespace telesplat::launcher
