// A crew's loops: each turn runs once, threads have numbers of their own, and loops follow each other at once.
#include "common/parallel/crew.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace telesplat {
namespace {

TEST(Crew, EachTurnComesOnceAndThreadsHaveNumbersOfTheirOwn) {
  for (const int threads : {1, 2, 5}) {
    Crew crew(threads);
    ASSERT_EQ(crew.threads(), threads);
    std::vector<std::atomic<int>> inside(static_cast<size_t>(threads));
    for (const size_t count : {0, 1, 2, 700}) {
      std::vector<std::atomic<int>> times(count);
      crew.run(count, [&](size_t n, int thread) {
        ASSERT_LT(static_cast<size_t>(thread), inside.size());
        EXPECT_EQ(++inside[static_cast<size_t>(thread)], 1) << "two threads with one number";
        ++times[n];
        --inside[static_cast<size_t>(thread)];
      });
      for (size_t n = 0; n < count; ++n) ASSERT_EQ(times[n], 1) << n;
    }
  }
}

// The data that a loop's turns read is freed right after the loop.
TEST(Crew, ThousandsOfShortLoopsLeaveNoThreadBehind) {
  Crew crew(4);
  std::atomic<size_t> turns{0};
  for (size_t i = 0; i < 5000; ++i) {
    auto alive = std::make_unique<size_t>(i);
    crew.run(3, [&turns, &alive, i](size_t, int) { turns += *alive == i; });
    alive.reset();
  }
  EXPECT_EQ(turns, 15000u);
}

TEST(Crew, SeveralThreadsTakeTurns) {
  Crew crew(3);
  std::atomic<int> arrived{0};
  crew.run(3, [&](size_t, int) {  // no turn ends before all three have begun
    ++arrived;
    while (arrived < 3) std::this_thread::yield();
  });
  EXPECT_EQ(arrived, 3);
}

}  // namespace
}  // namespace telesplat
