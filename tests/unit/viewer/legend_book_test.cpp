#include "client/viewer/legend_book.h"

#include <gtest/gtest.h>

#include "common/scene/legend.h"

namespace telesplat::viewer {
namespace {

wire::Welcome session(uint64_t epoch, const std::string& array) {
  wire::Welcome out;
  out.epoch = {epoch};
  if (!array.empty())
    out.facts[scene::kColouringFact] =
        scene::to_text(scene::Colouring{array, "", 0, 1, 0, *colour::find_colour_map("viridis")});
  return out;
}

std::string title(const LegendBook& book, uint64_t epoch) {
  const auto legend = book.at({epoch});
  return legend ? legend->title : "";
}

TEST(LegendBook, EveryEpochKeepsItsOwnLegend) {
  LegendBook book;
  EXPECT_EQ(title(book, 1), "");
  book.follow(session(1, ""));
  book.follow(session(2, "pressure"));
  book.follow(session(4, "speed"));
  book.follow(session(7, ""));
  EXPECT_EQ(title(book, 1), "");
  EXPECT_EQ(title(book, 2), "pressure");
  EXPECT_EQ(title(book, 3), "pressure") << "nothing was told of it";
  EXPECT_EQ(title(book, 4), "speed") << "frames of the epoch before are on display still";
  EXPECT_EQ(title(book, 6), "speed");
  EXPECT_EQ(title(book, 8), "");
}

TEST(LegendBook, WhatIsToldTwiceIsOneLegend) {
  LegendBook book;
  book.follow(session(1, "pressure"));
  const auto first = book.at({1});
  for (uint64_t epoch = 1; epoch < 1000; ++epoch) book.follow(session(epoch, "pressure"));
  EXPECT_EQ(book.at({999}), first) << "the window draws it once";
}

TEST(LegendBook, TheSameEpochMayBeToldMoreAndAnotherMasterCountsAnew) {
  LegendBook book;
  book.follow(session(1, ""));
  book.follow(session(1, "pressure"));
  EXPECT_EQ(title(book, 1), "pressure");
  book.follow(session(9, "speed"));
  book.follow(session(1, "depth"));
  EXPECT_EQ(title(book, 1), "depth");
  EXPECT_EQ(title(book, 9), "depth");
}

}  // namespace
}  // namespace telesplat::viewer
