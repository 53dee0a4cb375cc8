// Tables of comma-separated values: accepted texts, and limits.
#include "tools/common/csv_table.h"

#include <gtest/gtest.h>

#include "tests/support/files/memory_file.h"

namespace telesplat::tools {
namespace {

Result<CsvTable> read(const std::string& text, const CsvTable::Limits& limits = {}) {
  const test::MemoryFile file({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  return CsvTable::read(file.path(), limits);
}

// A short text lies within its std::string, and moves with it. runs_fuzz found the error.
TEST(CsvTable, MovesWithItsText) {
  auto table = read("a,b\n1,2\n3,x\n");
  ASSERT_TRUE(table) << table.error().text;
  const CsvTable moved = std::move(*table);
  *table = *read("c,d\n7,8\n9,0\n");
  const CsvTable copy = moved;
  for (const CsvTable* t : {&moved, &copy}) {
    ASSERT_EQ(t->rows(), 2u);
    EXPECT_EQ(t->text(0, 1), "2");
    EXPECT_EQ(t->numbers(0), (std::vector<double>{1, 3}));
    EXPECT_FALSE(t->number(1, 1)) << "x is no number";
  }
}

TEST(CsvTable, TakesNoLongLineAndNotTooManyRows) {
  EXPECT_TRUE(read("a\n" + std::string(20, '1') + "\n", {.line_bytes = 20}));
  const auto longer = read("a\n" + std::string(21, '1') + "\n", {.line_bytes = 20});
  ASSERT_FALSE(longer);
  EXPECT_TRUE(longer.error().text.ends_with(":2: a line of more than 20 bytes")) << longer.error().text;
  EXPECT_TRUE(read("a\n1\n2\n", {.rows = 2}));
  const auto more = read("a\n1\n2\n3\n", {.rows = 2});
  ASSERT_FALSE(more);
  EXPECT_TRUE(more.error().text.ends_with(":4: more than 2 rows")) << more.error().text;
}

}  // namespace
}  // namespace telesplat::tools
