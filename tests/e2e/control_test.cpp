// Sessions are found on this machine: what masters leave behind while they run, and what `telesplat ctl` makes of it.
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "common/core/clock.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

constexpr double kAtOnce_s = test::patient(3);  // on a busy machine; a master that does not answer is waited for longer

class Sessions : public testing::Test {
 protected:
  Sessions() {
    fs::create_directory(runtime_);
    fs::permissions(runtime_, fs::perms::owner_all);
    setenv("TELESPLAT_RUNTIME", runtime_.c_str(), 1);
    unsetenv("TELESPLAT_MASTER");
  }
  ~Sessions() override {
    unsetenv("TELESPLAT_RUNTIME");
    unsetenv("TELESPLAT_MASTER");
  }

  struct Said {
    int code = -1;
    std::string out, err;
    double took_s = 0;
  };
  Said telesplat(const std::vector<std::string>& arguments, const std::string& program = "telesplat") {
    const double begin_s = monotonic_s();
    Program p(program, arguments, folder_ / ("said-" + std::to_string(++said_)));
    Said out;
    out.code = p.wait();
    out.out = p.out();
    out.err = p.err();
    out.took_s = monotonic_s() - begin_s;
    return out;
  }
  Said ctl(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "ctl");
    return telesplat(arguments);
  }
  // A master started by hand, of a session without a scene. Its address is in its second word.
  std::unique_ptr<Program> master(const std::string& name, std::vector<std::string> arguments = {}) {
    arguments.insert(arguments.begin(), {"--bind", "tcp://127.0.0.1:*"});
    auto out = std::make_unique<Program>("telesplat-master", arguments, folder_ / name);
    EXPECT_TRUE(wait_until([&] { return out->out().find("asks this session") != std::string::npos; })) << out->err();
    return out;
  }
  void expect_status_for_programs(PipelineRun& run);
  size_t files() const { return size_t(std::distance(fs::directory_iterator(runtime_), fs::directory_iterator())); }

  TemporaryFolder folder_;
  std::string runtime_ = folder_ / "runtime";
  int said_ = 0;
};

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

size_t widest_line(const std::string& text) {
  size_t out = 0;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) out = std::max(out, line.size());
  return out;
}

// `telesplat ctl status --json` of a run of the terrain.
void Sessions::expect_status_for_programs(PipelineRun& run) {
  const auto said = ctl({"status", "--json"});
  const auto status = nlohmann::json::parse(said.out, nullptr, false);
  ASSERT_TRUE(status.is_object()) << said.out << said.err;
  EXPECT_EQ(status["session"]["scene"], "terrain.ply");
  EXPECT_EQ(status["session"]["kind"], "mesh");
  EXPECT_EQ(status["session"]["started_by"], "run");
  EXPECT_EQ(status["session"]["address"], run.master());
  EXPECT_TRUE(process(status, "viewer-1")["values"]["frames"].is_number_integer());
  EXPECT_TRUE(process(status, "sampler-1")["values"]["tiles_sampled"].is_number_integer());
  EXPECT_EQ(process(status, "sampler-1")["facts"]["threads"], "1");
  EXPECT_TRUE(run.wait_status([](const auto& s) {
    const auto p = process(s, "viewer-1");
    return p.is_object() && p["rates"].value("frames", 0.0) > 0;
  })) << "rates are known after two reports";
  // One sampler of its own accord: as many threads as there are cores, which it must tell.
  Program sampler("telesplat-sampler", {"--master", run.master(), "--name", "all-cores"}, folder_ / "all-cores");
  EXPECT_TRUE(run.wait_status([](const auto& s) {
    const auto p = process(s, "all-cores");
    return p.is_object() && std::atoi(p["facts"].value("threads", "0").c_str()) > 0;
  }));
  // And no more than it may use.
  Program bound("/usr/bin/taskset",
                {"-c", "0", TELESPLAT_BIN "/telesplat-sampler", "--master", run.master(), "--name", "one-core"},
                folder_ / "one-core");
  EXPECT_TRUE(run.wait_status([](const auto& s) {
    const auto p = process(s, "one-core");
    return p.is_object() && p["facts"].value("threads", "0") == "1" && p["facts"].value("cores", "0") == "1";
  })) << bound.err();
}

