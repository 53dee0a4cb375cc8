// Loops on several threads: each turn runs once, exceptions reach the caller, sums do not depend on the threads.
#include "common/parallel/in_parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <numeric>
#include <stdexcept>

namespace telesplat {
namespace {

TEST(InParallel, EachTurnComesOnce) {
  for (const int count : {0, 1, 2, 63, 64, 65, 5000}) {
    std::vector<int> times(static_cast<size_t>(count));
    in_parallel(0, count, [&](int i) { ++times[static_cast<size_t>(i)]; });
    EXPECT_EQ(std::accumulate(times.begin(), times.end(), 0), count);
    EXPECT_EQ(std::count(times.begin(), times.end(), 1), count);
    std::atomic<int> covered{0};
    in_parallel(tbb::blocked_range<int>(0, count, 7), [&](const tbb::blocked_range<int>& part) {
      EXPECT_FALSE(part.empty());
      covered += part.end() - part.begin();
    });
    EXPECT_EQ(covered, count);
  }
  in_parallel(5, 3, [](int) { ADD_FAILURE() << "there is none"; });
}

TEST(InParallel, WhatATurnThrowsComesOut) {
  EXPECT_THROW(in_parallel(0, 1000,
                           [](int i) {
                             if (i == 700) throw std::runtime_error("700");
                           }),
               std::runtime_error);
  EXPECT_THROW(both_in_parallel([] {}, [] { throw std::runtime_error("b"); }), std::runtime_error);
  int a = 0, b = 0;  // the next pair runs all the same
  both_in_parallel([&] { a = 1; }, [&] { b = 2; });
  EXPECT_EQ(a + b, 3);
}

TEST(InParallel, LoopsWithinLoops) {
  std::vector<std::atomic<int>> times(40 * 50);
  in_parallel(0, 40, [&](int i) { in_parallel(0, 50, [&](int j) { ++times[static_cast<size_t>(50 * i + j)]; }); });
  for (const auto& t : times) ASSERT_EQ(t, 1);
}

TEST(InParallel, ThreadsOfALoopHaveNumbersBelowTheArenasConcurrency) {
  for (const int threads : {1, 2, 3}) {
    tbb::task_arena arena(threads);
    std::vector<std::atomic<int>> inside(static_cast<size_t>(threads));
    arena.execute([&] {
      in_parallel(0, 2000, [&](int) {
        const int thread = thread_in_loop();
        ASSERT_GE(thread, 0);
        ASSERT_LT(thread, threads);
        EXPECT_EQ(++inside[static_cast<size_t>(thread)], 1) << "two threads with one number";
        --inside[static_cast<size_t>(thread)];
      });
    });
  }
}

// The sums are equal to the bit: rounding depends on the order of additions.
TEST(InParallel, SumsAreTheSameForAnyNumberOfThreads) {
  for (const int count : {0, 1, 31, 33, 2049, 5000}) {
    const auto sum = [&] {
      return sum_in_parallel(
          tbb::blocked_range<int>(0, count, 32), 0.0,
          [](const tbb::blocked_range<int>& part, double so_far) {
            for (int i = part.begin(); i < part.end(); ++i) so_far += 1.0 / (i + 1);
            return so_far;
          },
          [](double a, double b) { return a + b; });
    };
    double first = 0;
    tbb::task_arena(1).execute([&] { first = sum(); });
    for (const int threads : {2, 4}) tbb::task_arena(threads).execute([&] { EXPECT_EQ(sum(), first) << count; });
    double plain = 0;
    for (int i = 0; i < count; ++i) plain += 1.0 / (i + 1);
    EXPECT_NEAR(first, plain, 1e-9);
  }
}

}  // namespace
}  // namespace telesplat
