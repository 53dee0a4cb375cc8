// Lines of files that may be anything, and JSON files likewise.
#include "tools/common/line_reader.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <tuple>
#include <vector>

#include "tools/common/json_file.h"

namespace telesplat::tools {
namespace {

using Lines = std::vector<std::tuple<std::string, uint64_t, bool>>;

Lines lines_of(const std::string& text, size_t most) {
  std::istringstream in(text);
  LineReader reader(in, most);
  Lines out;
  while (const auto line = reader.next()) out.emplace_back(line->text, line->left_out, line->ended);
  EXPECT_EQ(reader.bytes(), text.size());
  EXPECT_FALSE(reader.next());
  return out;
}

TEST(LineReader, GivesLinesAndSaysWhatItLeftOut) {
  EXPECT_EQ(lines_of("", 4), Lines{});
  EXPECT_EQ(lines_of("\n", 4), (Lines{{"", 0, true}}));
  EXPECT_EQ(lines_of("ab\n\nabcd\nabcdef\nx", 4),
            (Lines{{"ab", 0, true}, {"", 0, true}, {"abcd", 0, true}, {"abcd", 2, true}, {"x", 0, false}}));
  EXPECT_EQ(lines_of("abcdef", 0), (Lines{{"", 6, false}}));
}

TEST(LineReader, FindsLineEndsWhereverItsBuffersEnd) {
  for (const size_t length : {65'534, 65'535, 65'536, 65'537, 200'000}) {
    const std::string text(length, 'x');
    EXPECT_EQ(lines_of(text + "\nb\n", 1000), (Lines{{std::string(1000, 'x'), length - 1000, true}, {"b", 0, true}}));
    EXPECT_EQ(lines_of(text, 300'000), (Lines{{text, 0, false}}));
  }
}

TEST(JsonFile, IsReadIfItIsOneAndNeitherLargeNorDeep) {
  const std::string path = (std::filesystem::temp_directory_path() / "telesplat-json-file-test.json").string();
  const auto read = [&](const std::string& text) {
    std::ofstream(path) << text;
    return read_json_file(path);
  };
  EXPECT_EQ(read("{\"a\": [1, 2]}").at("a")[1], 2);
  EXPECT_TRUE(read("{\"a\": ").is_discarded());
  EXPECT_TRUE(read("").is_discarded());
  EXPECT_TRUE(read("{\"a\": 1e999}").is_discarded()) << "no number is infinite";
  EXPECT_TRUE(read(std::string(1'000'000, '[')).is_discarded());
  const auto deep = read("[1," + std::string(1'000'000, '[') + std::string(1'000'000, ']') + "]");
  ASSERT_TRUE(deep.is_array());
  EXPECT_EQ(deep[0], 1);
  EXPECT_LT(deep.dump().size(), 3u * kDeepestJson);
  std::filesystem::resize_file(path, kMostJsonBytes + 1);
  EXPECT_TRUE(read_json_file(path).is_discarded());
  std::filesystem::remove(path);
  EXPECT_TRUE(read_json_file(path).is_discarded());
  EXPECT_TRUE(read_json_file(std::filesystem::temp_directory_path().string()).is_discarded());
}

}  // namespace
}  // namespace telesplat::tools
