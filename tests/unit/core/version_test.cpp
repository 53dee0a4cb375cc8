#include "common/core/version.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <regex>

namespace telesplat {
namespace {

namespace fs = std::filesystem;

TEST(Version, NamesVersionAndWhereKnownCommitAndDate) {
  EXPECT_TRUE(std::regex_match(version(), std::regex(R"(\d+\.\d+\.\d+(-dev)?( \([0-9A-Za-z]+, \d{4}-\d\d-\d\d\))?)")))
      << version();
}

// Output of the build's script for sources in a folder of their own.
class VersionScript : public testing::Test {
 protected:
  VersionScript() {
    folder_ = fs::temp_directory_path() /
              (std::string("telesplat-version-") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_ / "cmake");
  }
  ~VersionScript() override { fs::remove_all(folder_); }

  std::string written(const std::string& more = {}) const {
    const std::string out = folder_ / "out.cpp";
    const std::string command = "cmake -D VERSION=1.2.3 -D SOURCE=" + folder_.string() + " -D OUT=" + out + " " + more +
                                " -P " + fs::absolute("cmake/version.cmake").string() + " > /dev/null 2>&1";
    if (std::system(command.c_str()) != 0) return "the script failed";
    std::ifstream in(out);
    const std::string text((std::istreambuf_iterator<char>(in)), {});
    std::smatch found;
    return std::regex_search(text, found, std::regex("return \"(.*)\";")) ? found[1].str() : text;
  }
  void archived(const std::string& text) const { std::ofstream(folder_ / "cmake/commit.txt") << text << "\n"; }
  bool git(const std::string& command) const {
    return std::system(
               ("git -C " + folder_.string() + " -c user.name=a -c user.email=a@b " + command + " > /dev/null 2>&1")
                   .c_str()) == 0;
  }
  fs::path folder_;
};

TEST_F(VersionScript, WorksFromATarball) {
  EXPECT_EQ(written(), "1.2.3-dev");
  archived("$Format:%h,%cs %D$");
  EXPECT_EQ(written(), "1.2.3-dev") << "of a copied checkout";
  archived("5ad84a7,2026-11-22 HEAD -> main");
  EXPECT_EQ(written(), "1.2.3-dev (5ad84a7, 2026-11-22)") << "of git archive";
  archived("5ad84a7,2026-11-22 tag: v1.2.3, main");
  EXPECT_EQ(written(), "1.2.3 (5ad84a7, 2026-11-22)") << "of a release";
  EXPECT_EQ(written("-D COMMIT=abc1234,2027-01-02"), "1.2.3-dev (abc1234, 2027-01-02)");
}

TEST_F(VersionScript, FollowsTheCommitOfACheckout) {
  if (!git("init -q")) GTEST_SKIP() << "no git";
  const auto commit = [&] { return git("commit -q --allow-empty -m x --date 2020-01-02T00:00:00Z"); };
  setenv("GIT_COMMITTER_DATE", "2020-01-02T12:00:00Z", 1);
  ASSERT_TRUE(commit());
  const std::string first = written();
  EXPECT_TRUE(std::regex_match(first, std::regex(R"(1\.2\.3-dev \([0-9a-f]{7,}, 2020-01-02\))"))) << first;
  const auto time = fs::last_write_time(folder_ / "out.cpp");
  EXPECT_EQ(written(), first);
  EXPECT_EQ(fs::last_write_time(folder_ / "out.cpp"), time) << "nothing is compiled again";
  setenv("GIT_COMMITTER_DATE", "2020-01-03T12:00:00Z", 1);
  ASSERT_TRUE(commit());
  EXPECT_NE(written(), first);
  ASSERT_TRUE(git("tag v1.2.3"));
  EXPECT_TRUE(written().starts_with("1.2.3 (")) << written();
  unsetenv("GIT_COMMITTER_DATE");
}

}  // namespace
}  // namespace telesplat
