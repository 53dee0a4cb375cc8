// A session whose services are started one by one leaves the record that telesplat run leaves.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "common/net/control.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class ByHand : public testing::Test {
 protected:
  // As docs/using.md prints it: the master with a folder, everyone else without.
  void begin(const std::vector<std::string>& scene) {
    start("master", {"--bind", "tcp://127.0.0.1:*", "--out", out()});
    master_ = address_of(service("master"));
    start("data", scene);
    start("packer", {});
    start("sampler", {"--name", "sampler-1", "--threads", "1"});
  }
  Program& start(const std::string& name, std::vector<std::string> arguments) {
    const std::string role = name.substr(0, name.find('/'));
    if (role != "master") arguments.insert(arguments.end(), {"--master", master_});
    return *services_
                .emplace(name, std::make_unique<Program>("telesplat-" + role, arguments,
                                                         folder_ / std::to_string(services_.size())))
                .first->second;
  }
  Program& start_viewer(const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> a{"--size", "160x100", "--frames", "20", "--target-fps", "10"};
    a.insert(a.end(), more.begin(), more.end());
    return start("viewer/" + name, a);
  }
  void end() {
    Program stop("telesplat", {"ctl", "stop", "--master", master_}, folder_ / "stop");
    EXPECT_EQ(stop.wait(), 0) << stop.err();
    for (const auto& [name, program] : services_) EXPECT_EQ(program->wait(), 0) << name << ": " << program->err();
  }
  // `telesplat COMMAND` about what the session left.
  void expect_understood(const std::vector<std::string>& arguments) {
    Program program("telesplat", arguments, folder_ / "about");
    EXPECT_EQ(program.wait(120), 0) << arguments.front() << ": " << program.err();
  }
  void expect_other_versions_told();
  Program& service(const std::string& name) { return *services_.at(name); }
  std::string out() const { return folder_ / "runs/by-hand"; }
  nlohmann::json summary() const { return nlohmann::json::parse(read_text(out() + "/summary.json"), nullptr, false); }

  TemporaryFolder folder_;
  std::string master_;
  std::map<std::string, std::unique_ptr<Program>> services_;
};

TEST_F(ByHand, LeavesTheSameRecordAsARun) {
  write_terrain(folder_ / "hill.ply", 40);
  begin({folder_ / "hill.ply", "--cache", folder_ / "cache", "--up", "z"});
  ASSERT_EQ(start_viewer("first", {"--fov", "70"}).wait(), 0) << service("viewer/first").err();
  ASSERT_EQ(start_viewer("second", {"--name", "other one"}).wait(), 0) << service("viewer/second").err();
  end();
  for (const char* file : {"summary.json", "session.toml", "frames.csv", "points.events", "images/frame-000000.png",
                           "viewer-other-one/points.events", "viewer-other-one/images/frame-000000.png"})
    EXPECT_TRUE(fs::exists(out() + "/" + file)) << file;
  EXPECT_FALSE(fs::exists(out() + "/spool"));
  EXPECT_EQ(fs::read_symlink(folder_ / "runs/latest"), "by-hand");
  const auto s = summary();
  EXPECT_EQ(s["data"]["file"], folder_ / "hill.ply");
  EXPECT_TRUE(s["data"]["hash"].is_string()) << s["data"];
  ASSERT_TRUE(s["command"].is_object()) << s["command"];
  EXPECT_NE(s["command"]["sampler-1"].get<std::string>().find("--threads 1"), std::string::npos);
  const std::string session = read_text(out() + "/session.toml");
  EXPECT_NE(session.find("\nup = \"z\""), std::string::npos) << session;
  EXPECT_NE(session.find("\nfov = 70"), std::string::npos)
      << "of the viewer that recorded into the folder: " << session;
  expect_understood({"inspect", out()});
  expect_understood({"compare", folder_ / "runs/latest", "--poses", "1", "--kernels", "disc", "--renderers", "cpu"});
  EXPECT_TRUE(fs::exists(out() + "/compare/contact-sheet.png"));
}

// As an old viewer asks, or one that was written from another page.
void ByHand::expect_other_versions_told() {
  net::Context context;
  net::Socket old(context, net::Kind::kDealer, "old", net::kControlSocket);
  ASSERT_TRUE(old.connect(master_).ok());
  for (const char* type : {"hello", "control"}) {
    old.send_frames({}, type, std::string("\x82\xa4role\xa6viewer\xa1v\x0d"));
    std::optional<net::Message> answer;
    ASSERT_TRUE(wait_until([&] { return (answer = old.receive()).has_value(); })) << type;
    EXPECT_EQ(answer->type, type == std::string("hello") ? "shutdown" : "control_reply");
    const std::string body(reinterpret_cast<const char*>(answer->body.data()), answer->body.size());
    EXPECT_NE(body.find("\xa1v\x0d"), std::string::npos) << "the answer is of the asker's version";
    EXPECT_NE(body.find("it speaks version 13 of the protocol, and this master version " +
                        std::to_string(wire::kProtocolVersion)),
              std::string::npos)
        << body;
  }
  // A service that has not joined hears nothing of the session's end.
  EXPECT_TRUE(wait_until([&] {
    Program status("telesplat", {"ctl", "status", "--json", "--master", master_}, folder_ / "status");
    const auto told = nlohmann::json::parse(status.wait() == 0 ? status.out() : "", nullptr, false);
    return told.is_object() && told["processes"].size() == 3;
  }));
}

