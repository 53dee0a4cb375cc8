// Files that are read or written as a whole, with any content.
#include "common/core/whole_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

namespace telesplat {
namespace {

namespace fs = std::filesystem;

class WholeFile : public testing::Test {
 protected:
  WholeFile() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-whole-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~WholeFile() override { fs::remove_all(folder_); }
  std::string put(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name) << text;
    return folder_ / name;
  }
  std::string refusal(const std::string& path, uint64_t most = 100) const {
    const auto read = read_whole(path, most);
    const Status checked = check_readable(path, most);
    EXPECT_FALSE(checked.ok() || read.ok()) << path;
    if (read.ok() || checked.ok()) return {};
    EXPECT_EQ(read.error().text, checked.error().text);
    EXPECT_TRUE(read.error().text.starts_with(path + ": ")) << read.error().text;
    return read.error().text.substr(path.size() + 2);
  }

  fs::path folder_;
};

TEST_F(WholeFile, IsReadUpToItsLimit) {
  const std::string text(100, 'x'), path = put("a", text);
  const auto read = read_whole(path, 100);
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(*read, text);
  EXPECT_TRUE(check_readable(path, 100).ok());
  EXPECT_EQ(refusal(path, 99), "has 100 bytes, limit 99");
  EXPECT_EQ(*read_whole(put("empty", ""), 0), "");
  // The length of these files is unknown before they are read.
  EXPECT_TRUE(read_whole("/proc/self/stat", 4096).ok());
  EXPECT_FALSE(read_whole("/proc/self/stat", 10).ok());
}

TEST_F(WholeFile, WhatIsNoFileIsNotWaitedFor) {
  const std::string pipe = folder_ / "pipe", link = folder_ / "link";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  fs::create_symlink("/dev/zero", link);
  for (const std::string& path : {pipe, link, std::string("/dev/zero")})
    EXPECT_EQ(refusal(path), "is not a regular file");
  EXPECT_EQ(refusal(folder_), "is a folder");
  EXPECT_EQ(refusal(folder_ / "none"), "cannot be read: No such file or directory");
}

TEST_F(WholeFile, IsReplacedAndNothingIsWrittenThroughLinks) {
  const std::string precious = put("precious", "precious"), path = folder_ / "a";
  for (const char* name : {"a", "a.part"}) fs::create_symlink(precious, folder_ / name);
  ASSERT_TRUE(write_whole(path, "new").ok());
  EXPECT_EQ(*read_whole(path, 100), "new");
  EXPECT_FALSE(fs::is_symlink(path));
  EXPECT_EQ(*read_whole(precious, 100), "precious");
  ASSERT_TRUE(write_whole(path, "newer").ok());
  EXPECT_EQ(*read_whole(path, 100), "newer");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 3) << "nothing else is left";
}

TEST_F(WholeFile, ThatCannotBeWrittenLeavesNothingBehind) {
  const std::string missing = folder_ / "none/a";
  const Status into_none = write_whole(missing, "x");
  ASSERT_FALSE(into_none.ok());
  EXPECT_EQ(into_none.error().text, missing + ": cannot be written: No such file or directory");
  fs::create_directories(folder_ / "full/inside");
  EXPECT_FALSE(write_whole(folder_ / "full", "x").ok()) << "a folder that is not empty is not replaced";
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), fs::directory_iterator()), 1);
}

TEST_F(WholeFile, PartsHaveNamesThatNobodyHad) {
  const std::string path = folder_ / "a";
  const auto first = new_part(path), second = new_part(path);
  ASSERT_TRUE(first.ok() && second.ok());
  EXPECT_NE(*first, *second);
  EXPECT_TRUE(fs::is_empty(*first) && fs::is_empty(*second));
}

}  // namespace
}  // namespace telesplat
