// Headsets, with the test runtime in place of one: real processes, every call of OpenXR, faults.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/image/file.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// `telesplat view --xr` of a terrain with the test runtime, told this.
class XrRun {
 public:
  explicit XrRun(const std::string& told, const std::vector<std::string>& arguments = {"--duration", "3"}) {
    setenv("XR_RUNTIME_JSON", (std::string(TELESPLAT_BIN) + "/telesplat_xr_test.json").c_str(), 1);
    setenv("TELESPLAT_XR_TEST", ("rate=30;size=320x320;out=" + (folder_ / "xr") + ";" + told).c_str(), 1);
    std::vector<std::string> all{"--xr", "--xr-origin", "0,0,0"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    run_ = std::make_unique<PipelineRun>(all, "", "view");
    unsetenv("XR_RUNTIME_JSON");
    unsetenv("TELESPLAT_XR_TEST");
  }
  PipelineRun& run() { return *run_; }
  std::string said() const { return run_->program().out() + run_->program().err(); }
  nlohmann::json calls() const { return nlohmann::json::parse(read_text(folder_ / "xr/calls.json"), nullptr, false); }
  std::vector<std::string> pictures(const std::string& eye) const {
    std::vector<std::string> out;
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder_ / "xr", error))
      if (entry.path().filename().string().find(eye + ".png") != std::string::npos) out.push_back(entry.path());
    std::sort(out.begin(), out.end());
    return out;
  }

 private:
  TemporaryFolder folder_;
  std::unique_ptr<PipelineRun> run_;
};

// Pixels that are not the background's.
double covered(const image::View& picture) {
  size_t n = 0;
  for (const uint32_t c : picture.colour) n += (c & 0xffffff) != 0x141820;
  return double(n) / double(picture.colour.size());
}

TEST(Xr, BothEyesSeeTheDataAndEveryCallIsRight) {
  XrRun xr("every=15;exr=on;pressed=2-2.5");
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  const auto calls = xr.calls();
  ASSERT_TRUE(calls.is_object());
  EXPECT_EQ(calls["mistakes"], nlohmann::json::array());
  for (const char* name : {"xrCreateInstance",
                           "xrGetSystem",
                           "xrCreateSession",
                           "xrBeginSession",
                           "xrWaitFrame",
                           "xrBeginFrame",
                           "xrLocateViews",
                           "xrLocateSpace",
                           "xrAcquireSwapchainImage",
                           "xrWaitSwapchainImage",
                           "xrReleaseSwapchainImage",
                           "xrEndFrame",
                           "xrSyncActions",
                           "xrGetActionStatePose",
                           "xrGetActionStateBoolean",
                           "xrRequestExitSession",
                           "xrEndSession",
                           "xrDestroySwapchain",
                           "xrDestroySpace",
                           "xrDestroySession",
                           "xrDestroyInstance"})
    EXPECT_GE(calls["calls"].value(name, 0), 1) << name;
  EXPECT_GT(calls["frames_shown"], 30);
  EXPECT_NE(xr.said().find("the right hand points at"), std::string::npos) << xr.said();

  const auto left = xr.pictures("left"), right = xr.pictures("right");
  ASSERT_FALSE(left.empty());
  ASSERT_EQ(left.size(), right.size());
  const auto a = image::read_view(left.back()), b = image::read_view(right.back());
  ASSERT_TRUE(a && b);
  EXPECT_GT(covered(*a), 0.1) << left.back();
  EXPECT_GT(covered(*b), 0.1) << right.back();
  EXPECT_NE(a->colour, b->colour) << "two eyes see two pictures";
  // Depth is that of the room: the data stand around its middle, the eye half a metre and more away.
  const auto deep = image::read_view(left.back().substr(0, left.back().size() - 3) + "exr");
  ASSERT_TRUE(deep);
  ASSERT_FALSE(deep->depth_m.empty());
  float nearest = 1e9f;
  for (const float z : deep->depth_m) nearest = std::min(nearest, z);
  EXPECT_GT(nearest, 0.1f);
  EXPECT_LT(nearest, 1.5f);
  EXPECT_EQ(xr.run().column("frames.csv", "lead_ms").size(), xr.run().column("frames.csv", "missed").size());
}

TEST(Xr, ALostSessionIsOpenedAnew) {
  XrRun xr("lost=1", {"--duration", "4"});
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  const auto calls = xr.calls();
  EXPECT_EQ(calls["mistakes"], nlohmann::json::array());
  EXPECT_GE(calls["calls"]["xrCreateSession"], 2);
  EXPECT_GE(calls["frames_shown"], 30);
  EXPECT_NE(xr.said().find("the headset's session is over: the runtime lost the headset"), std::string::npos)
      << xr.said();
}

TEST(Xr, ARuntimeThatGoesAwayIsFoundAgain) {
  XrRun xr("gone=1", {"--duration", "4"});
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  EXPECT_GE(xr.calls()["calls"]["xrCreateInstance"], 2);
  EXPECT_NE(xr.said().find("the runtime goes away"), std::string::npos) << xr.said();
}

TEST(Xr, ACallThatFailsEndsTheSessionAndNotTheViewer) {
  XrRun xr("fails=xrEndFrame@1", {"--duration", "4"});
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  EXPECT_GE(xr.calls()["calls"]["xrCreateSession"], 2);
  EXPECT_NE(xr.said().find("xrEndFrame failed with XR_ERROR_RUNTIME_FAILURE"), std::string::npos) << xr.said();
}

TEST(Xr, RecentringIsToldAndFollowed) {
  XrRun xr("trajectory=still;recentre=1:0.2,0,0");
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  EXPECT_NE(xr.said().find("the headset's space is centred anew"), std::string::npos) << xr.said();
  const auto x = xr.run().column("frames.csv", "px");
  ASSERT_GT(x.size(), 20u);
  EXPECT_NEAR(x.back(), -0.2, 0.01) << "the head stands 0.2 m to the left of the new middle";
}

TEST(Xr, WhoTakesTheHeadsetOffQuits) {
  XrRun xr("exit=1.5", {});
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  EXPECT_EQ(xr.calls()["mistakes"], nlohmann::json::array());
  EXPECT_GE(xr.calls()["calls"]["xrEndSession"], 1);
}

// And while frames are hidden, discarded and without a head.
TEST(Xr, ItWorksWithoutStageDepthAndHands) {
  XrRun xr("stage=off;depth=off;hands=off;every=20;hidden=0.5-1;discard=7;untracked=1.5-2");
  ASSERT_EQ(xr.run().program().wait(), 0) << xr.said();
  EXPECT_EQ(xr.calls()["mistakes"], nlohmann::json::array()) << "a frame that is not shown is not drawn";
  EXPECT_GT(xr.calls()["frames_shown"], 20);
  EXPECT_FALSE(xr.pictures("right").empty());
}

TEST(Xr, WithoutARuntimeItSaysSo) {
  TemporaryFolder folder;
  setenv("XR_RUNTIME_JSON", (folder / "nothing.json").c_str(), 1);
  PipelineRun run({"--xr"}, "", "view");
  unsetenv("XR_RUNTIME_JSON");
  EXPECT_NE(run.program().wait(), 0);
  EXPECT_NE(run.program().err().find("--xr"), std::string::npos) << run.program().err();
  PipelineRun wrong({"--xr", "--trajectory", "orbit"}, "", "view");
  EXPECT_EQ(wrong.program().wait(), 2);
  EXPECT_NE(wrong.program().complaint().find("--trajectory has no meaning with --xr"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::test
