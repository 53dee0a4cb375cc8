// Processes that stand still for a while and go on (SIGSTOP, SIGCONT), and a master that is another one when late tiles
// come.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <csignal>

#include "tests/e2e/faults/fault.h"

namespace telesplat::test {
namespace {

constexpr double kStop_s = 2;

class StoodStill : public ::testing::TestWithParam<const char*> {};

TEST_P(StoodStill, AndGoesOn) {
  const std::string name = GetParam();
  Fault fault(fmt::format("{} stands still for {:.0f} s", name, kStop_s), {"--samplers", "2"});
  ASSERT_TRUE(fault.showing());
  if (name == "viewer-2") fault.start_guest();
  const pid_t pid = fault.pid_of(name);
  ASSERT_GT(pid, 0);
  fault.begins();
  ::kill(pid, SIGSTOP);
  pass(kStop_s);
  ::kill(pid, SIGCONT);
  fault.ends();
  fault.expect_resynchronised();
  if (name == "viewer-2") fault.expect_resynchronised("viewer-2");
  EXPECT_EQ(fault.pid_of(name), pid) << "it is the same one";
  fault.finish();
}

INSTANTIATE_TEST_SUITE_P(Each, StoodStill, ::testing::Values("data", "sampler-1", "packer", "master", "viewer-2"),
                         [](const auto& info) {
                           std::string name = info.param;
                           std::erase_if(name, [](char c) { return !std::isalnum(static_cast<unsigned char>(c)); });
                           return name;
                         });

// The new master counts frames from 1 again: when it comes to the number that the late tiles bear, they must not be
// taken for that frame's, and nothing may wait for ever.
TEST(AnotherMaster, TilesOfTheOneBeforeThatComeLateDoNoHarm) {
  Fault fault("kill -9 of the master while a sampler holds a lease; its tile comes when another master is there",
              {"--samplers", "2"});
  ASSERT_TRUE(fault.showing());
  const pid_t late = fault.pid_of("sampler-2"), master = fault.pid_of("master");
  // The other one would soon sample for it what it has leased.
  const pid_t other = fault.signal("sampler-1", SIGSTOP);
  ASSERT_TRUE(fault.stop_with_a_lease("sampler-2"));
  const double frames_before = fault.run().status().value("frames_completed", 0.0);
  fault.begins();
  ASSERT_EQ(::kill(master, SIGKILL), 0);
  ASSERT_TRUE(fault.wait_new_life("master", master)) << fault.run().program().err();
  ASSERT_TRUE(fault.run().wait_status([](const auto& s) { return process(s, "packer").is_object(); }));
  ::kill(late, SIGCONT);
  ::kill(other, SIGCONT);
  fault.ends();
  fault.expect_resynchronised();
  // On and on, past the frames that were under way.
  const double past = std::min(frames_before + 10, 300.0);
  EXPECT_TRUE(fault.run().wait_status([&](const auto& s) { return s["frames_completed"] > past; }, 60))
      << fault.run().status().dump(1);
  const double updates = value(fault.run().status(), "viewer-1", "updates");
  EXPECT_TRUE(fault.run().wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") > updates + 5; }));
  fault.finish();
}

TEST(AnotherMaster, OfAVolumeCountsFromTheBeginningAndIsShown) {
  TemporaryFolder folder;
  write_volume(folder / "balls.mha");
  Fault fault("kill -9 of the master of a volume's session", {}, folder / "balls.mha");
  ASSERT_TRUE(fault.showing());
  const pid_t master = fault.pid_of("master");
  fault.begins();
  ASSERT_EQ(::kill(master, SIGKILL), 0);
  fault.ends();
  ASSERT_TRUE(fault.wait_new_life("master", master)) << fault.run().program().err();
  fault.expect_updates();
  fault.finish();
}

TEST(ManyDeaths, OfOneSamplerFarApartDoNotEndTheSession) {
  Fault fault("kill -9 of a sampler five times, one after the other", {"--samplers", "2"});
  ASSERT_TRUE(fault.showing());
  fault.begins();
  for (int i = 0; i < 5; ++i) {
    const pid_t victim = fault.signal("sampler-2", SIGKILL);
    ASSERT_GT(victim, 0);
    ASSERT_TRUE(fault.wait_new_life("sampler-2", victim)) << fault.run().program().err();
  }
  fault.ends();
  fault.expect_updates();
  fault.finish();
}

}  // namespace
}  // namespace telesplat::test
