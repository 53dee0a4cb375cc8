// Digests of replica and packer: a replica that differs is requested anew, but not without end.
#include "client/viewer/points/replica_check.h"

#include <gtest/gtest.h>

#include <vector>

namespace telesplat::viewer {
namespace {

using Verdict = ReplicaCheck::Verdict;
constexpr InstanceId kPacker{5};

TEST(ReplicaCheck, EqualOnesAreCounted) {
  ReplicaCheck check;
  EXPECT_EQ(check.compare(kPacker, 7, 7, 1), Verdict::kGoOn);
  EXPECT_EQ(check.compare(kPacker, 8, 8, 2), Verdict::kGoOn);
  EXPECT_EQ(check.equal(), 2u);
  EXPECT_EQ(check.different(), 0u);
}

TEST(ReplicaCheck, ADifferentOneIsMadeAnewAtOnceThenLessOftenAndThenNoMore) {
  ReplicaCheck check;
  std::vector<double> anew_s, given_up_s;
  for (double now_s = 0; now_s < 36000; now_s += 2) {
    const Verdict verdict = check.compare(kPacker, 1, 2, now_s);
    if (verdict == Verdict::kAskAnew) anew_s.push_back(now_s);
    if (verdict == Verdict::kGiveUp) given_up_s.push_back(now_s);
  }
  EXPECT_EQ(anew_s, (std::vector<double>{0, 20, 60}));
  EXPECT_EQ(given_up_s, std::vector<double>{140}) << "told once";
  EXPECT_EQ(check.different(), 18000u);
  // Once the digests were equal, the next difference is a new one.
  EXPECT_EQ(check.compare(kPacker, 3, 3, 1e6), Verdict::kGoOn);
  EXPECT_EQ(check.compare(kPacker, 3, 4, 1e6 + 2), Verdict::kAskAnew);
  EXPECT_EQ(check.compare(kPacker, 3, 4, 1e6 + 2 + ReplicaCheck::kPatience_s / 2), Verdict::kGoOn);
  EXPECT_EQ(check.compare(kPacker, 3, 4, 1e6 + 2 + ReplicaCheck::kPatience_s), Verdict::kAskAnew);
  // The same holds for another packer.
  EXPECT_EQ(check.compare({6}, 3, 4, 1e6 + 24), Verdict::kAskAnew);
}

}  // namespace
}  // namespace telesplat::viewer
