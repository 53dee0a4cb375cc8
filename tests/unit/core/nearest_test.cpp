#include "common/core/nearest.h"

#include <gtest/gtest.h>

#include <array>
#include <string>

namespace telesplat {
namespace {

TEST(Nearest, CountsInsertionsDeletionsChangesAndSwaps) {
  EXPECT_EQ(edit_distance("same", "same"), 0u);
  EXPECT_EQ(edit_distance("", "abc"), 3u);
  EXPECT_EQ(edit_distance("abc", ""), 3u);
  EXPECT_EQ(edit_distance("duration", "durationn"), 1u);
  EXPECT_EQ(edit_distance("size", "sise"), 1u);
  EXPECT_EQ(edit_distance("from", "form"), 1u) << "two neighbours swapped";
  EXPECT_EQ(edit_distance("kitten", "sitting"), 3u);
  EXPECT_LE(edit_distance(std::string(100000, 'a'), "b"), 200u) << "long texts cost no time";
}

TEST(Nearest, FindsTheNearestOrNothing) {
  constexpr std::array<std::string_view, 4> kWords = {"viridis", "plasma", "grey", "cool-warm"};
  EXPECT_EQ(nearest_word("virdis", kWords), "viridis");
  EXPECT_EQ(nearest_word("gray", kWords), "grey");
  EXPECT_EQ(nearest_word("plasma", kWords), "plasma");
  EXPECT_EQ(nearest_word("elephant", kWords), std::nullopt);
  EXPECT_EQ(nearest_word("", kWords), std::nullopt);
  EXPECT_EQ(nearest_word("x", {}), std::nullopt);
}

}  // namespace
}  // namespace telesplat
