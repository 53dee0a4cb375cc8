// `telesplat ctl clip` at the master, and orders that it passes on to viewers and data servers.
#include <gtest/gtest.h>

#include <glm/mat3x3.hpp>

#include "common/scene/clip_order.h"
#include "services/master/master_core.h"

namespace telesplat::master {
namespace {

class ClipOrders : public testing::Test {
 protected:
  wire::Hello hello(const std::string& role, const std::string& name, uint64_t instance) {
    wire::Hello h;
    h.role = role;
    h.name = name;
    h.instance = {instance};
    return h;
  }
  void join_data(const geometry::DBox& box, const std::string& hash = "1") {
    wire::Hello h = hello("data", "data", 9);
    h.box_room = {{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}};
    h.facts = {{"kind", "mesh"}, {"content_hash", hash}, {"scene", "cube"}};
    h.facts[scene::kPlacementFact] = scene::to_text(scene::placement_of(glm::dmat3(1), box, h.box_room));
    core.on("data", h, 0);
    take();
  }
  // Takes messages since the last call: replies, and the newest welcome.
  void take() {
    replies.clear(), orders.clear();
    for (const auto& out : core.take_outgoing()) {
      const auto bytes = std::as_bytes(std::span(out.body));
      if (out.type == wire::ControlReply::kName) replies[out.peer] = *wire::decode<wire::ControlReply>(bytes);
      if (out.type == wire::Order::kName) orders[out.peer] = *wire::decode<wire::Order>(bytes);
      if (out.type == wire::Welcome::kName) welcome = *wire::decode<wire::Welcome>(bytes);
    }
  }
  wire::ControlReply control(const std::string& command, const std::map<std::string, std::string>& arguments) {
    core.on("ctl", wire::Control{command, arguments}, now_s);
    take();
    return replies.contains("ctl") ? replies["ctl"] : wire::ControlReply{false, "(nothing yet)"};
  }
  geometry::Clip told() {
    const auto fact = welcome.facts.find(scene::kClipFact);
    return fact == welcome.facts.end() ? geometry::Clip() : *geometry::clip_from_text(fact->second);
  }

