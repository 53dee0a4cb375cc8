// A session whose services are started one by one leaves the record that telesplat run leaves.
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

class ByHand : public testing::Test {
 protected:
  // As README prints it: the master with a folder, everyone else without.
  void begin(const std::vector<std::string>& scene) {
    start("master", {"--bind", "tcp://127.0.0.1:*", "--out", out()});
    ASSERT_TRUE(wait_until([&] { return service("master").out().find("listening on ") != std::string::npos; }));
    const std::string said = service("master").out();
    const size_t at = said.find("tcp://");
    master_ = said.substr(at, said.find('\n', at) - at);
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

TEST_F(ByHand, SoDoesAJuliaSet) {
  begin({"julia", "--preset", "coral"});
  ASSERT_EQ(start_viewer("first", {}).wait(), 0) << service("viewer/first").err();
  end();
  EXPECT_TRUE(summary()["data"].is_null()) << "no file";
  expect_understood({"inspect", out()});
  expect_understood({"compare", out(), "--poses", "1", "--kernels", "disc", "--renderers", "cpu"});
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
