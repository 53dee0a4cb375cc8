// Digests of replica and packer: what differs is made anew, but not for ever.
#include "client/viewer/points/replica_check.h"

#include <gtest/gtest.h>

namespace telesplat::viewer {
namespace {

TEST(ReplicaCheck, EqualOnesAreCounted) {
  ReplicaCheck check;
  EXPECT_FALSE(check.compare(7, 7, 1));
  EXPECT_FALSE(check.compare(8, 8, 2));
  EXPECT_EQ(check.equal(), 2u);
  EXPECT_EQ(check.different(), 0u);
}

TEST(ReplicaCheck, ADifferentOneIsMadeAnewAtOnceThenLessAndLessOften) {
  ReplicaCheck check;
  int anew = 0;
  for (double now_s = 0; now_s < 3600; now_s += 2) anew += check.compare(1, 2, now_s);
  EXPECT_GE(anew, 6);
  EXPECT_LE(anew, 12) << "what never comes out equal costs little";
  EXPECT_EQ(check.different(), 1800u);
  // Once it was equal, the next difference is another one.
  EXPECT_FALSE(check.compare(3, 3, 1e6));
  EXPECT_TRUE(check.compare(3, 4, 2e6));
  EXPECT_FALSE(check.compare(3, 4, 2e6 + ReplicaCheck::kPatience_s / 2));
  EXPECT_TRUE(check.compare(3, 4, 2e6 + 2 * ReplicaCheck::kPatience_s));
}

}  // namespace
}  // namespace telesplat::viewer