TEST_F(Sessions, CtlFindsWhatRunStarted) {
  PipelineRun run({"--duration", "0"});
  ASSERT_TRUE(run.wait_showing());
  EXPECT_TRUE(holds(run.program().err(), "session at " + run.master() + "; telesplat ctl status shows it"))
      << run.program().err();
  EXPECT_EQ(files(), 2u) << "its file, and its keys";

  const auto status = ctl({"status"});
  EXPECT_EQ(status.code, 0) << status.err;
  for (const char* told : {"terrain.ply (mesh), started by telesplat run at ", "views", "viewer-1", "sampler-1", "fps",
                           "M points", "packer", "data server", "most MB", "heard of"})
    EXPECT_TRUE(holds(status.out, told)) << told << " in\n" << status.out;
  EXPECT_TRUE(holds(status.out, fs::weakly_canonical(run.out()))) << status.out;
  EXPECT_LE(widest_line(status.out), 120u) << status.out;
  EXPECT_FALSE(holds(status.out, "{"));

  const auto list = ctl({"list"});
  EXPECT_EQ(list.code, 0) << list.err;
  for (const std::string& told : {run.master(), std::string("terrain.ply"), std::string("mesh"), std::string("run")})
    EXPECT_TRUE(holds(list.out, told)) << told << " in\n" << list.out;
  const auto sessions = nlohmann::json::parse(ctl({"list", "--json"}).out, nullptr, false);
  ASSERT_TRUE(sessions.is_array() && sessions.size() == 1);
  EXPECT_EQ(sessions[0]["address"], run.master());
  EXPECT_EQ(sessions[0]["viewers"], 1);

  EXPECT_EQ(telesplat({"--master", "auto", "--role", "packer"}, "telesplat-health").code, 0);
  Program sampler("telesplat-sampler", {"--master", "auto", "--name", "found-it", "--threads", "1"},
                  folder_ / "sampler");
  EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "found-it", "tiles_sampled") > 0; }));

  expect_status_for_programs(run);
  EXPECT_EQ(ctl({"stop"}).out, "stopping\n");
  EXPECT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_EQ(files(), 0u);
  const auto after = ctl({"status"});
  EXPECT_EQ(after.code, 1);
  EXPECT_LT(after.took_s, kAtOnce_s);
  EXPECT_TRUE(holds(after.err, "no session of yours runs on this machine; start one with telesplat run or view"))
      << after.err;
  EXPECT_EQ(ctl({"list"}).out, "no session of yours runs on this machine\n");
  EXPECT_EQ(telesplat({"run", "--master", "auto", "--out", folder_ / "none"}).code, 1);
}

TEST_F(Sessions, OfSeveralOneIsChosen) {
  const auto first = master("first"), second = master("second");
  const auto refused = ctl({"status"});
  EXPECT_EQ(refused.code, 2);
  for (const std::string& told :
       {std::string("2 sessions of yours run on this machine"), std::string("--master ADDRESS"),
        std::string("--session PID"), address_of(*first), address_of(*second)})
    EXPECT_TRUE(holds(refused.err, told)) << told << " in\n" << refused.err;
  EXPECT_EQ(ctl({"stop"}).code, 2) << "which one?";
  EXPECT_EQ(telesplat({"run", "--master", "auto", "--out", folder_ / "none"}).code, 2);

  const auto by_number = ctl({"status", "--session", std::to_string(second->pid())});
  EXPECT_EQ(by_number.code, 0) << by_number.err;
  EXPECT_TRUE(holds(by_number.out, address_of(*second))) << by_number.out;
  EXPECT_EQ(ctl({"status", "--session", "nosuch"}).code, 2);
  EXPECT_EQ(ctl({"status", "--session", std::to_string(second->pid()), "--master", address_of(*first)}).code, 2);

  setenv("TELESPLAT_MASTER", address_of(*first).c_str(), 1);
  EXPECT_TRUE(holds(ctl({"status"}).out, address_of(*first)));
  EXPECT_TRUE(holds(ctl({"status", "--session", std::to_string(second->pid())}).out, address_of(*second)));
  EXPECT_TRUE(holds(ctl({"status", "--master", address_of(*second)}).out, address_of(*second)));
  EXPECT_TRUE(holds(ctl({"--master", address_of(*second), "status"}).out, address_of(*second))) << "in front, too";
  setenv("TELESPLAT_MASTER", "auto", 1);
  EXPECT_EQ(ctl({"status"}).code, 2);
  unsetenv("TELESPLAT_MASTER");

  EXPECT_EQ(ctl({"stop", "--session", std::to_string(first->pid())}).code, 0);
  EXPECT_EQ(first->wait(), 0);
  EXPECT_TRUE(holds(ctl({"status"}).out, address_of(*second)));
}

TEST_F(Sessions, TheKilledAreForgotten) {
  const auto killed = master("killed"), living = master("living");
  EXPECT_EQ(files(), 2u);
  killed->signal(SIGKILL);
  killed->wait();
  EXPECT_EQ(files(), 2u) << "nobody tidied up";
  const auto status = ctl({"status"});
  EXPECT_EQ(status.code, 0) << status.err;
  EXPECT_TRUE(holds(status.out, address_of(*living)));
  EXPECT_EQ(files(), 1u);
  // A master that is asked for all the same is known to be dead at once.
  const auto dead = ctl({"status", "--master", address_of(*killed)});
  EXPECT_EQ(dead.code, 1);
  EXPECT_LT(dead.took_s, kAtOnce_s);
  EXPECT_TRUE(holds(dead.err, "no master is at " + address_of(*killed))) << dead.err;
}

