// Verification of displayed frames after a run: its references, its rows, its part of summary.json.
#include "tools/telesplat/run/verify.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/viewer/record/frame_spool.h"
#include "tests/support/files/data_files.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using data::test::TempFolder;

constexpr float kNothing = std::numeric_limits<float>::infinity();
constexpr uint32_t kGrey = 0x808080;

// Grey to the left of u = 0, 2 m away; background to the right of it.
class HalfAPicture : public DirectScene {
 public:
  explicit HalfAPicture(bool surface = true) : surface_(surface) {}
  Result<image::View> draw(const geometry::Camera& camera, const image::ShadingParameters& shading, EpochId epoch,
                           double) override {
    if (epoch.value > 7) return Error{"epoch 8 is not known"};
    image::View out{camera.width, camera.height, {}, {}};
    for (int y = 0; y < camera.height; ++y)
      for (int x = 0; x < camera.width; ++x) {
        const bool there = camera.left + (x + 0.5) / camera.focal_x() < -1e-12;
        out.colour.push_back(there ? kGrey : shading.background);
        out.depth_m.push_back(there ? 2 : kNothing);
      }
    return out;
  }
  bool has_surface() const override { return surface_; }
  std::string size() const override { return "half a picture"; }

 private:
  bool surface_;
};

class VerifyRun : public ::testing::Test {
 protected:
  VerifyRun() {
    fs::create_directories(out() + "/images");
    std::ofstream(out() + "/summary.json") << R"({"schema": 2, "quality": null, "errors": {}})";
  }
  std::string out() const { return folder_ / "run"; }

  // 21 x 10 pixels: half of each pixel in the middle column is grey.
  viewer::SpooledFrame frame(uint64_t number, int samples = 16) {
    const auto camera = geometry::make_camera({}, 90, 21, 10);
    auto drawn = scene_.draw_reference(camera, {}, {1}, samples);
    for (size_t i = 0; i < drawn->hits.size(); ++i)
      if (drawn->hits[i] > 0) drawn->view.depth_m[i] = 2;
    return {number, 0.25 * double(number), viewer::kVerify, camera, std::move(drawn->view), {1}, {}, {}};
  }
  void spool(std::vector<viewer::SpooledFrame> frames) {
    auto spool = viewer::FrameSpool::open(out() + "/spool", 100);
    ASSERT_TRUE(spool);
    for (auto& f : frames) (*spool)->exchange(std::move(f));
    (*spool)->flush();
  }
  Status verify(DirectScene& scene, int samples, size_t stop_after = 1000) {
    size_t seen = 0;
    return verify_run(
        out(), scene, {{}, samples}, [&](size_t done, size_t) { seen = done; }, [&] { return seen >= stop_after; });
  }
  std::vector<std::vector<std::string>> rows() const {
    std::ifstream in(out() + "/quality.csv");
    std::vector<std::vector<std::string>> out;
    for (std::string line; std::getline(in, line);) {
      std::vector<std::string> cells{""};
      for (const char c : line)
        if (c == ',')
          cells.emplace_back();
        else
          cells.back() += c;
      out.push_back(cells);
    }
    return out;
  }
  nlohmann::json quality() const {
    std::ifstream in(out() + "/summary.json");
    return nlohmann::json::parse(in)["quality"];
  }

  TempFolder folder_;
  HalfAPicture scene_;
};

TEST_F(VerifyRun, TheReferenceHasAsManyRaysAsAskedFor) {
  for (const int samples : {1, 16}) {
    spool({frame(4)});
    ASSERT_TRUE(verify(scene_, samples));
    const auto r = rows();
    ASSERT_EQ(r.size(), 2u);
    EXPECT_EQ(r[0][2], "samples");
    EXPECT_EQ(r[1][2], std::to_string(samples));
    EXPECT_EQ(r[1][7], "100") << "those of the middle column are half data";
    EXPECT_EQ(quality()["samples"], samples);
    if (samples == 16) {
      EXPECT_EQ(r[1][3], "99.000");
      EXPECT_EQ(quality()["flip"]["max"], 0);
    } else {
      EXPECT_LT(std::stod(r[1][3]), 40) << "the displayed edge is smooth, that of the reference is not";
      EXPECT_GT(double(quality()["flip"]["median"]), 0);
    }
  }
}

