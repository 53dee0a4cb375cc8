// Where a run looks from and what lies behind the data: flags, pictures, the record and its verification.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/image/file.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// The byte of a PNG's header that tells its channels: 2 RGB, 6 RGBA.
int colour_type(const std::string& png) { return read_text(png).substr(25, 1) == "\x06" ? 6 : 2; }

TEST(Views, TheEndOfATrajectoryIsSaidBeforeItComes) {
  TemporaryFolder folder;
  const std::string path = folder / "short.csv";
  std::ofstream(path) << "t_s,px,py,pz,qw,qx,qy,qz\n0,0,0.4,1,1,0,0,0\n0.4,0.1,0.4,1,1,0,0,0\n";
  PipelineRun run({"--trajectory", path, "--duration", "0.8"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_NE(run.program().err().find("the trajectory ends after 0.4 s; the head stands still then"), std::string::npos)
      << run.program().err();
  EXPECT_NEAR(run.column("frames.csv", "px").back(), 0.1, 1e-6);
  PipelineRun alone({"--trajectory", path});
  ASSERT_EQ(alone.program().wait(), 0) << alone.program().err();
  EXPECT_EQ(alone.program().err().find("the trajectory ends"), std::string::npos);
  EXPECT_NEAR(alone.column("frames.csv", "t_s").back(), 0.4, 0.15);
}

TEST(Views, AnEyeStandsWhereItIsToldAndABackgroundIsBehindPicturesOfBothRenderers) {
  for (const char* renderer : {"cpu", "gl"}) {
    PipelineRun run({"--background", "#fee0c0", "--renderer", renderer, "--duration", "0.3", "--eye", "0.2,0.3,0.9",
                     "--look-at", "0.2,0.3,0"});
    const int code = run.program().wait();
    if (code != 0 && std::string(renderer) == "gl") GTEST_SKIP() << run.program().err();
    ASSERT_EQ(code, 0) << run.program().err();
    for (const auto& [name, value] : {std::pair{"px", 0.2}, {"py", 0.3}, {"pz", 0.9}, {"qw", 1.0}}) {
      const auto column = run.column("frames.csv", name);
      ASSERT_FALSE(column.empty());
      for (const double v : column) ASSERT_NEAR(v, value, 1e-6) << name;
    }
    const std::string path = newest_picture(run);
    const auto picture = image::read_view(path);
    ASSERT_TRUE(picture) << picture.error().text;
    EXPECT_EQ(picture->colour.front() & 0xffffff, 0xfee0c0u) << renderer;
    EXPECT_EQ(picture->colour.back() & 0xffffff, 0xfee0c0u) << renderer;
    EXPECT_EQ(colour_type(path), 2);
    EXPECT_NE(read_text(run.out() + "/session.toml").find("background = \"#fee0c0\""), std::string::npos);
  }
}

// The background does not change the comparison with direct rendering.
TEST(Views, HolesOfAVolumeDoNotDependOnTheBackground) {
  TemporaryFolder folder;
  write_volume(folder / "ball.mha");
  double holes[2], psnr_db[2];
  int n = 0;
  // The volume is about as bright as the second of these.
  for (const char* colour : {"black", "#c8c8c8"}) {
    PipelineRun run({"--background", colour, "--duration", "1", "--trajectory", "still", "--verify", "15",
                     "--sampling-size", "480x300"},
                    folder / "ball.mha");
    ASSERT_EQ(run.program().wait(), 0) << run.program().err();
    const auto quality = run.summary()["quality"];
    EXPECT_EQ(quality["views_without_object"], 0);
    holes[n] = quality["hole_fraction"]["median"];
    psnr_db[n++] = quality["psnr_db"]["median"];
  }
  EXPECT_NEAR(holes[0], holes[1], 1e-3);
  EXPECT_NEAR(psnr_db[0], psnr_db[1], 6);
}

}  // namespace
}  // namespace telesplat::test
