// Tables for people line up, with any texts in their cells.
#include "tools/common/text_table.h"

#include <gtest/gtest.h>

namespace telesplat::tools {
namespace {

TEST(TextTable, ColumnsAreAsWideAsWhatStandsInThem) {
  TextTable table({{"name", false}, {"fps"}, {"unused"}, {"state", false}});
  table.add({"viewer-1", "59.1", "", "ok"});
  table.add({"caf\xc3\xa9", "7", "", "gone"});
  table.add({"v"});
  EXPECT_EQ(table.text("  "),
            "  name       fps  state\n"
            "  viewer-1  59.1  ok\n"
            "  caf\xc3\xa9         7  gone\n"
            "  v\n");
}

TEST(TextTable, LongTextsAreShortenedBetweenCharacters) {
  EXPECT_EQ(shortened("sampler", 7), "sampler");
  EXPECT_EQ(shortened("sampler-1", 7), "samp...");
  EXPECT_EQ(shortened("\xc3\xa4\xc3\xb6\xc3\xbc\xc3\x9f-1", 6), "\xc3\xa4\xc3\xb6\xc3\xbc\xc3\x9f-1");
  EXPECT_EQ(shortened("\xc3\xa4\xc3\xb6\xc3\xbc\xc3\x9f-12", 6), "\xc3\xa4\xc3\xb6\xc3\xbc...");
}

}  // namespace
}  // namespace telesplat::tools
