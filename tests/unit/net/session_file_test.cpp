// Masters leave files so that their sessions are found: they are read back, stale ones are removed, strange ones are
// skipped.
#include "common/net/session_file.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/net/master_address.h"
#include "common/net/service.h"

namespace telesplat::net {
namespace {

namespace fs = std::filesystem;

RunningSession session(const std::string& address = "tcp://127.0.0.1:4711") {
  return {.address = address,
          .pid = uint64_t(getpid()),
          .scene = "crater.ply",
          .kind = "mesh",
          .run_folder = "/data/runs/first",
          .started_at_s = 1.7e9,
          .started_by = "run",
          .keys = {}};
}

class SessionFiles : public testing::Test {
 protected:
  SessionFiles() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-sessions-XXXXXX").string();
    folder_ = std::string(mkdtemp(pattern.data())) + "/runtime";
    setenv("TELESPLAT_RUNTIME", folder_.c_str(), 1);
  }
  ~SessionFiles() override {
    unsetenv("TELESPLAT_RUNTIME");
    fs::remove_all(fs::path(folder_).parent_path());
  }
  // Returns the only file.
  fs::path file() const { return fs::directory_iterator(folder_)->path(); }
  size_t files() const { return size_t(std::distance(fs::directory_iterator(folder_), fs::directory_iterator())); }
  nlohmann::json content() const { return nlohmann::json::parse(std::ifstream(file())); }
  void put(const std::string& name, const std::string& text) const { std::ofstream(folder_ + "/" + name) << text; }

  std::string folder_;
};

TEST_F(SessionFiles, AreReadAsTheyWereWrittenAndGoWithTheSession) {
  {
    auto file = SessionFile::publish(session());
    ASSERT_TRUE(file.ok()) << file.error().text;
    EXPECT_EQ(running_sessions(), std::vector{session()});
    RunningSession more = session();
    more.scene =
        "\xff\x1b[31m\xc2\x9b"
        "2J.ply";  // invalid UTF-8, and bytes that steer a terminal
    ASSERT_TRUE(file->update(more).ok());
    ASSERT_EQ(running_sessions().size(), 1u);
    EXPECT_EQ(running_sessions().front().scene, "\xef\xbf\xbd?[31m?2J.ply");
    more.scene = std::string(100000, 'x');
    ASSERT_TRUE(file->update(more).ok());
    EXPECT_EQ(running_sessions().size(), 1u) << "found, whatever its scene is called";
    struct stat about {};
    ASSERT_EQ(stat(folder_.c_str(), &about), 0);
    EXPECT_EQ(about.st_mode & 07777, 0700u);
  }
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_EQ(files(), 0u);
}

TEST_F(SessionFiles, OfTheDeadAreRemoved) {
  ASSERT_TRUE(RuntimeFolder::make().ok());
  const pid_t child = fork();
  if (child == 0) {
    const auto file = SessionFile::publish([] {
      auto s = session();
      s.pid = uint64_t(getpid());
      return s;
    }());
    _exit(file.ok() ? 0 : 1);  // without removing the file, as if killed
  }
  int status = 0;
  // The process is dead, and its parent has not noticed.
  siginfo_t info;
  ASSERT_EQ(waitid(P_PID, id_t(child), &info, WEXITED | WNOWAIT), 0);
  ASSERT_EQ(files(), 1u);
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_EQ(files(), 0u);
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
}

TEST_F(SessionFiles, OfAProcessNumberThatIsUsedAgainAreRemoved) {
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  auto json = content();
  const fs::path path = this->file();
  json["process_start"] = json["process_start"].get<uint64_t>() - 1;
  std::ofstream(path) << json.dump();
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_EQ(files(), 0u);
}

TEST_F(SessionFiles, OfTheMachineBeforeItStartedAnewAreRemoved) {
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  auto json = content();
  const fs::path path = this->file();
  json["boot"] = "another";
  std::ofstream(path) << json.dump();
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_EQ(files(), 0u);
}

// In a shared folder, process numbers of other machines mean nothing here.
TEST_F(SessionFiles, OfOtherMachinesAndContainersStay) {
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  const auto json = content();
  const fs::path path = this->file();
  for (const char* key : {"host", "numbers"}) {
    auto other = json;
    other[key] = "another";
    std::ofstream(path) << other.dump();
    EXPECT_TRUE(running_sessions().empty()) << key;
    EXPECT_EQ(files(), 1u) << key;
  }
}

TEST_F(SessionFiles, ThatAreStrangeArePassedOver) {
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  const auto good = content();
  put("session-1.json", "");
  put("session-2.json", "not JSON");
  put("session-3.json", "[1, 2]");
  put("session-4.json", "{\"pid\": 1}");
  put("session-5.json", std::string(200000, '['));
  put("session-6.json", "{\"address\": \"" + std::string(10 << 20, 'x') + "\"}");
  int number = 10;
  for (const auto& [key, value] : good.items())
    for (const auto& wrong :
         {nlohmann::json(), nlohmann::json(-1), nlohmann::json("\xef\xbf\xbd"), nlohmann::json({1})}) {
      auto json = good;
      json[key] = wrong;
      if (key == "address" || !wrong.is_string() || !value.is_string())
        put("session-" + std::to_string(++number) + ".json", json.dump());
    }
  auto elsewhere = good;
  elsewhere["address"] = "file:///etc/passwd";
  put("session-7.json", elsewhere.dump());
  put("something.else", good.dump());
  fs::create_directory(folder_ + "/session-8.json");
  fs::create_symlink(this->folder_ + "/something.else", folder_ + "/session-9.json");
  ASSERT_EQ(mkfifo((folder_ + "/session-10.json").c_str(), 0600), 0);
  const size_t before = files();
  // A file like ours, except that its time of beginning is not a time.
  EXPECT_EQ(running_sessions().size(), 2u) << "the good one, and that which began before 1970";
  EXPECT_EQ(files(), before);
}

TEST_F(SessionFiles, AFolderThatIsNotOursAloneIsNotUsed) {
  fs::create_directory(folder_);
  fs::permissions(folder_, fs::perms::all);
  EXPECT_FALSE(SessionFile::publish(session()).ok());
  fs::permissions(folder_, fs::perms::owner_all);
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  fs::permissions(folder_, fs::perms::all);
  EXPECT_TRUE(running_sessions().empty());
  fs::rename(folder_, folder_ + "-real");
  fs::permissions(folder_ + "-real", fs::perms::owner_all);
  fs::create_symlink(folder_ + "-real", folder_);
  EXPECT_TRUE(running_sessions().empty()) << "a link";
  fs::remove(folder_);
  std::ofstream(folder_) << "a file";
  const auto refused = SessionFile::publish(session());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find(folder_), std::string::npos);
}

