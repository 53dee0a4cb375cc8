// --overwrite removes neither files that the run will read nor files that another session writes.
#include "tools/telesplat/run/run_options.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "common/net/session_file.h"
#include "tests/support/files/own_folder.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class Overwrite : public testing::Test {
 protected:
  Overwrite() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-overwrite-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    setenv("TELESPLAT_RUNTIME", (folder_ + "/runtime").c_str(), 1);
    options_.out = folder_ + "/run";
    options_.data.scene = file("mine.ply");
    file("images/frame-000000.png");
    options_.overwrite = true;
  }
  ~Overwrite() override {
    unsetenv("TELESPLAT_RUNTIME");
    fs::remove_all(folder_);
  }
  std::string file(const std::string& name) const {
    const std::string path = options_.out + "/" + name;
    fs::create_directories(fs::path(path).parent_path());
    std::ofstream(path) << name;
    return path;
  }
  std::string refusal() const {
    const Status s = check_overwrite(options_);
    return s.ok() ? "" : s.error().text;
  }

  std::string folder_;
  RunOptions options_;
};

TEST_F(Overwrite, FilesOfTheRecordThatTheRunReadsAreRefused) {
  EXPECT_EQ(refusal(), "") << "the scene lies there, but is no part of the record";
  options_.viewer.head.trajectory = file("frames.csv");
  EXPECT_NE(refusal().find("/frames.csv: is part of the record that --overwrite would remove"), std::string::npos);
  fs::create_symlink(options_.out + "/frames.csv", folder_ + "/path.csv");
  options_.viewer.head.trajectory = folder_ + "/path.csv";
  EXPECT_NE(refusal().find("/path.csv: is part of"), std::string::npos);
  options_.viewer.head.trajectory = "orbit";
  EXPECT_EQ(refusal(), "");
  options_.data.scene = options_.out + "/images";
  EXPECT_NE(refusal().find("/images: is part of"), std::string::npos) << "a folder of files";
}

TEST_F(Overwrite, ARecordThatIsBeingWrittenIsRefused) {
  const net::RunningSession session{.address = "tcp://127.0.0.1:4711",
                                    .pid = uint64_t(getpid()),
                                    .scene = {},
                                    .kind = {},
                                    .run_folder = net::absolute_path(options_.out),
                                    .started_at_s = 1.7e9,
                                    .started_by = "run",
                                    .keys = {}};
  {
    const auto running = net::SessionFile::publish(session);
    ASSERT_TRUE(running.ok()) << running.error().text;
    EXPECT_NE(refusal().find("the session at tcp://127.0.0.1:4711"), std::string::npos) << refusal();
  }
  EXPECT_EQ(refusal(), "") << "it has ended";
}

TEST(DatedFolder, ASecondOneOfTheSameSecondHasItsOwnName) {
  const fs::path before = fs::current_path();
  fs::current_path(tests::own_folder());
  std::set<std::string> names;
  for (int i = 0; i < 5; ++i) {
    const std::string name = dated_folder("sweep-");
    EXPECT_TRUE(name.starts_with("runs/sweep-2")) << name;
    EXPECT_TRUE(fs::create_directories(name)) << name;
    names.insert(name);
  }
  EXPECT_EQ(names.size(), 5u);
  fs::current_path(before);
}

}  // namespace
}  // namespace telesplat::launcher
