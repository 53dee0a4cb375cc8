// kill -9 of each process while a frame waits for a process: it is started again, the display goes on, and views are
// displayed again within seconds.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <csignal>

#include "tests/e2e/faults/fault.h"

namespace telesplat::test {
namespace {

// The step that a frame waits for while the process is killed. Other processes are stopped, so that it stays there.
enum class Stage {
  kFetching,  // a sampler has a lease and waits for the data server
  kLeased,    // samplers have all of it
  kSampled,   // the packer
};

struct Case {
  const char* victim;
  Stage stage;
};

const char* words(Stage s) {
  switch (s) {
    case Stage::kFetching:
      return "while a sampler fetches";
    case Stage::kLeased:
      return "while tiles are leased";
    case Stage::kSampled:
      return "while tiles wait for the packer";
  }
  return "";
}

std::string test_name(const Case& c) {
  std::string out;
  bool upper = true;
  for (const char letter : fmt::format("{} {}", c.victim, words(c.stage))) {
    if (std::isalnum(static_cast<unsigned char>(letter))) out += upper ? char(std::toupper(letter)) : letter;
    upper = !std::isalnum(static_cast<unsigned char>(letter));
  }
  return out;
}
void PrintTo(const Case& c, std::ostream* out) { *out << test_name(c); }

class Killed : public ::testing::TestWithParam<Case> {
 protected:
  // Holds a frame at the stage.
  void hold(Fault& fault) {
    switch (GetParam().stage) {
      case Stage::kFetching:
        relay_ = std::make_unique<OwnRelay>(fault, kTrickle);
        late_ =
            std::make_unique<Program>("telesplat-sampler",
                                      std::vector<std::string>{"--master", fault.run().master(), "--name", "late",
                                                               "--threads", "1", "--via", "data=" + relay_->address()},
                                      fault.run().folder() / "late");
        EXPECT_TRUE(fault.run().wait_status([](const auto& s) {
          const auto p = process(s, "late");
          return p.is_object() && p["leases"] > 0;
        })) << late_->err();
        return;
      case Stage::kLeased:
        for (const char* sampler : {"sampler-1", "sampler-2"}) held_.push_back(fault.signal(sampler, SIGSTOP));
        return in_flight(fault);
      case Stage::kSampled:
        held_.push_back(fault.signal("packer", SIGSTOP));
        in_flight(fault);
        return pass(0.3);  // until samplers have sent what they had
    }
  }
  void release(pid_t killed) {
    for (const pid_t pid : held_)
      if (pid > 0 && pid != killed) ::kill(pid, SIGCONT);
    if (late_) late_->signal(SIGTERM);
  }

 private:
  static void in_flight(Fault& fault) {
    EXPECT_TRUE(fault.run().wait_status([](const auto& s) { return s["frames_in_flight"] > 0; }));
  }
  std::vector<pid_t> held_;
  std::unique_ptr<OwnRelay> relay_;
  std::unique_ptr<Program> late_;
};

TEST_P(Killed, AndStartedAgain) {
  const auto& [victim, stage] = GetParam();
  const std::string name = victim;
  Fault fault(fmt::format("kill -9 of {}, {}", name, words(stage)), {"--samplers", "2"});
  const bool guest = name == "viewer-2";
  ASSERT_TRUE(fault.showing());
  if (guest) fault.start_guest();
  const pid_t killed = fault.pid_of(name);
  hold(fault);
  fault.begins();
  ASSERT_GT(killed, 0);
  ::kill(killed, SIGKILL);
  release(killed);
  fault.ends();
  if (guest) fault.start_guest();  // the launcher knows nothing of it
  EXPECT_TRUE(fault.wait_new_life(name, killed)) << fault.run().program().err();
  fault.expect_resynchronised();
  if (guest) fault.expect_updates("viewer-2");
  fault.finish();
}

// Simulated sessions kill processes at any message.
INSTANTIATE_TEST_SUITE_P(One, Killed,
                         ::testing::Values(Case{"data", Stage::kFetching}, Case{"sampler-1", Stage::kLeased},
                                           Case{"packer", Stage::kSampled}, Case{"master", Stage::kLeased},
                                           Case{"viewer-2", Stage::kLeased}),
                         [](const auto& info) { return test_name(info.param); });

}  // namespace
}  // namespace telesplat::test