TEST_F(Sessions, SignalsEndThemAndTheirFiles) {
  for (const int signal : {SIGTERM, SIGINT}) {
    const auto by_hand = master("master-" + std::to_string(signal), {"--out", folder_ / "record"});
    EXPECT_EQ(files(), 1u);
    const std::string said = by_hand->out() + by_hand->err(), words = "listening on ";
    EXPECT_EQ(said.find(words), said.rfind(words)) << said;
    EXPECT_TRUE(
        holds(said, "telesplat ctl status asks this session; others join it with --master " + address_of(*by_hand)))
        << said;
    const auto sessions = nlohmann::json::parse(ctl({"list", "--json"}).out, nullptr, false);
    ASSERT_TRUE(sessions.is_array() && sessions.size() == 1);
    EXPECT_EQ(sessions[0]["started_by"], "hand");
    EXPECT_EQ(sessions[0]["scene"], "");
    EXPECT_EQ(sessions[0]["run_folder"], fs::weakly_canonical(folder_ / "record").string());
    by_hand->signal(signal);
    EXPECT_EQ(by_hand->wait(), 0);
    EXPECT_EQ(files(), 0u);
    fs::remove_all(folder_ / "record");
  }
}

TEST_F(Sessions, WithoutAFolderForFilesTheSessionRunsAllTheSame) {
  setenv("TELESPLAT_RUNTIME", "/nonexistent/telesplat", 1);
  const auto hidden = master("hidden");
  EXPECT_TRUE(holds(hidden->err(), "telesplat ctl will not find this session: /nonexistent/telesplat"))
      << hidden->err();
  EXPECT_TRUE(holds(hidden->out(), "telesplat ctl status --master " + address_of(*hidden) + " asks this session"))
      << hidden->out();
  EXPECT_EQ(ctl({"status"}).code, 1);
  EXPECT_EQ(ctl({"status", "--master", address_of(*hidden)}).code, 0);
  EXPECT_EQ(ctl({"stop", "--master", address_of(*hidden)}).code, 0);
  EXPECT_EQ(hidden->wait(), 0);
  const auto run = telesplat({"run", "julia", "--out", folder_ / "none"});
  EXPECT_EQ(run.code, 2);
  EXPECT_TRUE(holds(run.err, "telesplat: --keys auto: /nonexistent/telesplat: cannot be made")) << run.err;
  EXPECT_TRUE(holds(run.err, "--keys none runs without keys\n")) << run.err;
}

// A folder that others may write into is refused: the line of a run says how the session is asked all the same.
TEST_F(Sessions, ARunThatIsNotFoundSaysHowItIsAskedAndTheEnvironmentMayNameIt) {
  fs::permissions(runtime_, fs::perms(0777));
  PipelineRun run({"--duration", "0", "--keys", "none"});
  ASSERT_TRUE(run.wait_showing());
  for (const std::string& told :
       {"session at " + run.master() + "; telesplat ctl status --master " + run.master() + " shows it",
        std::string("telesplat: --keys none: everybody on this machine can watch and end this session\n")})
    EXPECT_TRUE(holds(run.program().err(), told)) << run.program().err();
  EXPECT_EQ(ctl({"status"}).code, 1) << "not to be found";
  EXPECT_EQ(ctl({"status", "--master", run.master()}).code, 0);
  setenv("TELESPLAT_MASTER", run.master().c_str(), 1);
  EXPECT_EQ(ctl({"status"}).code, 0);
  const auto joined = telesplat({"run", "--size", "160x100", "--frames", "20", "--out", folder_ / "joined"});
  EXPECT_EQ(joined.code, 0) << joined.err;
  for (const std::string& told : {std::string("frames"), std::string("fps"), folder_ / "joined"})
    EXPECT_TRUE(holds(joined.out, told)) << told << " in\n" << joined.out;
  EXPECT_TRUE(fs::is_directory(folder_ / "joined/images"));
  EXPECT_TRUE(process(run.status(), "viewer-1").is_object()) << "the session goes on";
}

TEST_F(Sessions, WordsThatAreNoOrderAreBadUsage) {
  EXPECT_EQ(ctl({}).code, 2);
  EXPECT_EQ(ctl({"nosuch"}).code, 2);
  EXPECT_EQ(ctl({"status", "more"}).code, 2);
  const auto by_hand = master("master");
  EXPECT_EQ(ctl({"set"}).code, 2);
  EXPECT_EQ(ctl({"set", "nothing"}).code, 2);
  EXPECT_EQ(ctl({"animate"}).code, 2);
  EXPECT_EQ(ctl({"tf"}).code, 2);
  EXPECT_EQ(ctl({"epoch"}).out, "epoch 2\n");
  for (const char* order : {"status", "list", "stop", "epoch", "set", "animate", "tf"})
    EXPECT_EQ(ctl({order, "--help"}).code, 0) << order;
}

}  // namespace
}  // namespace telesplat::test
