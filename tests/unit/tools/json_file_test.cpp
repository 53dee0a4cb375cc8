// JSON files with any content.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tools/common/json_file.h"

namespace telesplat::tools {
namespace {

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
