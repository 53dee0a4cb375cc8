// What telesplat-health makes of a master's status.
#include "tools/health/health.h"

#include <gtest/gtest.h>

namespace telesplat::health {
namespace {

constexpr const char* kStatus = R"({"epoch": 1, "processes": [
  {"role": "data", "name": "data", "alive": true, "silent_s": 0.2, "facts": {"host": "a"}},
  {"role": "sampler", "name": "sampler-1", "alive": false, "silent_s": 9, "facts": {"host": "b"}},
  {"role": "sampler", "name": "sampler-2", "alive": true, "silent_s": 0.9, "facts": {"host": "c"}},
  {"role": "sampler", "name": "sampler-3", "alive": true, "silent_s": 4.5, "facts": {"host": "d"}},
  {"role": "packer", "name": "packer", "alive": false, "silent_s": 4.5, "facts": {"host": "e"}},
  {"role": "packer", "name": "packer", "alive": true, "silent_s": 0.5, "facts": {"host": "e"}},
  {"role": "viewer", "name": "viewer-1", "alive": true}]})";

std::string problem(const Subject& subject, const std::string& status = kStatus) {
  const Status s = check(status, subject);
  return s ? "" : s.error().text;
}

TEST(Health, AMasterThatAnswersIsWell) { EXPECT_EQ(problem({}), ""); }

TEST(Health, FindsTheLivingByRoleNameAndHost) {
  EXPECT_EQ(problem({.role = "sampler"}), "");
  EXPECT_EQ(problem({.name = "sampler-2"}), "");
  EXPECT_EQ(problem({.role = "sampler", .host = "c"}), "");
  EXPECT_EQ(problem({.role = "data", .name = "data", .host = "a"}), "");
}

TEST(Health, AnEarlierLifeDoesNotMatter) { EXPECT_EQ(problem({.role = "packer", .host = "e"}), ""); }

TEST(Health, TellsWhatIsWrong) {
  EXPECT_EQ(problem({.role = "sampler", .host = "x"}), "no healthy sampler on x: none takes part in the session");
  EXPECT_EQ(problem({.role = "sampler", .host = "b"}), "no healthy sampler on b: sampler-1 has left the session");
  EXPECT_EQ(problem({.name = "sampler-3"}),
            "no healthy process named sampler-3: sampler-3 has said nothing for more than 3 s");
  EXPECT_NE(problem({.role = "data", .host = "b"}), "");
  EXPECT_NE(problem({.role = "viewer"}), "") << "silence unknown";
}

TEST(Health, AnAnswerThatIsNoStatusIsNotWell) {
  for (const char* text : {"", "stopping", "[]", "{}", R"({"processes": 3})", R"({"processes": [)"})
    EXPECT_EQ(problem({}, text), "the master's answer is not a status") << text;
  for (const char* text : {R"({"processes": [1, null, "x"]})", R"({"processes": [{"role": 1, "facts": 2}]})",
                           R"({"processes": [{"role": "data", "alive": 1, "silent_s": "no", "facts": {"host": 3}}]})"})
    EXPECT_NE(problem({.role = "data"}, text), "") << text;
}

}  // namespace
}  // namespace telesplat::health
