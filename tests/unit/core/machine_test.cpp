// Processors and memory that a process may use.
#include "common/core/machine.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <thread>

namespace telesplat {
namespace {

TEST(Machine, MemoryIsAtMostTheMachines) {
  EXPECT_GT(usable_memory_mb(), 100);
  EXPECT_LE(usable_memory_mb(), this_machine().memory_mb);
}

TEST(Machine, ProcessorsAreThoseThatThisProcessMayRunOn) {
  cpu_set_t before;
  ASSERT_EQ(sched_getaffinity(0, sizeof before, &before), 0);
  EXPECT_GE(usable_processors(), 1);
  EXPECT_LE(usable_processors(), CPU_COUNT(&before));
  int first = 0;
  while (!CPU_ISSET(first, &before)) ++first;
  cpu_set_t one;
  CPU_ZERO(&one);
  CPU_SET(first, &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  const int usable = usable_processors();
  ASSERT_EQ(sched_setaffinity(0, sizeof before, &before), 0);
  EXPECT_EQ(usable, 1);
}

}  // namespace
}  // namespace telesplat
