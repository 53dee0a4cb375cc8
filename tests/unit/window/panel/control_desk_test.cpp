// Orders of the panel to a master that answers, answers late, or is not there.
#include "client/displays/window/panel/control_desk.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "common/core/clock.h"
#include "common/net/socket.h"
#include "tests/support/patience.h"

namespace telesplat::viewer {
namespace {

template <class F>
bool wait_for(F&& f, double timeout_s = 10) {
  for (const double until_s = monotonic_s() + timeout_s; monotonic_s() < until_s;) {
    if (f()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  return f();
}

class ControlDeskTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto bound = master_.bind("tcp://127.0.0.1:*");
    ASSERT_TRUE(bound) << bound.error().text;
    endpoint_ = *bound;
  }
  // Returns the next command that reached the master.
  std::optional<wire::Control> next() {
    std::optional<wire::Control> out;
    wait_for([&] {
      const auto message = master_.receive();
      if (!message || message->type != wire::Control::kName) return false;
      peer_ = message->peer;
      out = master_.decode<wire::Control>(*message);
      return true;
    });
    return out;
  }
  void answer(bool ok, const std::string& text) { master_.send(wire::ControlReply{ok, text}, peer_); }

  net::Context context_;
  net::Socket master_{context_, net::Kind::kRouter, "master"};
  std::string endpoint_, peer_;
};

TEST_F(ControlDeskTest, OrdersGoOutAndAnswersComeBack) {
  ControlDesk desk(endpoint_, {});
  desk.give({"set", {{"c.y", "0.3"}}, "c.y"});
  const auto told = next();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->command, "set");
  EXPECT_EQ(told->arguments.at("c.y"), "0.3");
  answer(true, "epoch 2");
  std::vector<OrderAnswer> answers;
  ASSERT_TRUE(wait_for([&] { return !(answers = desk.take_answers()).empty(); }));
  EXPECT_TRUE(answers[0].obeyed);
  EXPECT_EQ(answers[0].text, "epoch 2");
  EXPECT_EQ(answers[0].order.command, "set");
}

TEST_F(ControlDeskTest, OfOrdersOfOneSubjectTheNewestWaits) {
  ControlDesk desk(endpoint_, {});
  desk.give({"set", {{"c.y", "0"}}, "c.y"});
  ASSERT_TRUE(next());  // it is on its way; the others wait
  for (int i = 1; i <= 100; ++i) desk.give({"set", {{"c.y", std::to_string(i)}}, "c.y"});
  desk.give({"set", {{"c.x", "5"}}, "c.x"});
  desk.give({"epoch", {}, {}});
  desk.give({"epoch", {}, {}});
  std::vector<std::string> seen;
  for (int i = 0; i < 4; ++i) {
    answer(true, "");
    const auto told = next();
    ASSERT_TRUE(told);
    seen.push_back(told->arguments.empty() ? told->command : told->arguments.begin()->second);
  }
  EXPECT_EQ(seen, (std::vector<std::string>{"100", "5", "epoch", "epoch"}));
}

// An answer that comes too late for one order is not taken for the next order's.
TEST_F(ControlDeskTest, ALateAnswerIsNotTakenForTheNextOnes) {
  ControlDesk desk(endpoint_, {}, 1.5);  // 1.5 s are enough for a busy machine to answer the second order
  const auto answered = [&] {
    std::vector<OrderAnswer> answers;
    EXPECT_TRUE(wait_for([&] { return !(answers = desk.take_answers()).empty(); }));
    return answers.empty() ? OrderAnswer{} : answers[0];
  };
  desk.give({"set", {{"c.y", "9"}}, {}});
  ASSERT_TRUE(next());
  const std::string late = peer_;
  EXPECT_FALSE(answered().obeyed) << "no answer came in time";
  desk.give({"epoch", {}, {}});
  const auto told = next();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->command, "epoch");
  master_.send(wire::ControlReply{false, "c.y is 9, at most 2"}, late);
  answer(true, "epoch 2");
  const OrderAnswer second = answered();
  EXPECT_EQ(second.order.command, "epoch");
  EXPECT_TRUE(second.obeyed) << second.text;
  EXPECT_EQ(second.text, "epoch 2");
}

TEST_F(ControlDeskTest, TheStatusIsAskedForWhileSomebodyWatches) {
  ControlDesk desk(endpoint_, {});
  // Messages keep their order: a request for the status would lie between these.
  for (int i = 0; i < 10; ++i) {
    desk.give({"epoch", {}, {}});
    const auto order = next();
    ASSERT_TRUE(order);
    ASSERT_EQ(order->command, "epoch") << "nobody watches";
    answer(true, "");
    ASSERT_TRUE(wait_for([&] { return !desk.take_answers().empty(); }));
  }
  desk.watch(true);
  const auto told = next();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->command, "status");
  answer(true, R"({"processes": [{"role": "data", "name": "d", "alive": true, "silent_s": 0}]})");
  std::optional<ControlDesk::News> news;
  ASSERT_TRUE(wait_for([&] { return (news = desk.take_news()).has_value(); }));
  ASSERT_TRUE(news->status);
  EXPECT_EQ(news->status->processes[0].name, "d");
  EXPECT_TRUE(desk.take_answers().empty());
}

TEST_F(ControlDeskTest, NobodyWaitsForAMasterThatIsSilent) {
  const double begin_s = monotonic_s();
  {
    ControlDesk desk(endpoint_, {});
    desk.watch(true);
    desk.give({"epoch", {}, {}});
    ASSERT_TRUE(next());
  }
  EXPECT_LT(monotonic_s() - begin_s, test::patient(3));
}

TEST(ControlDesk, AMasterThatIsNotThereIsNamed) {
  ControlDesk desk("tcp://127.0.0.1:1", {});
  desk.give({"epoch", {}, {}});
  desk.watch(true);
  std::vector<OrderAnswer> answers;
  ASSERT_TRUE(wait_for([&] { return !(answers = desk.take_answers()).empty(); }));
  EXPECT_FALSE(answers[0].obeyed);
  EXPECT_NE(answers[0].text.find("tcp://127.0.0.1:1"), std::string::npos) << answers[0].text;
  std::optional<ControlDesk::News> news;
  ASSERT_TRUE(wait_for([&] { return (news = desk.take_news()).has_value(); }));
  EXPECT_FALSE(news->status);
  EXPECT_NE(news->problem.find("127.0.0.1:1"), std::string::npos) << news->problem;
}

}  // namespace
}  // namespace telesplat::viewer
