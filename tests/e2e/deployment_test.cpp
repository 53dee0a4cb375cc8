// Services started one by one, as on machines and in containers of their own: they find each other, and end when they
// are told to.
#include <gtest/gtest.h>

#include <unistd.h>

#include <csignal>
#include <filesystem>

#include "common/net/service.h"
#include "tests/support/pipeline_run.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// A master, and what joins it by name of its role.
class Deployment {
 public:
  Deployment() {
    write_terrain(folder_ / "hill.ply");
    start("master", {"--bind", "tcp://127.0.0.1:*", "--out", out()});
    master_ = address_of(service("master"));
  }

  Program& start(const std::string& role, std::vector<std::string> arguments) {
    if (role != "master") arguments.insert(arguments.end(), {"--master", master_});
    return services_.try_emplace(role, "telesplat-" + role, arguments, folder_ / role).first->second;
  }
  void start_servers() {
    start("data", {folder_ / "hill.ply", "--cache", folder_ / "cache", "--bind", "tcp://0.0.0.0:*", "--insecure",
                   "--advertise", "127.0.0.1"});
    start("packer", {"--bind", "tcp://*:*", "--insecure", "--advertise", "127.0.0.1"});
    start("sampler", {"--threads", "1"});
  }
  Program& start_viewer(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--size", "320x200", "--out", out()});
    return start("viewer", arguments);
  }

  Program& service(const std::string& role) { return services_.at(role); }
  nlohmann::json status() {
    launcher::ControlClient client(master_);
    const auto answer = client.ask("status", 2);
    return answer ? nlohmann::json::parse(*answer, nullptr, false) : nlohmann::json();
  }
  bool wait_status(const std::function<bool(const nlohmann::json&)>& condition) {
    return wait_until([&] {
      const auto s = status();
      return s.is_object() && condition(s);
    });
  }
  // The living process of a role, or null.
  static nlohmann::json of_role(const nlohmann::json& status, const std::string& role) {
    for (const auto& p : status["processes"])
      if (p["role"] == role && p["alive"]) return p;
    return nullptr;
  }
  int health(std::vector<std::string> arguments) {
    arguments.insert(arguments.end(), {"--master", master_});
    return Program("telesplat-health", arguments, folder_ / "health").wait();
  }
  const std::string& master() const { return master_; }
  std::string out() const { return folder_ / "run"; }
  const TemporaryFolder& folder() const { return folder_; }

 private:
  TemporaryFolder folder_;
  std::string master_;
  std::map<std::string, Program> services_;
};

TEST(Deployment, AddressesAnnouncedCanBeReachedAndAViewerEndsTheSessionWhenItsRunIsOver) {
  Deployment d;
  d.start_servers();
  ASSERT_TRUE(d.wait_status([](const auto& s) {
    return Deployment::of_role(s, "data").is_object() && Deployment::of_role(s, "packer").is_object();
  }));
  const auto status = d.status();
  for (const auto& [role, key] :
       {std::pair{"data", "chunks"}, {"packer", "tiles"}, {"packer", "patches"}, {"packer", "state"}})
    EXPECT_TRUE(
        Deployment::of_role(status, role)["endpoints"][key].template get<std::string>().starts_with("tcp://127.0.0.1:"))
        << role << " " << key;
  EXPECT_EQ(d.start_viewer({"--frames", "20", "--end-session"}).wait(), 0) << d.service("viewer").err();
  for (const char* role : {"sampler", "packer", "data", "master"})
    EXPECT_EQ(d.service(role).wait(), 0) << role << ": " << d.service(role).err();
  const auto summary = nlohmann::json::parse(read_text(d.out() + "/summary.json"), nullptr, false);
  ASSERT_TRUE(summary.is_object());
  EXPECT_EQ(summary["frames"], 20);
  EXPECT_GT(summary["updates"], 0);
}

TEST(Deployment, ASessionThatEndsBeforeAnythingWasShownFailed) {
  Deployment d;
  Program& viewer = d.start_viewer({"--frames", "20", "--end-session"});
  ASSERT_TRUE(d.wait_status([](const auto& s) { return Deployment::of_role(s, "viewer").is_object(); }));
  d.service("master").signal(SIGTERM);
  EXPECT_EQ(viewer.wait(), 1);
  EXPECT_NE(viewer.err().find("before anything was shown"), std::string::npos) << viewer.err();
  EXPECT_EQ(d.service("master").wait(), 0);
}