TEST(RuntimeFolders, FollowTheEnvironment) {
  unsetenv("TELESPLAT_RUNTIME");
  setenv("XDG_RUNTIME_DIR", "/run/user/7", 1);
  const std::string common = "/tmp/telesplat-" + std::to_string(geteuid());
  EXPECT_EQ(RuntimeFolder::candidates(), (std::vector<std::string>{"/run/user/7/telesplat", common}));
  unsetenv("XDG_RUNTIME_DIR");
  EXPECT_EQ(RuntimeFolder::candidates(), std::vector<std::string>{common});
  setenv("TELESPLAT_RUNTIME", "/elsewhere", 1);
  EXPECT_EQ(RuntimeFolder::candidates(), std::vector<std::string>{"/elsewhere"});
  unsetenv("TELESPLAT_RUNTIME");
}

TEST_F(SessionFiles, OfOtherUsersArePassedOver) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can give files away";
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  ASSERT_EQ(chown(this->file().c_str(), 12345, 12345), 0);
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_EQ(files(), 1u);
  ASSERT_EQ(chown(this->file().c_str(), 0, 0), 0);
  EXPECT_EQ(running_sessions().size(), 1u);
  ASSERT_EQ(chown(folder_.c_str(), 12345, 12345), 0);
  EXPECT_TRUE(running_sessions().empty());
  EXPECT_FALSE(SessionFile::publish(session()).ok());
}

