// Questions to a master that answers late: no answer is taken for another question's.
#include "tools/telesplat/control/client.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "common/core/clock.h"

namespace telesplat::launcher {
namespace {

constexpr double kLong_s = 20;

// Answers "status" with {"n": 1} and other commands with themselves. While `holds`, it answers a command late: after
// the next command arrives, and before that one's answer.
class SlowMaster {
 public:
  SlowMaster() {
    const auto bound = socket_.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound);
    if (bound) endpoint = *bound;
    thread_ = std::thread([this] { serve(); });
  }
  ~SlowMaster() {
    stop_ = true;
    thread_.join();
  }
  std::string endpoint;
  std::atomic<bool> holds{false};
  std::atomic<int> held{0};

 private:
  struct Answer {
    std::string peer;
    wire::ControlReply reply;
  };
  void serve() {
    std::vector<Answer> late;
    while (!stop_) {
      net::wait_readable({&socket_}, 20);
      while (const auto m = socket_.receive()) {
        const auto control = socket_.decode<wire::Control>(*m);
        if (!control) continue;
        late.push_back({m->peer, {true, control->command == "status" ? "{\"n\": 1}" : control->command}});
        if (holds) {
          ++held;
          continue;
        }
        for (const Answer& a : late) socket_.send(a.reply, a.peer);
        late.clear();
      }
    }
  }
  net::Context context_;
  net::Socket socket_{context_, net::Kind::kRouter, "master"};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

TEST(ControlClient, ALateAnswerIsNotTakenForTheNextQuestions) {
  SlowMaster master;
  ControlClient client(master.endpoint);
  const auto first = client.ask("first", kLong_s);
  ASSERT_TRUE(first) << first.error().text;
  EXPECT_EQ(*first, "first");
  master.holds = true;
  EXPECT_FALSE(client.ask("second", 0.3));
  EXPECT_TRUE(client.unanswered());
  while (master.held == 0) std::this_thread::yield();
  master.holds = false;
  for (const std::string command : {"third", "fourth"}) {
    const auto answer = client.ask(command, kLong_s);
    ASSERT_TRUE(answer) << answer.error().text;
    EXPECT_EQ(*answer, command);
    EXPECT_FALSE(client.unanswered());
  }
  EXPECT_FALSE(client.nobody_there());
}

TEST(ControlClient, AStatusThatWasRequestedIsNoAnswerToAnOrder) {
  SlowMaster master;
  ControlClient client(master.endpoint);
  master.holds = true;
  client.request_status();
  while (master.held == 0) std::this_thread::yield();
  master.holds = false;
  const auto answer = client.ask("stop", kLong_s);
  ASSERT_TRUE(answer) << answer.error().text;
  EXPECT_EQ(*answer, "stop");
  client.request_status();
  std::optional<nlohmann::json> status;
  for (const double until_s = monotonic_s() + kLong_s; !status && monotonic_s() < until_s;)
    status = client.poll_status();
  ASSERT_TRUE(status);
  EXPECT_EQ(status->value("n", 0), 1);
}

// Refusals come from viewers and data servers, too, and are printed.
TEST(ControlClient, AnswersDoNotSteerATerminal) {
  SlowMaster master;
  ControlClient client(master.endpoint);
  const auto answer = client.ask("\x1b]0;title\x07\nmore", kLong_s);
  ASSERT_TRUE(answer) << answer.error().text;
  EXPECT_EQ(*answer, "\xef\xbf\xbd]0;title\xef\xbf\xbd\nmore");
}

}  // namespace
}  // namespace telesplat::launcher
