// Answers to health checks.
#include <gtest/gtest.h>

#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

wire::Hello hello(const std::string& role, const std::string& name, const std::string& host, uint64_t instance) {
  wire::Hello h;
  h.role = role;
  h.name = name;
  h.instance = {instance};
  h.facts = {{"host", host}};
  return h;
}

class Health : public ::testing::Test {
 protected:
  // Empty: healthy.
  std::string problem(const std::map<std::string, std::string>& about, double now_s = 10) {
    core.on("c", wire::Control{"health", about}, now_s);
    std::string out = "no answer";
    for (const auto& o : core.take_outgoing()) {
      if (o.peer != "c" || o.type != wire::ControlReply::kName) continue;
      // The client decodes no more than a megabyte.
      const auto reply = wire::decode<wire::ControlReply>(std::as_bytes(std::span(o.body)));
      if (!reply) return "an answer that cannot be read: " + reply.error().text;
      out = reply->ok ? "" : reply->text;
    }
    return out;
  }
  void join_all() {
    core.on("1", hello("data", "data", "a", 1), 9.8);
    core.on("2", hello("sampler", "sampler-1", "b", 2), 1);
    core.on("2", wire::Goodbye{.instance = {2}}, 1);
    core.on("3", hello("sampler", "sampler-2", "c", 3), 9.1);
    core.on("4", hello("sampler", "sampler-3", "d", 4), 5.5);
    core.on("5", hello("packer", "packer", "e", 5), 5);
    core.on("6", hello("packer", "packer", "e", 6), 9.5);
  }

  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{}, {42}, *record};
};

TEST_F(Health, AMasterThatAnswersIsWell) {
  EXPECT_EQ(problem({}), "");
  EXPECT_EQ(problem({{"colour", "red"}}), "") << "not asked for";
}

TEST_F(Health, FindsTheLivingByRoleNameAndHost) {
  join_all();
  EXPECT_EQ(problem({{"role", "sampler"}}), "");
  EXPECT_EQ(problem({{"name", "sampler-2"}}), "");
  EXPECT_EQ(problem({{"role", "sampler"}, {"host", "c"}}), "");
  EXPECT_EQ(problem({{"role", "data"}, {"name", "data"}, {"host", "a"}}), "");
}

TEST_F(Health, AnEarlierLifeDoesNotMatter) {
  join_all();
  EXPECT_EQ(problem({{"role", "packer"}, {"host", "e"}}), "");
}

TEST_F(Health, TellsWhatIsWrong) {
  join_all();
  EXPECT_EQ(problem({{"role", "sampler"}, {"host", "x"}}), "no healthy sampler on x: none takes part in the session");
  EXPECT_EQ(problem({{"role", "sampler"}, {"host", "b"}}), "no healthy sampler on b: sampler-1 has left the session");
  EXPECT_EQ(problem({{"name", "sampler-3"}}),
            "no healthy process named sampler-3: sampler-3 has said nothing for more than 3 s");
  EXPECT_NE(problem({{"role", "data"}, {"host", "b"}}), "");
  EXPECT_NE(problem({{"role", "viewer"}}), "");
  EXPECT_LT(problem({{"name", std::string(100000, 'x')}}).size(), 200u);
}

// A soak with kills has thousands of lives, and each takes a kilobyte and more of a status.
TEST_F(Health, IsAnsweredAfterTenThousandProcesses) {
  core.on("s", hello("sampler", "sampler", "here", 5), 9.9);
  for (uint64_t i = 0; i < 10000; ++i) {
    const std::string peer = "x" + std::to_string(i);
    wire::Hello h = hello("sampler", "sampler-" + peer, "host-" + peer, 1000 + i);
    h.facts["command"] = std::string(1000, 'c');
    core.on(peer, h, 9.9);
    core.on(peer, wire::Goodbye{.instance = {1000 + i}}, 9.9);
    core.take_outgoing();
  }
  EXPECT_EQ(problem({{"role", "sampler"}, {"host", "here"}}), "");
  EXPECT_EQ(problem({{"host", "host-x9999"}}), "no healthy process on host-x9999: sampler-x9999 has left the session");
}

// The health check itself is no process of the session.
TEST_F(Health, ThoseWhoAskAreNotRemembered) {
  for (int i = 0; i < 100; ++i) core.on("c" + std::to_string(i), wire::Control{"health", {{"role", "sampler"}}}, 1);
  EXPECT_TRUE(core.processes().empty());
}

}  // namespace
}  // namespace telesplat::master
