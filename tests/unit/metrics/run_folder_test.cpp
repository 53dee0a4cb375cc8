// Ownership of a run folder's files: those of its record may be removed, other files may not.
#include "common/metrics/run_folder.h"

#include <sys/stat.h>

#include "tests/unit/metrics/record_fixture.h"

namespace telesplat::metrics {
namespace {

namespace fs = std::filesystem;

class RunFolder : public testing::Test {
 protected:
  RunFolder() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-folder-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~RunFolder() override { fs::remove_all(folder); }
  void put(const std::string& name) const {
    fs::create_directories(fs::path(folder + "/" + name).parent_path());
    std::ofstream(folder + "/" + name) << name;
  }
  bool has(const std::string& name) const { return fs::exists(folder + "/" + name); }

  std::string folder;
};

TEST_F(RunFolder, WhatIsNoRecordIsNeverRemovedNorWrittenThroughALink) {
  put("images/frame-000001.png");
  const auto refused = begin_folder(folder, true, Logs::kOurs);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("is no run's record"), std::string::npos) << refused.error().text;
  EXPECT_TRUE(has("images/frame-000001.png"));
  put("precious");
  fs::create_directories(folder + "/linked");
  fs::create_symlink(folder + "/precious", folder + "/linked/frames.csv");
  const auto linked = begin_folder(folder + "/linked", true, Logs::kOurs);
  ASSERT_FALSE(linked.ok());
  EXPECT_NE(linked.error().text.find("linked/frames.csv: is a symbolic link"), std::string::npos)
      << linked.error().text;
  EXPECT_EQ(fs::file_size(folder + "/precious"), 8u);
}

TEST_F(RunFolder, ARecordWithinItIsAnotherRuns) {
  ASSERT_TRUE(begin_folder(folder, false, Logs::kOurs).ok());
  put("frames.csv");
  put("viewer-2/images/frame-000000.png");
  for (const char* other : {"/second", "/viewer-third"}) {
    ASSERT_TRUE(begin_folder(folder + other, false, Logs::kOurs).ok());
    put(other + std::string("/frames.csv"));
  }
  EXPECT_EQ(recorded_files(folder), (std::vector<std::string>{"frames.csv", "viewer-2/images/frame-000000.png"}));
  ASSERT_TRUE(begin_folder(folder, true, Logs::kOurs).ok());
  EXPECT_FALSE(has("frames.csv") || has("viewer-2"));
  remove_record(folder, true);
  for (const char* other : {"second", "viewer-third"})
    EXPECT_TRUE(has(other + std::string("/frames.csv")) && has(other + std::string("/run.id"))) << other;
}

// The record contains command lines, paths and hosts.
TEST_F(RunFolder, ARecordIsForItsUserAlone) {
  const auto mode = [&](const std::string& name) { return fs::status(folder + "/" + name).permissions(); };
  const auto before = umask(0);
  fs::create_directory(folder + "/mine");
  fs::permissions(folder + "/mine", fs::perms(0755));
  for (const char* run : {"runs/new", "mine"}) {
    ASSERT_TRUE(begin_folder(folder + "/" + run, false, Logs::kOurs).ok());
    const auto record = RunRecord::open(folder + "/" + run);
    ASSERT_TRUE(record.ok());
    ASSERT_TRUE((*record)->write_file("session.toml", "a = 1\n").ok());
    ASSERT_TRUE((*record)->finish({}, {}).ok());
  }
  umask(before);
  EXPECT_EQ(mode("runs/new"), fs::perms::owner_all);
  EXPECT_EQ(mode("mine"), fs::perms(0755)) << "as its owner made it";
  for (const char* run : {"runs/new/", "mine/"})
    for (const char* file : {"frames.csv", "trace.json", "session.toml", "summary.json"})
      EXPECT_EQ(mode(run + std::string(file)), fs::perms(0600)) << run << file;
}

TEST_F(RunFolder, LogsAndEmptyFoldersAreNoStrangers) {
  put("today/master.log");
  std::filesystem::create_directories(folder + "/today/images");
  EXPECT_TRUE(refuse_strangers(folder + "/today", Logs::kOthers))
      << "whoever starts a session by hand keeps them there";
  EXPECT_FALSE(refuse_strangers(folder + "/today", Logs::kOurs));
  put("today/images/holiday.png");
  EXPECT_FALSE(begin_folder(folder + "/today", true, Logs::kOthers));
  EXPECT_FALSE(has("today/run.id"));
}

TEST_F(RunFolder, AReplacedRecordComesBackIfTheNewOneComesToNothing) {
  const auto first = begin_folder(folder, false, Logs::kOurs);
  ASSERT_TRUE(first.ok());
  for (const char* name : {"frames.csv", "images/frame-000000.png", "viewer-2/images/wall.png", "mine.txt"}) put(name);
  const auto replace = [&] {
    const auto begun = begin_folder(folder, true, Logs::kOurs);
    EXPECT_TRUE(begun.ok() && *begun != *first);
    EXPECT_FALSE(has("frames.csv") || has("images") || has("viewer-2"));
    put("frames.csv");
    put("tiles.csv");
  };
  replace();
  remove_record(folder, false);
  EXPECT_EQ(folder_id(folder), *first);
  for (const char* name : {"frames.csv", "images/frame-000000.png", "viewer-2/images/wall.png", "mine.txt"})
    EXPECT_TRUE(has(name)) << name;
  EXPECT_FALSE(has("tiles.csv") || has(".replaced"));

  replace();
  forget_replaced(folder);
  EXPECT_TRUE(has("tiles.csv") && has("mine.txt") && !has(".replaced"));
  remove_record(folder, false);
  EXPECT_FALSE(has("frames.csv") || has("tiles.csv") || has("run.id")) << "nothing is left to come back";
  EXPECT_TRUE(has("mine.txt"));
}

}  // namespace
}  // namespace telesplat::metrics
