// Orders that change a setting of a viewer or the launcher: the process that is asked, and the way of its answer.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

class SettingOrders : public testing::Test {
 protected:
  SettingOrders() {
    uint64_t instance = 5;
    for (const char* name : {"viewer-1", "viewer-2"}) {
      wire::Hello h;
      h.role = "viewer";
      h.name = name;
      h.instance = {instance++};
      core.on(name, h, 0);
    }
    core.take_outgoing();
  }
  // Sends an order and takes the results: replies, and orders to viewers.
  void order(const std::string& command, const std::map<std::string, std::string>& arguments, double now_s = 1) {
    core.on("ctl", wire::Control{command, arguments}, now_s);
    take();
  }
  // True if a pick over this connection with this key is passed on to a viewer.
  bool picks(const std::string& peer, const std::string& key) {
    core.on(peer, wire::Control{"pick", {{"at", "1,1"}}}, 1, key);
    take();
    return !asked.empty();
  }
  void take() {
    replies.clear();
    asked.clear();
    for (const auto& out : core.take_outgoing()) {
      const auto bytes = std::as_bytes(std::span(out.body));
      if (out.type == wire::ControlReply::kName)
        replies.emplace_back(out.peer, *wire::decode<wire::ControlReply>(bytes));
      if (out.type == wire::Order::kName) asked.emplace_back(out.peer, *wire::decode<wire::Order>(bytes));
    }
  }
  nlohmann::json wishes() {
    core.on("launcher's", wire::Control{"status", {}}, 2);
    take();
    return nlohmann::json::parse(replies.at(0).second.text).value("wishes", nlohmann::json::array());
  }

  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{}, {42}, *record};
  std::vector<std::pair<std::string, wire::ControlReply>> replies;
  std::vector<std::pair<std::string, wire::Order>> asked;
};

TEST_F(SettingOrders, AWindowsSettingGoesToAllViewersOrTheOneThatIsNamed) {
  order("splat", {{"value", "ewa"}});
  ASSERT_EQ(asked.size(), 2u);
  EXPECT_EQ(asked[0].second.command, "splat");
  EXPECT_EQ(asked[0].second.arguments.at("value"), "ewa");
  order("legend", {{"value", "off"}, {"viewer", "viewer-2"}});
  ASSERT_EQ(asked.size(), 1u);
  EXPECT_EQ(asked[0].first, "viewer-2");
  order("pick", {{"at", "1,1"}});
  EXPECT_EQ(asked.size(), 1u) << "a question has one answer";
  order("stereo", {{"value", "rows"}, {"viewer", "viewer-9"}});
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].second.text, "no viewer is called \"viewer-9\"; here is viewer-1, viewer-2");
}

TEST_F(SettingOrders, TheLauncherFindsItsOrdersInTheStatusAndItsAnswerComesBack) {
  core.introduce({.started_by = "view"});
  order("samplers", {{"value", "3"}});
  EXPECT_TRUE(replies.empty()) << "the launcher has not answered yet";
  const auto told = wishes();
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0]["command"], "samplers");
  EXPECT_EQ(told[0]["arguments"]["value"], "3");
  core.on("launcher's",
          wire::Control{"done", {{"number", told[0]["number"].dump()}, {"ok", "true"}, {"text", "3 samplers"}}}, 2);
  take();
  ASSERT_EQ(replies.size(), 2u);
  EXPECT_EQ(replies[1].first, "ctl");
  EXPECT_TRUE(replies[1].second.ok);
  EXPECT_EQ(replies[1].second.text, "3 samplers");
  EXPECT_TRUE(wishes().empty());
}

TEST_F(SettingOrders, WithoutALauncherItSaysWho) {
  core.introduce({.started_by = "hand"});
  order("samplers", {{"value", "3"}});
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_FALSE(replies[0].second.ok);
  EXPECT_NE(replies[0].second.text.find("started by hand"), std::string::npos) << replies[0].second.text;
  EXPECT_TRUE(wishes().empty());
}

TEST_F(SettingOrders, AnAnswerThatIsNoneIsRefusedAndALauncherThatIsSilentIsTold) {
  core.introduce({.started_by = "run"});
  for (const char* number : {"", "x", "-1", "1 "}) {
    order("done", {{"number", number}});
    ASSERT_EQ(replies.size(), 1u);
    EXPECT_FALSE(replies[0].second.ok) << number;
  }
  order("iso", {{"value", "1"}}, 3);
  core.tick(3 + Errands::kPatience_s + 0.1);
  take();
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_FALSE(replies[0].second.ok);
  EXPECT_EQ(replies[0].second.text, "no answer within 3 s");
}

// A viewer keeps 64 orders and drops the oldest: one person alone must not be able to fill its list.
TEST_F(SettingOrders, NobodyFillsTheListOfOrdersAlone) {
  size_t passed_on = 0;
  for (size_t i = 0; i < Errands::kMost; ++i) passed_on += picks("eve's " + std::to_string(i), "eve");
  ASSERT_EQ(replies.size(), 1u);
  EXPECT_EQ(replies[0].second.text, "16 orders of yours wait for their answers, limit 16");
  EXPECT_EQ(passed_on, 16u);
  EXPECT_TRUE(picks("anna's", "anna"));
  for (size_t i = 0; i < Errands::kMost; ++i) picks("without keys", "");
  EXPECT_FALSE(picks("without keys", ""));
  EXPECT_TRUE(picks("another without keys", ""));
  core.tick(1 + Errands::kPatience_s + 0.1);
  take();
  EXPECT_TRUE(picks("eve's", "eve")) << "those that nobody answered count no more";
}

TEST_F(SettingOrders, AnUnknownOrderIsToldAllThereAre) {
  order("splatter", {});
  ASSERT_EQ(replies.size(), 1u);
  for (const char* known : {"splat", "samplers", "clip", "stop", "overlay"})
    EXPECT_NE(replies[0].second.text.find(known), std::string::npos) << known;
}

}  // namespace
}  // namespace telesplat::master
