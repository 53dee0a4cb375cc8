// Simulated links: the relay told to end, and runs whose processes are apart.
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <filesystem>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

// The relay that a run has started.
pid_t relay_of(pid_t launcher) {
  for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
    if (!std::isdigit(entry.path().filename().string()[0])) continue;
    const std::string stat = read_text(entry.path().string() + "/stat");
    const size_t end = stat.rfind(')');
    if (end == std::string::npos || stat.find("(telesplat-wan-r") == std::string::npos) continue;
    char state = 0;
    int parent = 0;
    if (std::sscanf(stat.c_str() + end + 1, " %c %d", &state, &parent) == 2 && parent == launcher && state != 'Z')
      return std::atoi(entry.path().filename().c_str());
  }
  return 0;
}

// The launcher sends the signal twice, and the second may come when the relay has left its loop.
TEST(Relay, TellsWhatPassedHoweverOftenItIsToldToEnd) {
  TemporaryFolder folder;
  for (int i = 0; i < 20; ++i) {
    Program relay("telesplat-wan-relay", {"--socks", "127.0.0.1:*"}, folder / "relay");
    EXPECT_TRUE(wait_until([&] { return relay.out().find('\n') != std::string::npos; })) << relay.err();
    relay.signal(SIGUSR1);
    EXPECT_TRUE(wait_until([&] { return relay.err().find("0 connections") != std::string::npos; })) << relay.err();
    do relay.signal(SIGTERM);
    while (relay.wait(0) < 0);
    const std::string told = relay.err();
    EXPECT_NE(told.find("to the near side"), told.rfind("to the near side")) << told;
  }
}

TEST(Links, ARunThroughALinkShowsItsPictureAndTellsOfIt) {
  PipelineRun run({"--duration", "4", "--link", "60ms:50mbit"});
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["links"], (nlohmann::json{{"viewer-1", "rtt=60ms,rate=50mbit"}}));
  EXPECT_GT(s["updates"], 3);
  EXPECT_GT(s["points_cached"], 1000);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  // Request, plan, sampling and the way back: no update can be quicker than the link.
  for (const double ms : run.column("updates.csv", "latency_ms")) EXPECT_GE(ms, 60);
  EXPECT_NE(read_text(run.out() + "/session.toml").find("\"link\" = \"rtt=60ms,rate=50mbit\""), std::string::npos);
  EXPECT_NE(run.program().out().find("rtt=60ms,rate=50mbit (of viewer-1)"), std::string::npos) << run.program().out();
  // All that the viewer received went through it.
  const std::string log = read_text(run.out() + "/logs/link-viewer-1.log");
  EXPECT_NE(log.find("to the near side"), std::string::npos) << log;
}

TEST(Links, AVolumeAndItsDataServersGoThroughTheirLinks) {
  TemporaryFolder folder;
  const std::string volume = folder / "balls.mha";
  write_volume(volume);
  PipelineRun run({"--duration", "3", "--link", "rtt=40ms", "--link", "data:rtt=30ms", "--link", "sampler:20ms"},
                  volume);
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  EXPECT_EQ(s["links"], (nlohmann::json{{"viewer-1", "rtt=40ms"}, {"sampler-1", "rtt=20ms data:rtt=30ms"}}));
  EXPECT_GT(s["updates"], 3);
  for (const double ms : run.column("updates.csv", "latency_ms")) EXPECT_GE(ms, 60) << "both links, there and back";
  for (const char* link : {"viewer-1", "sampler-1", "data"}) {
    const std::string log = read_text(run.out() + "/logs/link-" + link + ".log");
    EXPECT_NE(log.find("to the near side"), std::string::npos) << link << ": " << log;
    EXPECT_EQ(log.find("to the near side 0.000 MB"), std::string::npos) << link << ": " << log;
  }
}

// A packer comes back at other ports; a viewer that gave up the old ones while they were refused died of it.
TEST(Links, ARelayAndAPackerThatAreStartedAgainAreFoundThroughTheLink) {
  PipelineRun run({"--duration", "0", "--link", "rtt=20ms"});
  ASSERT_TRUE(run.wait_showing()) << run.program().err();
  const pid_t relay = relay_of(run.program().pid());
  ASSERT_GT(relay, 0);
  ::kill(relay, SIGKILL);
  EXPECT_TRUE(wait_until([&] {
    const pid_t next = relay_of(run.program().pid());
    return next > 0 && next != relay;
  }));
  EXPECT_NE(run.program().err().find("link-viewer-1 died (signal 9); the run goes on, it is started again"),
            std::string::npos)
      << run.program().err();
  const auto expect_updates = [&] {
    double updates = -1;
    EXPECT_TRUE(run.wait_status([&](const auto& s) {
      if (updates < 0) updates = value(s, "viewer-1", "updates");
      return value(s, "viewer-1", "updates") > updates + 3;
    })) << run.program().err();
  };
  expect_updates();
  const auto packer = [&] {
    pid_t pid = 0;
    run.wait_status([&](const auto& s) {
      const auto p = process(s, "packer");
      if (p.is_object() && p["alive"]) pid = p["pid"].template get<pid_t>();
      return pid > 0;
    });
    return pid;
  };
  for (int times = 0; times < 2; ++times) {
    const pid_t victim = packer();
    ASSERT_GT(victim, 0);
    ::kill(victim, SIGKILL);
    EXPECT_TRUE(wait_until([&] {
      const pid_t next = packer();
      return next > 0 && next != victim;
    }));
    expect_updates();
  }
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
}

// Errors within bounds, and none of them where the head has come to rest.
TEST(Links, PointsHaveErrorsUntilTheHeadRests) {
  auto flags = kComesToRest;
  flags.insert(flags.end(), {"--size", "640x400", "--link", "20ms", "--depth-error", "1/16", "--normal-error", "2",
                             "--colour-error", "off"});
  PipelineRun run(flags);
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  const auto s = run.summary();
  ASSERT_TRUE(s.is_object());
  const auto errors = s["errors_allowed"];
  ASSERT_TRUE(errors.is_object());
  EXPECT_GT(errors["patches"], 0);
  EXPECT_GT(errors["patches_refined"], 0);
  EXPECT_GT(errors["depth_m"], 0);
  EXPECT_LT(errors["depth_m"], 1e-3);
  EXPECT_GT(errors["normal_deg"], 0);
  EXPECT_EQ(errors["colour"], 0);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  const auto depth = run.column("tiles.csv", "depth_error_m");
  EXPECT_EQ(*std::max_element(depth.begin(), depth.end()), double(errors["depth_m"]));
}

}  // namespace
}  // namespace telesplat::test
