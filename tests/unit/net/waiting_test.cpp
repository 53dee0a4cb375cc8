// A wait gives a line once, then once a minute.
#include "common/net/connections/waiting.h"

#include <gtest/gtest.h>

namespace telesplat::net {
namespace {

TEST(Waiting, SpeaksAfterSomeSecondsThenOnceAMinute) {
  Waiting waiting;
  EXPECT_FALSE(waiting.look("no master is there", 100));
  EXPECT_FALSE(waiting.look("no master is there", 102.9));
  EXPECT_EQ(waiting.look("no master is there", 103), "no master is there; waiting (3 s so far)");
  for (double s = 103.1; s < 163; s += 0.1) EXPECT_FALSE(waiting.look("no master is there", s)) << s;
  EXPECT_EQ(waiting.look("no master is there", 163.1), "no master is there; waiting (63 s so far)");
}

TEST(Waiting, TellsEachThingOnceHoweverTheyTakeTurns) {
  Waiting waiting;
  int lines = 0;
  for (int s = 0; s < 50; ++s) lines += waiting.look(s / 5 % 2 ? "one" : "the other", s).has_value();
  EXPECT_EQ(lines, 2);
  EXPECT_EQ(waiting.waited_s(50), 50);
}

TEST(Waiting, BeginsAnewWhenWhatItWaitedForWasThere) {
  Waiting waiting;
  waiting.look("no master is there", 0);
  EXPECT_TRUE(waiting.look("no master is there", 4));
  EXPECT_FALSE(waiting.look("", 5));
  EXPECT_EQ(waiting.waited_s(6), 0);
  EXPECT_FALSE(waiting.look("no master is there", 7));
  EXPECT_EQ(waiting.look("no master is there", 10), "no master is there; waiting (3 s so far)");
}

TEST(Waiting, NamesTheRolesThatASessionLacks) {
  EXPECT_EQ(lacking_text(""), "");
  EXPECT_EQ(lacking_text("sampler"), "the session has no sampler");
  EXPECT_EQ(lacking_text("packer,sampler"), "the session has no packer and no sampler");
  EXPECT_EQ(lacking_text("data,packer,sampler"), "the session has no data server, no packer and no sampler");
}

TEST(Waiting, FindsHostsThatAreNone) {
  EXPECT_EQ(host_problem("tcp://127.0.0.1:7700"), "");
  EXPECT_EQ(host_problem("tcp://[::1]:7700"), "");
  EXPECT_EQ(host_problem("ipc:///tmp/master"), "");
  EXPECT_TRUE(host_problem("tcp://nohost.invalid:7700").starts_with("no host called nohost.invalid is found: "));
}

}  // namespace
}  // namespace telesplat::net
