// Two eyes: each mode in a run of real processes; what is recorded, verified and made again of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "client/stereo/mode.h"
#include "common/image/file.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

image::View last_picture(PipelineRun& run) {
  const auto picture = image::read_view(newest_picture(run));
  EXPECT_TRUE(picture) << run.program().err();
  return picture ? *picture : image::View{};
}

// Share of pixels that differ.
double difference(const image::View& a, const image::View& b, int shift) {
  if (a.colour.size() != b.colour.size() || a.colour.empty()) return 1;
  size_t differ = 0;
  for (size_t i = 0; i < a.colour.size(); ++i) differ += (a.colour[i] >> shift & 255) != (b.colour[i] >> shift & 255);
  return double(differ) / double(a.colour.size());
}

image::View half(const image::View& v, bool second) {
  image::View out{v.width / 2, v.height, {}, {}};
  for (int y = 0; y < v.height; ++y)
    for (int x = 0; x < out.width; ++x)
      out.colour.push_back(v.colour[size_t(y) * size_t(v.width) + size_t(x + (second ? out.width : 0))]);
  return out;
}

void write_panel(const std::string& path) {
  std::ofstream(path) << "[panel]\npixels = [480, 300]\neye = [240, 150]\npixel_mm = 1.0\ndistance_m = 0.7\n"
                         "[lines]\npitch_mm = 2.5\ntilt_deg = 9.5\nthickness_mm = 18\nindex = 1.49\n";
}

TEST(Stereo, EyesAreVerifiedEachAndMadeAgain) {
  PipelineRun run({"--stereo", "side-by-side", "--size", "480x200", "--duration", "1.5", "--verify", "10",
                   "--record-every", "1", "--verify-samples", "1", "--fov", "60"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_EQ(run.summary()["stereo"], "side-by-side");
  const auto eyes = run.summary()["quality"]["eyes"];
  ASSERT_TRUE(eyes.contains("left") && eyes.contains("right")) << run.summary()["quality"].dump();
  for (const char* eye : {"left", "right"}) {
    EXPECT_GE(eyes[eye]["views"].get<int>(), 2);
    EXPECT_GT(eyes[eye]["psnr_db"]["median"].get<double>(), 22);
    EXPECT_LT(eyes[eye]["hole_fraction"]["median"].get<double>(), 0.05);
  }
  const auto of_eye = run.column("quality.csv", "eye");
  // A disk that is not fast enough may have lost one eye of a frame.
  EXPECT_NEAR(double(std::count(of_eye.begin(), of_eye.end(), 1)), double(std::count(of_eye.begin(), of_eye.end(), 2)),
              1);
  const auto left = run.column("frames.csv", "left_x"), right = run.column("frames.csv", "right_x"),
             left_z = run.column("frames.csv", "left_z"), right_z = run.column("frames.csv", "right_z");
  for (size_t i = 0; i < left.size(); ++i)
    EXPECT_NEAR(std::hypot(right[i] - left[i], right_z[i] - left_z[i]), 0.064, 1e-6);
  const image::View shown = last_picture(run);
  ASSERT_EQ(shown.width, 480);
  EXPECT_GT(difference(half(shown, false), half(shown, true), 8), 0.05) << "each eye sees something else";
  EXPECT_GT(expect_as_displayed(run, 20), 5u);
}

TEST(Stereo, GlassesAndPanelsShowBothEyes) {
  TemporaryFolder folder;
  write_panel(folder / "panel.toml");
  for (const std::string mode : {"checker", "autostereo"}) {
    std::vector<std::string> flags{"--stereo", mode, "--duration", "0.3", "--trajectory", "still", "--size", "320x200"};
    if (mode == "autostereo") flags.insert(flags.end(), {"--barrier", folder / "panel.toml"});
    PipelineRun run(flags);
    ASSERT_EQ(run.program().wait(), 0) << mode << ": " << run.program().err();
    const image::View shown = last_picture(run);
    EXPECT_EQ(shown.width, mode == "autostereo" ? 480 : 320) << mode;
    EXPECT_EQ(shown.height, mode == "autostereo" ? 300 : 200) << mode;
    EXPECT_EQ(run.summary()["stereo"], mode);
    for (const double v : run.column("frames.csv", "stereo")) EXPECT_EQ(v, double(*stereo::mode_named(mode)));
  }
}

TEST(Stereo, VolumesAreSeenByTwoEyes) {
  TemporaryFolder folder;
  write_volume(folder / "ball.mha");
  PipelineRun run({"--stereo", "top-bottom", "--size", "240x320", "--duration", "1", "--verify", "10"},
                  folder / "ball.mha");
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const auto eyes = run.summary()["quality"]["eyes"];
  for (const char* eye : {"left", "right"}) EXPECT_GT(eyes[eye]["psnr_db"]["median"].get<double>(), 20);
}

TEST(Stereo, PatternsTakeTheScenesPlace) {
  PipelineRun run({"--stereo", "columns", "--stereo-pattern", "calibration", "--duration", "0.3", "--size", "320x200"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const image::View shown = last_picture(run);
  ASSERT_EQ(shown.width, 320);
  EXPECT_EQ(shown.colour[0] & 0xffffff, 0xff0000u);
  EXPECT_EQ(shown.colour[1] & 0xffffff, 0x0000ffu);
}

}  // namespace
}  // namespace telesplat::test
