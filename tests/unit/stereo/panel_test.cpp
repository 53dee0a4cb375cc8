// Autostereo panels: their files, their figures, and pictures for them.
#include <gtest/gtest.h>

#include <fstream>

#include "client/stereo/autostereo/interleaver.h"
#include "client/stereo/autostereo/panel_file.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::stereo {
namespace {

Panel small_panel() {
  Panel p;
  p.width = 320, p.height = 40;
  p.lines = {.pitch_m = 0.618e-3, .tilt_deg = 9.5, .gap_m = 0.2e-3, .thickness_m = 4.8e-3, .index = 1.49};
  return p;
}

Result<Panel> read(const std::string& text) {
  const std::string path = tests::own_folder() + "panel.toml";
  std::ofstream(path) << text;
  return read_panel(path);
}

TEST(PanelFile, ReadsWhatItSays) {
  const auto p = read(
      "[panel]\npixels = [1600, 1200]\neye = [640, 480]\npixel_mm = 0.255\nsubpixels = \"bgr\"\ndistance_m = 1\n"
      "[lines]\npitch_mm = 0.5\ntilt_deg = -7\nshift_mm = 0.1\ngap_mm = 1\nthickness_mm = 2\nindex = 1.6\n"
      "opening = 0.3\nguard = 0.1\n");
  ASSERT_TRUE(p) << p.error().text;
  EXPECT_EQ(p->width, 1600);
  EXPECT_EQ(p->eye, (Size{640, 480}));
  EXPECT_DOUBLE_EQ(p->pixel_m, 0.255e-3);
  EXPECT_EQ(p->subpixels, Subpixels::kBgr);
  EXPECT_DOUBLE_EQ(p->lines.tilt_deg, -7);
  EXPECT_DOUBLE_EQ(p->lines.thickness_m, 2e-3);
  EXPECT_DOUBLE_EQ(p->lines.guard, 0.1);
}

TEST(PanelFile, RefusesWhatCannotBe) {
  const std::string good = "[lines]\npitch_mm = 0.5\nthickness_mm = 2\n";
  EXPECT_TRUE(read(good));
  for (const auto& [text, part] :
       {std::pair<std::string, const char*>{good + "[other]\na = 1\n", "[panel] and [lines]"},
        {good + "colour = 3\n", "has no key colour"},
        {good + "index = \"glass\"\n", "4: index: not a number"},
        {good + "tilt_deg = 80\n", "tilt_deg is 80, limits are -60 and 60"},
        {good + "[panel]\npixels = [0, 100]\n", "limits are 1 and"},
        {good + "[panel]\nsubpixels = \"vertical\"\n", "not \"rgb\""},
        {good + "[panel]\ndistance_m = nan\n", "not a number"},
        {"[lines]\npitch_mm = 0.5\n", "needs thickness_mm"},
        {"[lines]\npitch_mm = 0.5\nthickness_mm = 0\n", "both 0"},
        {"[lines\n", "panel.toml:"}}) {
    const auto p = read(text);
    ASSERT_FALSE(p) << text;
    EXPECT_NE(p.error().text.find(part), std::string::npos) << p.error().text;
  }
}

TEST(PanelFile, TheExamplesSuitTheirDistance) {
  for (const auto& [name, eye] : {std::pair{"/personal.toml", Size{1024, 640}}, {"/cylinder.toml", Size{800, 600}}}) {
    const auto p = read_panel(std::string(TELESPLAT_PANELS) + name);
    ASSERT_TRUE(p) << p.error().text;
    EXPECT_EQ(p->eye_size(), eye);
    const PanelFigures f = figures_of(*p, 0.064);
    EXPECT_NEAR(f.best_distance_m, p->distance_m, 0.02 * p->distance_m / 0.7) << name;
    EXPECT_NEAR(f.pixels_a_line, 2.5, 0.01) << name;
    EXPECT_LT(f.crosstalk, 0.01) << name;
    EXPECT_LT(f.dark, 0.2) << name;
  }
}

// On a panel of other geometry, eyes that are too far away see more of each other's picture.
TEST(Panel, CrosstalkGrowsAwayFromTheBestDistance) {
  Panel p = small_panel();
  p.lines.guard = 0;
  const double best = figures_of(p, 0.064).best_distance_m;
  p.distance_m = best;
  const double at_best = figures_of(p, 0.064).crosstalk;
  p.distance_m = 2.2 * best;
  EXPECT_LT(at_best, 0.01);
  EXPECT_GT(figures_of(p, 0.064).crosstalk, at_best + 0.05);
}

TEST(Panel, EyesAreWhereTheirCamerasSeeThroughIt) {
  const Panel p = small_panel();
  const Eyes eyes{glm::dvec3{-0.05, 0.02, 0.6}, glm::dvec3{0.01, 0.03, 0.63}};
  const geometry::Screen screen{{}, p.width_m(), p.height_m()};
  const auto back = eyes_of(p, {geometry::camera_through(screen, eyes[0], 10, 10, 0.01),
                                geometry::camera_through(screen, eyes[1], 10, 10, 0.01)});
  for (size_t i = 0; i < 2; ++i) EXPECT_LT(glm::distance(back[i], eyes[i]), 1e-12);
}

TEST(Interleaver, EachEyeSeesItsOwnPicture) {
  for (const Subpixels subpixels : {Subpixels::kRgb, Subpixels::kBgr, Subpixels::kWhole}) {
    Panel p = small_panel();
    p.subpixels = subpixels;
    if (subpixels == Subpixels::kWhole) p.pixel_m /= 3;
    const Eyes eyes = eyes_before(p, 0.064, figures_of(p, 0.064).best_distance_m);
    Interleaver interleaver(p);
    const image::View left{8, 4, std::vector<uint32_t>(32, 0xffff8040), {}},
        right{8, 4, std::vector<uint32_t>(32, 0xff2060ff), {}};
    image::View both;
    interleaver.compose(eyes, left, right, both);
    ASSERT_EQ(both.width, p.width);
    for (const auto& [eye, colour] : {std::pair{eyes[0], 0xffff8040u}, {eyes[1], 0xff2060ffu}}) {
      const image::View seen = seen_by(p, eye, both);
      int right_pixels = 0;
      for (const uint32_t c : seen.colour) {
        bool same = true;
        for (const int shift : {0, 8, 16})
          same = same && std::abs(int(c >> shift & 255) - int(colour >> shift & 255)) <= 4;
        right_pixels += same;
      }
      EXPECT_GT(double(right_pixels) / double(seen.colour.size()), 0.97);
    }
  }
}

TEST(Interleaver, PicturesAreStretchedLinearly) {
  Panel p = small_panel();
  p.lines.guard = 0;
  const Eyes eyes = eyes_before(p, 0.064, 0.7);
  Interleaver interleaver(p);
  image::View small{2, 1, {0x000000, 0xffffff}, {}}, out;
  interleaver.compose(eyes, small, small, out);
  // From the middle of one to the middle of the other the colour rises evenly; outside it stays the same.
  for (const int x : {0, 79, 120, 160, 200, 240, 319}) {
    const double share = std::clamp((x + 0.5) / 160 - 0.5, 0.0, 1.0);
    for (const int shift : {0, 8, 16}) EXPECT_NEAR(double(out.colour[size_t(x)] >> shift & 255), 255 * share, 1.5) << x;
  }
  image::View same{p.width, p.height, std::vector<uint32_t>(size_t(p.width) * size_t(p.height)), {}};
  for (size_t i = 0; i < same.colour.size(); ++i) same.colour[i] = uint32_t(i * 2654435761u) >> 8;
  interleaver.compose(eyes, same, same, out);
  for (size_t i = 0; i < same.colour.size(); ++i) ASSERT_EQ(out.colour[i], same.colour[i] | 0xff000000u) << i;
}

}  // namespace
}  // namespace telesplat::stereo