TEST_F(ByHand, AJuliaSetLeavesARecordTooAndEveryoneIsToldWhoEndedTheSession) {
  begin({"julia", "--preset", "coral"});
  expect_other_versions_told();
  ASSERT_EQ(start_viewer("first", {}).wait(), 0) << service("viewer/first").err();
  end();
  const std::string who = "the session was ended by " + net::this_person();
  for (const char* name : {"master", "data", "packer", "sampler"})
    EXPECT_NE(service(name).err().find(who), std::string::npos) << name << ": " << service(name).err();
  EXPECT_TRUE(summary()["data"].is_null()) << "no file";
  expect_understood({"inspect", out()});
  expect_understood({"compare", out(), "--poses", "1", "--kernels", "disc", "--renderers", "cpu"});
}

TEST_F(ByHand, WhatIsWaitedForIsSaid) {
  start("master", {"--bind", "tcp://127.0.0.1:*"});
  master_ = address_of(service("master"));
  EXPECT_NE(service("master").err().find("everybody on this machine can watch and end this session"), std::string::npos)
      << service("master").err();
  write_terrain(folder_ / "hill.ply", 20);
  start("data", {folder_ / "hill.ply", "--cache", folder_ / "cache"});
  // A window's viewer and a service say it, each in its own log; who joins with a launcher is told by that.
  const std::string lacks = "the session has no packer and no sampler";
  write_terrain(folder_ / "plate.ply", 4);
  Program joined(
      "telesplat",
      {"run", folder_ / "plate.ply", "--master", master_, "--out", folder_ / "joined", "--give-up-after", "4"},
      folder_ / "joined-run");
  EXPECT_EQ(joined.wait(), 1) << joined.err();
  EXPECT_NE(joined.err().find("plate.ply is not opened: the session shows hill"), std::string::npos) << joined.err();
  EXPECT_NE(joined.err().find(lacks + "; waiting ("), std::string::npos) << joined.err();
  EXPECT_NE(joined.err().find(lacks + "; gives up after 4 s (--give-up-after)"), std::string::npos) << joined.err();
  EXPECT_NE(service("data").err().find(lacks), std::string::npos) << service("data").err();
  Program status("telesplat", {"ctl", "status", "--master", master_}, folder_ / "status");
  ASSERT_EQ(status.wait(), 0);
  EXPECT_NE(status.out().find(lacks), std::string::npos) << status.out();
  end();
}

TEST_F(ByHand, AServiceWithoutAMasterSaysSoAndGivesUp) {
  master_ = "tcp://127.0.0.1:9";
  start("data", {"julia", "--give-up-after", "4"});
  for (const char* role : {"packer", "sampler", "viewer"}) start(role, {"--give-up-after", "4"});
  for (const char* role : {"data", "packer", "sampler", "viewer"}) {
    EXPECT_EQ(service(role).wait(), 1) << role << ": " << service(role).err();
    for (const char* line : {"no master is at tcp://127.0.0.1:9; waiting (3 s so far)",
                             "no master is at tcp://127.0.0.1:9; gives up after 4 s (--give-up-after)"})
      EXPECT_NE(service(role).err().find(line), std::string::npos) << role << ": " << service(role).err();
  }
}

TEST_F(ByHand, AMasterThatIsRefusedLeavesNothing) {
  for (const bool exists : {false, true}) {
    if (exists) fs::create_directories(out());
    Program master("telesplat-master", {"--bind", "tcp://*:*", "--out", out()}, folder_ / "refused");
    EXPECT_EQ(master.wait(), 2) << master.err();
    EXPECT_NE(master.err().find("others need --keys"), std::string::npos) << master.err();
    EXPECT_EQ(fs::exists(out()), exists);
    if (exists) {
      EXPECT_TRUE(fs::is_empty(out()));
    }
  }
}

TEST_F(ByHand, AFolderThatIsNotTheMastersIsLeftAlone) {
  write_terrain(folder_ / "hill.ply", 20);
  begin({folder_ / "hill.ply", "--cache", folder_ / "cache"});
  // As on another machine: a folder of that name is there, but it is another run's.
  std::ofstream(out() + "/run.id") << "telesplat-run 0123\n";
  Program& viewer = start_viewer("first", {});
  ASSERT_EQ(viewer.wait(), 0) << viewer.err();
  EXPECT_NE(viewer.err().find("--out is needed to keep pictures"), std::string::npos) << viewer.err();
  Program& silent = start_viewer("second", {"--no-record"});
  ASSERT_EQ(silent.wait(), 0) << silent.err();
  EXPECT_EQ(silent.err().find("--out is needed"), std::string::npos) << silent.err();
  end();
  EXPECT_FALSE(fs::exists(out() + "/images"));
}

}  // namespace
}  // namespace telesplat::test