// Published ports, and tunnels: viewers reach a packer under another name than samplers do, at ports that are known.
TEST(Deployment, APackersPortsAreKnownBeforeItRuns) {
  Deployment d;
  const auto at = [](const std::string& host, int port) { return "tcp://" + host + ":" + std::to_string(port); };
  nlohmann::json endpoints;
  int port = 20000 + int(getpid() % 20000);
  // Others may have taken a port.
  for (int tries = 0; tries < 20 && !endpoints.is_object(); ++tries, port += 3) {
    Program packer("telesplat-packer",
                   {"--bind", at("*", port), "--insecure", "--advertise", "packer", "--advertise-to-viewers", "lab",
                    "--master", d.master()},
                   d.folder() / "packer");
    d.wait_status(
        [&](const auto& s) { return Deployment::of_role(s, "packer").is_object() || !is_running(packer.pid()); });
    if (const auto p = Deployment::of_role(d.status(), "packer"); p.is_object()) {
      endpoints = p["endpoints"];
      EXPECT_EQ(endpoints,
                (nlohmann::json{
                    {"patches", at("lab", port)}, {"state", at("lab", port + 1)}, {"tiles", at("packer", port + 2)}}));
    }
  }
  EXPECT_TRUE(endpoints.is_object());
  Program refused("telesplat-packer", {"--bind", "tcp://127.0.0.1:65534", "--master", d.master()}, d.folder() / "high");
  EXPECT_EQ(refused.wait(), 2);
  EXPECT_NE(refused.err().find("its 3 ports end at 65535"), std::string::npos) << refused.err();
  // Containers give no address to announce.
  ASSERT_TRUE(d.wait_status([](const auto& s) { return !Deployment::of_role(s, "packer").is_object(); }));
  Program unadvertised("telesplat-packer", {"--bind", "tcp://*:*", "--insecure", "--master", d.master()},
                       d.folder() / "unadvertised");
  ASSERT_TRUE(d.wait_status([](const auto& s) { return Deployment::of_role(s, "packer").is_object(); }));
  const auto announced = Deployment::of_role(d.status(), "packer")["endpoints"];
  for (const char* key : {"tiles", "patches", "state"})
    EXPECT_TRUE(announced[key].get<std::string>().starts_with("tcp://" + net::host_name() + ":")) << announced;
}

TEST(Deployment, HealthFollowsTheProcess) {
  Deployment d;
  EXPECT_EQ(d.health({}), 0);
  EXPECT_EQ(d.health({"--role", "sampler", "--host"}), 1) << "none is there yet";
  d.start("sampler", {"--name", "s", "--threads", "1"});
  ASSERT_TRUE(d.wait_status([](const auto& s) { return Deployment::of_role(s, "sampler").is_object(); }));
  EXPECT_EQ(d.health({"--role", "sampler", "--host"}), 0);
  EXPECT_EQ(d.health({"--name", "s"}), 0);
  EXPECT_EQ(d.health({"--name", "t"}), 1);
  EXPECT_EQ(d.health({"--role", "packer"}), 1);
  EXPECT_EQ(d.health({"--role", "wizard"}), 2) << "bad usage";
  // A process that hangs still has its connection: it is its silence that tells.
  d.service("sampler").signal(SIGSTOP);
  EXPECT_TRUE(wait_until([&] { return d.health({"--name", "s"}) == 1; }));
  d.service("sampler").signal(SIGCONT);
  EXPECT_TRUE(wait_until([&] { return d.health({"--name", "s"}) == 0; }));
  d.service("sampler").signal(SIGTERM);
  EXPECT_EQ(d.service("sampler").wait(), 0);
  EXPECT_EQ(d.health({"--name", "s"}), 1);
  d.service("master").signal(SIGTERM);
  EXPECT_EQ(d.service("master").wait(), 0);
  EXPECT_EQ(d.health({}), 1) << "no master";
  EXPECT_EQ(d.health({"--role", "sampler", "--host", "--master-may-be-away"}), 0) << "it waits for its master";
}

TEST(Deployment, EveryServiceEndsOnASignal) {
  Deployment d;
  d.start_servers();
  d.start_viewer({"--duration", "0"});
  ASSERT_TRUE(d.wait_status([](const auto& s) {
    const auto viewer = Deployment::of_role(s, "viewer");
    return viewer.is_object() && viewer.contains("values") && viewer["values"].value("updates", 0.0) > 0;
  }));
  for (const char* role : {"sampler", "viewer", "packer", "data", "master"}) {
    d.service(role).signal(SIGTERM);
    EXPECT_EQ(d.service(role).wait(), 0) << role << ": " << d.service(role).err();
  }
}

TEST(Deployment, AMasterDoesNotWaitLongForTheDead) {
  Deployment d;
  d.start("sampler", {"--threads", "1"});
  ASSERT_TRUE(d.wait_status([](const auto& s) { return Deployment::of_role(s, "sampler").is_object(); }));
  d.service("sampler").signal(SIGSTOP);
  d.service("master").signal(SIGTERM);
  EXPECT_EQ(d.service("master").wait(), 0);
  EXPECT_TRUE(fs::exists(d.out() + "/summary.json"));
  d.service("sampler").signal(SIGCONT);
}

// The data server gives up the file: the chunk store that the file would have become is not there afterwards.
TEST(Deployment, ADataServerEndsOnASignalWhileItReads) {
  Deployment d;
  write_terrain(d.folder() / "mountains.ply", 1500);
  Program& data = d.start("data", {d.folder() / "mountains.ply", "--cache", d.folder() / "cache", "--report-progress"});
  ASSERT_TRUE(wait_until([&] { return data.out().find("progress reading") != std::string::npos; }));
  data.signal(SIGTERM);
  EXPECT_EQ(data.wait(), 0);
  for (const auto& entry : fs::directory_iterator(d.folder() / "cache")) EXPECT_NE(entry.path().extension(), ".mesh");
}

}  // namespace
}  // namespace telesplat::test
