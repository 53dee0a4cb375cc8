#include "client/displays/window/panel/widget_log.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "tests/support/files/own_folder.h"

namespace telesplat::viewer {
namespace {

constexpr WidgetLog::Rect kWindow{0, 0, 100, 100};

TEST(WidgetLog, ListsWhatTheNewestBuildHasAndWhatIsOutOfView) {
  WidgetLog log("");
  log.begin_build();
  log.enter("Display");
  log.seen("list", "splats", {10, 20, 30, 40}, kWindow, false);
  log.seen("button", "below", {10, 120, 30, 140}, kWindow, false);
  EXPECT_EQ(log.text(),
            "Display/below\tbutton\t10\t120\t30\t140\t1\t0\t0\n"
            "Display/splats\tlist\t10\t20\t30\t40\t1\t1\t0\n");
  log.begin_build();
  log.seen("button", "open ...", {0, 0, 5, 5}, kWindow, false);
  EXPECT_FALSE(log.widgets().find("Display/splats")->second.here);
  EXPECT_TRUE(log.widgets().find("open ...")->second.reachable);
}

TEST(WidgetLog, CountsADragOverManyBuildsAsOneUse) {
  WidgetLog log("");
  for (const bool used : {false, true, true, true, false, true}) {
    log.begin_build();
    log.seen("slider", "detail", {0, 0, 5, 5}, kWindow, used);
  }
  EXPECT_EQ(log.widgets().find("detail")->second.uses, 2u);
}

TEST(WidgetLog, OfTwoWidgetsOfANameTheFirstCounts) {
  WidgetLog log("");
  log.begin_build();
  log.seen("button", "take out", {0, 0, 10, 10}, kWindow, true);
  log.seen("button", "take out", {0, 50, 10, 60}, kWindow, true);
  EXPECT_EQ(log.widgets().find("take out")->second.rect.top, 0);
  EXPECT_EQ(log.widgets().find("take out")->second.uses, 1u);
}

TEST(WidgetLog, WritesTheListToItsFileWhenItChanges) {
  WidgetLog log(tests::own_folder() + "widgets");
  log.begin_build();
  log.seen("choice", "file=a\tb\nc", {0, 0, 5, 5}, kWindow, false);
  log.end_build();
  std::ifstream in(tests::own_folder() + "widgets");
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(in), {}), "file=a b c\tchoice\t0\t0\t5\t5\t1\t1\t0\n");
}

}  // namespace
}  // namespace telesplat::viewer
