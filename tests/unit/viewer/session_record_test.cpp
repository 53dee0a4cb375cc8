// A viewer records into the folder that the master names only if the folder on this machine has the run's id.
#include "client/viewer/session_record.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "common/metrics/run_folder.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

class JoinedRecord : public testing::Test {
 protected:
  JoinedRecord() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-joined-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    session_.facts = {{"run_folder", folder_ + "/run"},
                      {"run_id", *metrics::begin_folder(folder_ + "/run", false, metrics::Logs::kOthers)}};
  }
  ~JoinedRecord() override { fs::remove_all(folder_); }
  // Folder, within the session's, where a viewer records.
  std::string joined() const {
    const auto record = SessionRecord::open({.out = {}, .join = true, .name = "guest", .points_mb = 1});
    (*record)->follow(session_);
    return (*record)->records_in();
  }

  std::string folder_;
  wire::Welcome session_;
};

TEST_F(JoinedRecord, TheFirstViewerTakesTheFolderOthersOneInIt) {
  EXPECT_EQ(joined(), ".");
  EXPECT_EQ(joined(), "viewer-guest");
}

TEST_F(JoinedRecord, ItIsForItsUserAlone) {
  const auto before = umask(0);
  EXPECT_EQ(joined(), ".");
  EXPECT_EQ(joined(), "viewer-guest");
  umask(before);
  for (const char* name : {"/run/images", "/run/spool", "/run/viewer-guest", "/run/viewer-guest/images"})
    EXPECT_EQ(fs::status(folder_ + name).permissions(), fs::perms::owner_all) << name;
}

// Otherwise the second viewer would write into the first one's files, draw its frames and take its spool away.
TEST_F(JoinedRecord, AFolderThatAViewerWasToldIsTaken) {
  const auto first = SessionRecord::open({.out = folder_ + "/run", .join = true, .name = "first", .points_mb = 1});
  ASSERT_TRUE(first) << first.error().text;
  EXPECT_EQ(joined(), "viewer-guest");
  (*first)->follow(session_);
  EXPECT_EQ((*first)->records_in(), ".");
}

// Otherwise the second viewer would write over the first one's files.
TEST_F(JoinedRecord, TwoViewersThatAreToldOneFolderDoNotShareIt) {
  for (const char* folder : {"/own", "/run"}) {
    const RecordOptions told{.out = folder_ + folder, .join = true, .name = "guest", .points_mb = 0};
    auto first = SessionRecord::open(told);
    ASSERT_TRUE(first) << first.error().text;
    const auto second = SessionRecord::open(told);
    ASSERT_FALSE(second);
    EXPECT_NE(second.error().text.find("another viewer records there"), std::string::npos) << second.error().text;
    first->reset();
    EXPECT_TRUE(SessionRecord::open(told)) << "once the first is gone";
  }
}

TEST_F(JoinedRecord, NothingIsWrittenThroughLinks) {
  std::ofstream(folder_ + "/precious") << "mine";
  for (const char* name : {"images", "spool", "points.events", "slices.events"}) {
    fs::create_symlink(folder_ + "/precious", folder_ + "/run/" + name);
    EXPECT_EQ(joined(), "") << name;
    fs::remove(folder_ + "/run/" + name);
  }
  EXPECT_EQ(fs::file_size(folder_ + "/precious"), 4u);
  EXPECT_FALSE(fs::exists(folder_ + "/run/viewer-guest"));
}

TEST_F(JoinedRecord, AFolderWithARecordIsRefused) {
  const std::string mine = folder_ + "/mine";
  fs::create_directories(mine + "/spool");
  std::ofstream(mine + "/spool/00000001.frame") << "of an earlier run";
  std::ofstream(mine + "/points.events") << "too";
  const auto refused = SessionRecord::open({.out = mine, .join = true, .name = "guest", .points_mb = 1});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().text.find("holds a record already"), std::string::npos) << refused.error().text;
  EXPECT_EQ(fs::file_size(mine + "/points.events"), 3u);
  EXPECT_TRUE(SessionRecord::open({.out = folder_ + "/run", .join = true, .name = "guest", .points_mb = 1}))
      << "the session's own";
}

TEST_F(JoinedRecord, WhatCannotBeWrittenIsCounted) {
  fs::create_directories(folder_ + "/own");
  const auto record = SessionRecord::open({.out = folder_ + "/own", .join = true, .name = "guest", .points_mb = 1});
  ASSERT_TRUE(record) << record.error().text;
  // Every write fails, as on a full disk.
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &none);
  (*record)->events()->begin_replica({});
  const uint64_t failed = (*record)->files_failed();
  setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(failed, 1u);
  EXPECT_TRUE((*record)->events()->failed());
}

TEST_F(JoinedRecord, AnotherRunsFolderIsLeftAlone) {
  session_.facts["run_id"] = "0123";
  EXPECT_EQ(joined(), "");
  EXPECT_FALSE(fs::exists(folder_ + "/run/images"));
}

}  // namespace
}  // namespace telesplat::viewer