TEST_F(SessionFiles, LeadToTheOneMaster) {
  const auto none = find_master("auto");
  EXPECT_EQ(none.address, "");
  EXPECT_EQ(none.exit_code(), 1);
  EXPECT_EQ(none.problem,
            "no session of yours runs on this machine; start one with telesplat run or view, or name a master with "
            "--master ADDRESS");
  EXPECT_EQ(find_master("tcp://leader:1").address, "tcp://leader:1");
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(find_master("").address, session().address);
  EXPECT_EQ(find_master("auto").address, session().address);
  for (const auto& name : {std::to_string(getpid()), std::string("crater.ply"), std::string("first"),
                           std::string("/data/runs/first"), std::string("/data/runs/../runs/first/.")})
    EXPECT_EQ(find_master("", name).address, session().address) << name;
  EXPECT_EQ(find_master("", "nosuch").exit_code(), 2);
  EXPECT_EQ(find_master("", "").problem, "");
}

TEST_F(SessionFiles, TellTheKeysThatASessionRunsWith) {
  RunningSession keyed = session();
  keyed.keys = "/home/anna/keys";
  const auto file = SessionFile::publish(keyed);
  ASSERT_TRUE(file.ok());
  EXPECT_EQ(running_sessions(), std::vector{keyed});
  EXPECT_EQ(find_master("auto").keys, "/home/anna/keys");
  EXPECT_EQ(find_master("", "crater.ply").keys, "/home/anna/keys");
  EXPECT_EQ(find_master(keyed.address).keys, "/home/anna/keys") << "of the session that is there";
  EXPECT_EQ(find_master("tcp://localhost" + keyed.address.substr(keyed.address.rfind(':'))).keys, "/home/anna/keys");
  EXPECT_EQ(find_master("tcp://127.0.0.1:4").keys, "");
  EXPECT_EQ(find_master("tcp://lab.example" + keyed.address.substr(keyed.address.rfind(':'))).keys, "");
}

TEST_F(SessionFiles, GiveTheirKeysToThoseWhoJoinAndNotToMasters) {
  RunningSession keyed = session();
  keyed.keys = "/home/anna/keys";
  const auto file = SessionFile::publish(keyed);
  ASSERT_TRUE(file.ok());
  const auto settled = [&](const std::string& keys, bool connects) {
    ServiceOptions o;
    o.master = keyed.address;
    o.keys = keys;
    EXPECT_EQ(settle_master(o, connects), 0);
    return o.keys;
  };
  EXPECT_EQ(settled("", true), "/home/anna/keys");
  EXPECT_EQ(settled("/home/anna/others", true), "/home/anna/others");
  EXPECT_EQ(settled("none", true), "");
  EXPECT_EQ(settled("", false), "");
  EXPECT_EQ(settled("none", false), "");
}

TEST_F(SessionFiles, OfSeveralSessionsOneMustBeChosen) {
  const auto file = SessionFile::publish(session());
  ASSERT_TRUE(file.ok());
  auto other = content();
  other["address"] = "tcp://127.0.0.1:4712";
  other["scene"] = "lake.ply";
  other["run_folder"] = "";
  put("session-other.json", other.dump());
  const auto search = find_master("auto");
  EXPECT_EQ(search.address, "");
  EXPECT_EQ(search.exit_code(), 2);
  for (const char* told : {"2 sessions of yours", "--master ADDRESS", "--session PID", "\n  tcp://127.0.0.1:4711  pid",
                           "\n  tcp://127.0.0.1:4712  pid", "crater.ply", "lake.ply", "/data/runs/first", "no record"})
    EXPECT_NE(search.problem.find(told), std::string::npos) << told << " in\n" << search.problem;
  EXPECT_EQ(find_master("", "lake.ply").address, "tcp://127.0.0.1:4712");
  EXPECT_EQ(find_master("", std::to_string(getpid())).exit_code(), 2) << "both have this number here";
}

TEST(LocalAddresses, AreThoseThatOneCanConnectTo) {
  EXPECT_EQ(local_address("tcp://127.0.0.1:7700"), "tcp://127.0.0.1:7700");
  EXPECT_EQ(local_address("tcp://0.0.0.0:7700"), "tcp://127.0.0.1:7700");
  EXPECT_EQ(local_address("tcp://[::]:7700"), "tcp://[::1]:7700");
  EXPECT_EQ(local_address("tcp://192.168.1.5:7700"), "tcp://192.168.1.5:7700");
  EXPECT_EQ(local_address("ipc:///run/a"), "ipc:///run/a");
  EXPECT_EQ(local_address("ipc://@a"), "ipc://@a");
  EXPECT_EQ(local_address("ipc://a/b"), "ipc://" + fs::current_path().string() + "/a/b");
}

}  // namespace
}  // namespace telesplat::net
