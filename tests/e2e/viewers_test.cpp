// Viewers that fall behind or come late end with the packer's points.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

bool same_points(const nlohmann::json& status, const std::string& viewer) {
  const double points = value(status, "packer", "points");
  return points > 0 && value(status, viewer, "points") == points;
}

std::vector<std::string> viewer_arguments(PipelineRun& run, const std::string& name, const std::string& trajectory,
                                          const std::string& duration) {
  return {"--master", run.master(),   "--name",   name,         "--size", "160x100",      "--sampling-size",
          "320x200",  "--trajectory", trajectory, "--duration", duration, "--target-fps", "10"};
}

TEST(Viewers, AViewerThatWasStoppedResynchronises) {
  PipelineRun run({"--duration", "0", "--trajectory", "still"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  pid_t viewer = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    const auto p = process(s, "viewer-1");
    return same_points(s, "viewer-1") && (viewer = p["pid"].template get<pid_t>()) > 0;
  }));
  double sequence = 0, points = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    return points = value(s, "packer", "points"), (sequence = value(s, "packer", "sequence")) > 0;
  }));
  ::kill(viewer, SIGSTOP);
  {
    // Another one walks around meanwhile, so that there is something to miss.
    Program other("telesplat-viewer", viewer_arguments(run, "viewer-2", "orbit", "2"), run.folder() / "viewer-2");
    EXPECT_EQ(other.wait(60), 0) << other.err();
  }
  EXPECT_TRUE(std::filesystem::exists(run.out() + "/viewer-2/images")) << "what it records stands in its own folder";
  EXPECT_TRUE(std::filesystem::exists(run.out() + "/spool")) << "and what the first records stays";
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "packer", "points") > points && value(s, "packer", "sequence") > sequence;
  }));
  ::kill(viewer, SIGCONT);
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-1", "points") > points && same_points(s, "viewer-1");
  })) << run.status().dump(1);
  run.program().signal(SIGINT);
  EXPECT_EQ(run.program().wait(60), 0) << "a run without an end";
  EXPECT_TRUE(run.all_gone());
}

TEST(Viewers, TheDeathOfOneDoesNotEndTheSessionOfTheOther) {
  PipelineRun run({"--duration", "0", "--trajectory", "still", "--viewers", "2"});
  pid_t viewer = 0;
  ASSERT_TRUE(run.wait_status([&](const auto& s) {
    const auto p = process(s, "viewer-1");
    return same_points(s, "viewer-2") && p.is_object() && (viewer = p["pid"].template get<pid_t>()) > 0;
  })) << run.program().err();
  ::kill(viewer, SIGABRT);
  const std::string line = "viewer-1 ended with code 134; the session goes on for viewer-2";
  EXPECT_TRUE(wait_until([&] { return run.program().err().find(line) != std::string::npos; })) << run.program().err();
  const double frames = value(run.status(), "viewer-2", "frames");
  EXPECT_TRUE(run.wait_status([&](const auto& s) {
    return value(s, "viewer-2", "frames") > frames && !process(s, "viewer-1").is_object();
  })) << run.status().dump(1);
  EXPECT_EQ(run.stop(), 1) << run.program().err();
  EXPECT_NE(run.program().err().find("a viewer died"), std::string::npos) << run.program().err();
  EXPECT_EQ(run.summary()["errors"]["viewers_lost"], 1);
  EXPECT_GT(run.summary()["frames"], 0);
  EXPECT_TRUE(run.all_gone());
}

TEST(Viewers, TheDeathOfTheLastEndsItsRunWithOne) {
  PipelineRun run({"--duration", "0", "--trajectory", "still"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  ::kill(process(run.status(), "viewer-1")["pid"].get<pid_t>(), SIGKILL);
  EXPECT_EQ(run.program().wait(60), 1);
  EXPECT_NE(run.program().err().find("viewer-1 ended with code 137"), std::string::npos) << run.program().err();
  EXPECT_TRUE(run.summary().is_object());
  EXPECT_TRUE(run.all_gone());
}

}  // namespace
}  // namespace telesplat::test
