// Folders as the dialog lists them, recently opened data sets, lines of the launcher.
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "client/displays/window/opening.h"
#include "client/displays/window/panel/file_list.h"
#include "client/viewer/recent_files.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

class Files : public testing::Test {
 protected:
  Files() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-files-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
  }
  ~Files() override {
    std::error_code error;
    fs::remove_all(folder_, error);
  }
  std::string make(const std::string& name, size_t bytes) const {
    const std::string path = folder_ + "/" + name;
    std::ofstream(path, std::ios::binary) << std::string(bytes, 'x');
    return path;
  }
  std::string folder_;
};

TEST_F(Files, AFolderListsFoldersFirstAndNothingHidden) {
  make("b.ply", 12), make("a.mhd", 3), make(".hidden", 1);
  fs::create_directory(folder_ + "/z");
  const auto listing = read_folder(folder_ + "/");
  EXPECT_EQ(listing.folder, folder_);
  EXPECT_TRUE(listing.problem.empty());
  const std::vector<FileList::Entry> wanted{{"z", true, 0}, {"a.mhd", false, 3}, {"b.ply", false, 12}};
  EXPECT_EQ(listing.entries, wanted);
  const auto missing = read_folder(folder_ + "/missing");
  EXPECT_NE(missing.problem.find("missing"), std::string::npos) << missing.problem;
}

TEST_F(Files, AFolderIsReadInTheBackground) {
  make("a.ply", 1);
  FileList list;
  EXPECT_EQ(list.listing(), nullptr);
  list.go(folder_);
  for (int i = 0; i < 2000 && list.busy(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  ASSERT_NE(list.listing(), nullptr);
  EXPECT_EQ(list.listing()->entries.size(), 1u);
}

TEST_F(Files, RecentDataSetsAreNewestFirstAndBounded) {
  const std::string list = folder_ + "/config/recent";
  EXPECT_TRUE(read_recent(list).empty());
  const std::string a = make("a.ply", 1);
  ASSERT_TRUE(add_recent(list, a));
  ASSERT_TRUE(add_recent(list, "julia"));
  ASSERT_TRUE(add_recent(list, folder_ + "/config/../a.ply"));
  EXPECT_EQ(read_recent(list), (std::vector<std::string>{a, "julia"}));
  for (int i = 0; i < 30; ++i) ASSERT_TRUE(add_recent(list, "set-" + std::to_string(i)));
  const auto all = read_recent(list);
  ASSERT_EQ(all.size(), kMostRecent);
  EXPECT_EQ(all.front(), "set-29");
  EXPECT_FALSE(add_recent(list, "two\nlines"));
  EXPECT_FALSE(add_recent("/proc/nowhere/recent", "julia"));
  EXPECT_EQ(read_recent(list), all);
}

TEST(LauncherLines, ComeWholeAndAreNotWaitedFor) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  LauncherLines lines(ends[0]);
  EXPECT_TRUE(lines.read().empty());
  const auto say = [&](const std::string& text) {
    ASSERT_EQ(write(ends[1], text.data(), text.size()), ssize_t(text.size()));
  };
  say("progress reading 4");
  EXPECT_TRUE(lines.read().empty());
  say("3 %\nproblem no\nhal");
  EXPECT_EQ(lines.read(), (std::vector<std::string>{"progress reading 43 %", "problem no"}));
  say(std::string(3 * LauncherLines::kLongest, 'y') + "\n");
  EXPECT_EQ(lines.read().at(0).size(), LauncherLines::kLongest);
  close(ends[1]);
  EXPECT_TRUE(lines.read().empty());
  EXPECT_FALSE(lines.open());
  close(ends[0]);
  EXPECT_TRUE(LauncherLines(-1).read().empty());
}

}  // namespace
}  // namespace telesplat::viewer