TEST_F(VerifyRun, FramesInARowAreMeasuredInTime) {
  auto first = frame(4), second = frame(5), third = frame(9);
  for (auto* f : {&first, &second}) {
    f->view.depth_m[2 * 21 + 3] = kNothing;
    f->view.colour[2 * 21 + 3] = 0;
  }
  first.view.depth_m[7 * 21 + 3] = kNothing;
  first.view.colour[7 * 21 + 3] = kGrey - 0x303030;
  spool({first, second, third});
  ASSERT_TRUE(verify(scene_, 16));
  const auto r = rows();
  ASSERT_EQ(r.size(), 4u);
  EXPECT_EQ((std::vector<std::string>(r[0].end() - 5, r[0].end())),
            (std::vector<std::string>{"flicker", "popping", "holes_followed", "holes_closed", "eye"}));
  for (const auto& alone : {r[1], r[3]})
    EXPECT_EQ((std::vector<std::string>(alone.end() - 5, alone.end())),
              (std::vector<std::string>{"", "", "", "", "0"}));
  EXPECT_NEAR(std::stod(r[2][10]), 48 / 110.0, 1e-4) << "one pixel came back by 48 steps";
  EXPECT_NEAR(std::stod(r[2][11]), 48 / 64.0, 1e-4) << "in a block of 64";
  EXPECT_EQ(r[2][12], "2");
  EXPECT_EQ(r[2][13], "1");

  const auto q = quality();
  EXPECT_EQ(q["views"], 3);
  EXPECT_NEAR(double(q["flicker"]["median"]), 48 / 110.0, 1e-6);
  EXPECT_NEAR(double(q["popping"]["median"]), 48 / 64.0, 1e-6);
  EXPECT_NEAR(double(q["hole_lifetime_ms"]), 500, 1e-6) << "two holes for 0.25 s, of which one closed";
  EXPECT_EQ(q["last_view"]["psnr_db"], 99);
  EXPECT_FALSE(fs::exists(out() + "/spool"));
  for (const char* name : {"worst-000004", "last-000009"})
    EXPECT_TRUE(fs::exists(out() + "/images/verify-" + name + ".png")) << name;
}

TEST_F(VerifyRun, WhatHasNoSurfaceIsComparedWithOneRay) {
  HalfAPicture volume(false);
  auto first = frame(0, 1), second = frame(1, 1);
  first.view.colour[5] = 0;
  spool({first, second});
  ASSERT_TRUE(verify(volume, 16));
  const auto r = rows();
  ASSERT_EQ(r.size(), 3u);
  EXPECT_EQ(r[1][2], "1");
  EXPECT_GT(std::stod(r[2][10]), 0);
  EXPECT_EQ(r[2][12], "");
  EXPECT_TRUE(quality()["hole_lifetime_ms"].is_null());
}

TEST_F(VerifyRun, NothingIsSaidOfWhatWasNotMeasured) {
  auto away = frame(3);
  away.camera.left += 3, away.camera.right += 3;
  away.view = scene_.draw_reference(away.camera, {}, {1}, 1)->view;
  spool({away});
  ASSERT_TRUE(verify(scene_, 4));
  const auto q = quality();
  EXPECT_EQ(q["views"], 0);
  EXPECT_EQ(q["views_without_object"], 1);
  for (const char* key : {"psnr_db", "ssim", "flip", "hole_fraction", "flicker", "popping", "hole_lifetime_ms"})
    EXPECT_TRUE(q[key].is_null()) << key;
}

TEST_F(VerifyRun, ToldToStopItKeepsWhatItHas) {
  spool({frame(0), frame(1), frame(2)});
  ASSERT_TRUE(verify(scene_, 4, 2));
  EXPECT_EQ(rows().size(), 3u);
  EXPECT_EQ(quality()["views"], 2);
}

TEST_F(VerifyRun, ErrorsAreOneLine) {
  auto later = frame(0);
  later.epoch = {8};
  spool({later});
  const Status s = verify(scene_, 16);
  ASSERT_FALSE(s);
  EXPECT_EQ(s.error().text, "epoch 8 is not known");
}

TEST(HoleLifetime, IsHolesOverHolesThatCloseInASecond) {
  std::vector<VerifiedView> views(3);
  EXPECT_FALSE(hole_lifetime_ms(views));
  views[1].change = {0.02, {}, image::HoleFates{300, 30}};
  views[2].change = {0.01, {}, image::HoleFates{100, 0}};
  EXPECT_NEAR(*hole_lifetime_ms(views), 1e3 * (300 * 0.02 + 100 * 0.01) / 30, 1e-9);
  views[1].change->holes->closed = 0;
  EXPECT_FALSE(hole_lifetime_ms(views)) << "none closed: longer than can be told";
}

}  // namespace
}  // namespace telesplat::launcher