  double now_s = 1;
  std::unique_ptr<metrics::RunRecord> record = std::move(metrics::RunRecord::open("")).value();
  MasterCore core{MasterOptions{}, {42}, *record};
  std::map<std::string, wire::ControlReply> replies;
  std::map<std::string, wire::Order> orders;
  wire::Welcome welcome;
};

TEST_F(ClipOrders, BeginAnEpochAndAreToldToEveryone) {
  EXPECT_FALSE(control("clip", {{"clip", "plane x>=0"}}).ok) << "nothing is known of the data yet";
  join_data({{0, 0, 0}, {100, 100, 100}});
  core.on("viewer", hello("viewer", "viewer-1", 5), 0);
  take();
  const EpochId before = welcome.epoch;
  EXPECT_TRUE(told().empty());
  const auto reply = control("clip", {{"clip", "plane x>=75"}});
  ASSERT_TRUE(reply.ok) << reply.text;
  EXPECT_GT(welcome.epoch, before);
  ASSERT_EQ(told().planes.size(), 1u);
  EXPECT_TRUE(told().keeps({0.21, 0, 0}));
  EXPECT_FALSE(told().keeps({0.19, 0, 0}));
  EXPECT_EQ(welcome.facts.at(scene::kClipOrderFact), "plane x>=75");
  EXPECT_TRUE(control("clip", {{"clip", "off"}}).ok);
  EXPECT_TRUE(told().empty());
  EXPECT_FALSE(welcome.facts.contains(scene::kClipFact));
}

TEST_F(ClipOrders, BadOnesChangeNothing) {
  join_data({{0, 0, 0}, {100, 100, 100}});
  ASSERT_TRUE(control("clip", {{"clip", "box 10,10,10,90,90,90"}}).ok);
  const auto before = welcome;
  for (const char* text : {"plane x>", "box 1,2,3", "sphere", "plane 0,0,0,1"}) {
    const auto reply = control("clip", {{"clip", text}});
    EXPECT_FALSE(reply.ok) << text;
    EXPECT_FALSE(reply.text.empty());
  }
  EXPECT_FALSE(control("clip", {}).ok);
  EXPECT_EQ(told(), *geometry::clip_from_text(before.facts.at(scene::kClipFact)));
}

TEST_F(ClipOrders, StayWhileTheDataDoAndGoWithThem) {
  join_data({{0, 0, 0}, {100, 100, 100}});
  ASSERT_TRUE(control("clip", {{"clip", "plane y<=50%"}}).ok);
  join_data({{0, 0, 0}, {100, 100, 100}});  // it was restarted
  EXPECT_EQ(told().planes.size(), 1u);
  join_data({{5, 5, 5}, {6, 6, 6}}, "2");  // another data set
  EXPECT_TRUE(told().empty());
}

TEST_F(ClipOrders, OfTheFlagHoldFromTheBeginning) {
  MasterOptions options;
  options.clip = "plane z>=50%";
  MasterCore begun(options, {43}, *record);
  wire::Hello h = hello("data", "data", 9);
  h.box_room = {{-0.4f, -0.4f, -0.4f}, {0.4f, 0.4f, 0.4f}};
  h.facts = {{"kind", "mesh"}, {"content_hash", "1"}};
  h.facts[scene::kPlacementFact] =
      scene::to_text(scene::placement_of(glm::dmat3(1), {{0, 0, 0}, {10, 10, 10}}, h.box_room));
  begun.on("data", h, 0);
  for (const auto& out : begun.take_outgoing())
    if (out.type == wire::Welcome::kName) welcome = *wire::decode<wire::Welcome>(std::as_bytes(std::span(out.body)));
  ASSERT_EQ(told().planes.size(), 1u);
  EXPECT_FALSE(told().keeps({0, 0, -0.01}));
}

TEST_F(ClipOrders, OrdersGoToTheViewerThatIsMeantAndItsAnswerBack) {
  EXPECT_FALSE(control("pick", {{"at", "1,1"}}).ok) << "no viewer is here";
  core.on("a", hello("viewer", "viewer-1", 5), 0);
  core.on("b", hello("viewer", "viewer-2", 6), 0);
  take();
  control("pick", {{"at", "1,1"}, {"viewer", "viewer-2"}});
  ASSERT_EQ(orders.size(), 1u);
  ASSERT_TRUE(orders.contains("b"));
  EXPECT_EQ(orders["b"].command, "pick");
  EXPECT_TRUE(replies.empty());
  const uint64_t number = orders["b"].number;
  core.on("b", wire::OrderAnswer{{6}, number, true, "{}"}, now_s);
  take();
  ASSERT_TRUE(replies.contains("ctl"));
  EXPECT_EQ(replies["ctl"].text, "{}");
  core.on("b", wire::OrderAnswer{{6}, number, true, "again"}, now_s);
  take();
  EXPECT_TRUE(replies.empty()) << "nobody waits for it any more";
  EXPECT_FALSE(control("pick", {{"viewer", "nobody"}}).ok);

  // Without a name the first viewer is asked; without an answer the order is refused.
  control("where", {});
  EXPECT_TRUE(orders.contains("a"));
  core.tick(now_s + 3.5);
  take();
  ASSERT_TRUE(replies.contains("ctl"));
  EXPECT_FALSE(replies["ctl"].ok);
}

TEST_F(ClipOrders, AProbeIsAnsweredByWhoeverKnows) {
  core.on("p", hello("data", "data-1", 7), 0);
  core.on("q", hello("data", "data-2", 8), 0);
  take();
  control("probe", {{"x", "0"}});
  ASSERT_EQ(orders.size(), 2u);
  const uint64_t number = orders["p"].number;
  core.on("p", wire::OrderAnswer{{7}, number, false, "not mine"}, now_s);
  take();
  EXPECT_TRUE(replies.empty());
  core.on("q", wire::OrderAnswer{{8}, number, true, "{\"value\":1}"}, now_s);
  take();
  EXPECT_EQ(replies["ctl"].text, "{\"value\":1}");
}

// Both were started by hand and have the same name.
TEST_F(ClipOrders, AProbeGoesToAllPartsWhateverTheyAreCalled) {
  wire::Hello first = hello("data", "data", 7), second = hello("data", "data", 8);
  first.parameters["volume.part"] = 0, second.parameters["volume.part"] = 1;
  core.on("p", first, 0);
  core.on("q", second, 0);
  take();
  control("probe", {{"x", "0"}});
  EXPECT_EQ(orders.size(), 2u);
  second.instance = {9};  // started again
  core.on("r", second, 0);
  control("probe", {{"x", "0"}});
  ASSERT_EQ(orders.size(), 2u);
  EXPECT_TRUE(orders.contains("p") && orders.contains("r"));
}

// Only processes that were asked may answer, each once, in spite of other answers.
TEST_F(ClipOrders, OnlyWhoWasAskedAnswersAndOnce) {
  core.on("p", hello("data", "data-1", 7), 0);
  core.on("q", hello("data", "data-2", 8), 0);
  core.on("s", hello("sampler", "sampler-1", 9), 0);
  take();
  control("probe", {{"x", "0"}});
  ASSERT_EQ(orders.size(), 2u);
  const uint64_t number = orders["p"].number;
  core.on("s", wire::OrderAnswer{{7}, number, true, "forged"}, now_s);
  take();
  EXPECT_TRUE(replies.empty()) << "it was not asked";
  for (int i = 0; i < 3; ++i) core.on("p", wire::OrderAnswer{{7}, number, false, "not mine"}, now_s);
  take();
  EXPECT_TRUE(replies.empty()) << "the other one may know";
  core.on("q", wire::OrderAnswer{{8}, number, true, "{}"}, now_s);
  take();
  EXPECT_EQ(replies["ctl"].text, "{}");
}

// A viewer's process died unnoticed and was started again; the old process' answer no longer counts.
TEST_F(ClipOrders, OfOneNameTheNewLifeIsMeant) {
  core.on("z", hello("viewer", "viewer-1", 5), 0);
  take();
  control("where", {});
  ASSERT_TRUE(orders.contains("z"));
  now_s = 1.5;
  core.on("a", hello("viewer", "viewer-1", 6), now_s);
  take();
  ASSERT_TRUE(replies.contains("ctl")) << "the old one is gone";
  EXPECT_FALSE(replies["ctl"].ok);
  for (const char* named : {"", "viewer-1"}) {
    control("where",
            *named ? std::map<std::string, std::string>{{"viewer", named}} : std::map<std::string, std::string>());
    ASSERT_EQ(orders.size(), 1u);
    ASSERT_TRUE(orders.contains("a"));
    core.on("a", wire::OrderAnswer{{6}, orders["a"].number, true, "{}"}, now_s);
    take();
    ASSERT_TRUE(replies.contains("ctl"));
    EXPECT_TRUE(replies["ctl"].ok);
  }
}

TEST_F(ClipOrders, NobodyWaitsForWhoIsGone) {
  core.on("p", hello("data", "data-1", 7), 0);
  core.on("q", hello("data", "data-2", 8), 0);
  core.on("a", hello("viewer", "viewer-1", 5), 0);
  take();
  control("where", {});
  core.undeliverable("a");
  take();
  ASSERT_TRUE(replies.contains("ctl"));
  EXPECT_FALSE(replies["ctl"].ok);
  EXPECT_NE(replies["ctl"].text.find("gone"), std::string::npos);

  control("probe", {{"x", "0"}});
  const uint64_t number = orders["p"].number;
  core.on("p", wire::OrderAnswer{{7}, number, false, "not mine"}, now_s);
  take();
  EXPECT_TRUE(replies.empty());
  core.on("q", wire::Goodbye{{8}}, now_s);
  take();
  ASSERT_TRUE(replies.contains("ctl"));
  EXPECT_EQ(replies["ctl"].text, "not mine");
}

}  // namespace
}  // namespace telesplat::master
