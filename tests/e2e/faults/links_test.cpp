// Links that break: a sampler that does not reach the data server, a viewer's link that is cut and healed, a slow one,
// a viewer that reads nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <csignal>
#include <filesystem>

#include "common/net/socket.h"
#include "tests/e2e/faults/fault.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// The relay that the launcher has started for this link.
pid_t relay_called(const std::string& name, const std::string& run_folder) {
  for (const auto& entry : fs::directory_iterator("/proc")) {
    if (!std::isdigit(static_cast<unsigned char>(entry.path().filename().string()[0]))) continue;
    std::string command = read_text(entry.path().string() + "/cmdline");
    std::replace(command.begin(), command.end(), '\0', ' ');
    if (command.find("telesplat-wan-relay") == std::string::npos || command.find(name) == std::string::npos) continue;
    // Its log lies in the run's folder.
    std::error_code error;
    if (fs::read_symlink(entry.path() / "fd/2", error).string().starts_with(run_folder))
      return std::atoi(entry.path().filename().c_str());
  }
  return 0;
}

TEST(CutOff, ASamplerFromTheDataServerAlone) {
  Fault fault("a sampler is cut off from the data server alone", {"--samplers", "1"});
  ASSERT_TRUE(fault.showing());
  // Messages that precede the first lease request pass; chunks do not.
  auto relay = std::make_unique<OwnRelay>(fault, kTrickle);
  const std::string at = relay->address();
  fault.begins();
  Program guest("telesplat-sampler",
                {"--master", fault.run().master(), "--name", "cut-off", "--threads", "1", "--via", "data=" + at},
                fault.run().folder() / "cut-off");
  ASSERT_TRUE(fault.run().wait_status([](const auto& s) {
    const auto p = process(s, "cut-off");
    return p.is_object() && p["leases"] > 0;
  })) << guest.err();
  // Other samplers take the tiles that it cannot sample: views are completed on and on.
  fault.ends();
  fault.expect_updates();
  for (int i = 0; i < 3; ++i) {
    const double frames = fault.run().status().value("frames_completed", 0.0);
    EXPECT_TRUE(fault.run().wait_status([&](const auto& s) { return s["frames_completed"] > frames + 3; }))
        << fault.run().status().dump(1);
  }
  EXPECT_EQ(value(fault.run().status(), "cut-off", "tiles_sampled"), 0);
  EXPECT_TRUE(fault.run().wait_status([](const auto& s) {
    return process(s, "cut-off").contains("delivers_nothing_s");
  })) << "it is named: "
      << fault.run().status().dump(1);
  relay.reset();
  relay = std::make_unique<OwnRelay>(fault, "local", at);
  EXPECT_TRUE(fault.run().wait_status([](const auto& s) {
    return value(s, "cut-off", "tiles_sampled") > 0 && !process(s, "cut-off").contains("delivers_nothing_s");
  })) << guest.err();
  guest.signal(SIGTERM);
  EXPECT_EQ(guest.wait(20), 0) << guest.err();
  fault.finish();
}

TEST(CutOff, AViewerForFiveSeconds) {
  Fault fault("the viewer's link is cut for 5 s and healed", {"--link", "2ms"});
  ASSERT_TRUE(fault.showing());
  const pid_t relay = relay_called("link-viewer-1", fault.run().out());
  ASSERT_GT(relay, 0);
  fault.begins();
  ::kill(relay, SIGSTOP);
  pass(5);
  ::kill(relay, SIGCONT);
  fault.ends();
  fault.expect_resynchronised();
  fault.finish();
}

TEST(CutOff, AViewerWhoseConnectionsBreak) {
  Fault fault("the viewer's connections break, all at once", {"--link", "2ms"});
  ASSERT_TRUE(fault.showing());
  const pid_t relay = relay_called("link-viewer-1", fault.run().out());
  ASSERT_GT(relay, 0);
  fault.begins();
  ::kill(relay, SIGKILL);
  fault.ends();
  fault.expect_resynchronised();
  fault.finish();
}

// It is found at other ports.
TEST(CutOff, AViewerWhosePackerIsKilled) {
  Fault fault("the packer is killed, of a viewer behind a link", {"--link", "2ms"});
  ASSERT_TRUE(fault.showing());
  const pid_t viewer = fault.pid_of("viewer-1");
  fault.begins();
  const pid_t packer = fault.signal("packer", SIGKILL);
  ASSERT_GT(packer, 0);
  EXPECT_TRUE(fault.wait_new_life("packer", packer));
  fault.ends();
  fault.expect_resynchronised();
  EXPECT_EQ(fault.pid_of("viewer-1"), viewer);
  fault.finish();
}

TEST(SlowLink, OfTwentyMegabitsShowsNewViews) {
  Fault fault("the viewer's link carries 20 Mbit/s", {"--link", "20mbit"});
  ASSERT_TRUE(fault.showing());
  fault.begins();
  fault.ends();
  pass(5);
  fault.expect_resynchronised();
  EXPECT_LT(value(fault.run().status(), "viewer-1", "update_age_ms"), 1000) << "old views wait in buffers";
  fault.finish();
}

constexpr double kReadsNothing_s = 4;

// A viewer that stands still, and a peer that asks and asks and never reads an answer.
TEST(ReadsNothing, AViewerBesideOneThatMustNotNotice) {
  Fault fault(
      fmt::format("a viewer reads nothing for {:.0f} s, a peer asks for all points again and again and reads "
                  "none",
                  kReadsNothing_s));
  ASSERT_TRUE(fault.showing());
  Program& guest = fault.start_guest();
  const pid_t packer = fault.pid_of("packer");
  std::string state;
  const auto session = fault.run().status();
  for (const auto& p : session["processes"])
    if (p["role"] == "packer") state = p["endpoints"]["state"];
  ASSERT_FALSE(state.empty());
  const double before_mb = Fault::resident_mb(packer);
  fault.begins();
  guest.signal(SIGSTOP);
  {
    net::Context context;
    net::Socket deaf(context, net::Kind::kDealer, "deaf", {.high_water_mark = 1});
    ASSERT_TRUE(deaf.connect(state).ok());
    for (double left_s = kReadsNothing_s; left_s > 0; left_s -= 0.05) {
      for (int i = 0; i < 5; ++i) deaf.send(wire::StateRequest{InstanceId{424242}, {}, {}});
      pass(0.05);
    }
  }
  EXPECT_LT(Fault::resident_mb(packer), before_mb + 300) << "MB: what nobody reads is kept";
  guest.signal(SIGCONT);
  fault.ends();
  fault.expect_resynchronised();
  fault.expect_resynchronised("viewer-2");
  fault.finish();
}

}  // namespace
}  // namespace telesplat::test
