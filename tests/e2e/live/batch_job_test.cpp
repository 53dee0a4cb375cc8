// The session as a batch job (compose/slurm). Slurm itself is not here: a stand-in for srun starts the tasks of all
// nodes on this machine, whose names are all localhost.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/support/pipeline_run.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::test {
namespace {

constexpr const char* kSrun = R"(#!/bin/sh
echo "$@" >> "$(dirname "$0")/srun.calls"
tasks=1
while [ $# -gt 0 ]; do
  case $1 in
    --ntasks=*) tasks=${1#*=} ;;
    -*) ;;
    *) break ;;
  esac
  shift
done
pids=''
trap 'kill -TERM $pids' TERM INT
while [ "$tasks" -gt 0 ]; do
  "$@" &
  pids="$pids $!"
  tasks=$((tasks - 1))
done
wait
wait
)";
constexpr const char* kScontrol = "#!/bin/sh\nfor node in 1 2 3; do echo localhost; done\n";

void write_script(const std::string& path, const std::string& text) {
  std::ofstream(path) << text;
  chmod(path.c_str(), 0755);
}

class BatchJob : public ::testing::Test {
 protected:
  BatchJob() {
    write_terrain(folder_ / "hill.ply", 40);
    write_script(folder_ / "srun", kSrun);
    write_script(folder_ / "scontrol", kScontrol);
  }
  // Its port follows from its number.
  std::unique_ptr<Program> start(int job) {
    return std::make_unique<Program>(
        "/usr/bin/env",
        std::vector<std::string>{
            "PATH=" + folder_.path() + ":" + getenv("PATH"), "SLURM_JOB_ID=" + std::to_string(job),
            "SLURM_JOB_NODELIST=localhost[1-3]", "SLURM_CPUS_ON_NODE=1", "SLURM_SUBMIT_HOST=login",
            "TELESPLAT_TREE=" TELESPLAT_SOURCE, "TELESPLAT_BIN=" TELESPLAT_BIN, "TELESPLAT_OUT=" + (folder_ / "run"),
            "TELESPLAT_KEYS=--insecure", "TELESPLAT_SAMPLER_FLAGS=--threads 1",
            TELESPLAT_SOURCE "/compose/slurm/telesplat.sbatch", folder_ / "hill.ply", "--cache", folder_ / "cache"},
        folder_ / "job");
  }
  static int alive(const nlohmann::json& status, const std::string& role) {
    int n = 0;
    for (const auto& p : status["processes"]) n += p["role"] == role && p["alive"];
    return n;
  }
  bool wait_status(const std::string& master, const std::function<bool(const nlohmann::json&)>& condition) {
    return wait_until(
        [&] {
          launcher::ControlClient client(master);
          const auto answer = client.ask("status", 2);
          const auto status = answer ? nlohmann::json::parse(*answer, nullptr, false) : nlohmann::json();
          return status.is_object() && condition(status);
        },
        60);
  }

  TemporaryFolder folder_;
};

TEST_F(BatchJob, HasSamplersOnOtherNodesAndTellsTheWayIn) {
  const auto job = start(int(getpid()));
  ASSERT_TRUE(wait_until([&] { return job->out().find("telesplat view --master") != std::string::npos; }))
      << job->err();
  std::smatch found;
  const std::string out = job->out();
  ASSERT_TRUE(std::regex_search(out, found, std::regex("ssh -N -L (\\d+):localhost:\\1 -L \\d+:.* \\S+@login"))) << out;
  const std::string master = "tcp://127.0.0.1:" + found[1].str();
  ASSERT_TRUE(wait_status(
      master,
      [](const auto& s) { return alive(s, "sampler") == 2 && alive(s, "packer") == 1 && alive(s, "data") == 1; }))
      << job->out() << job->err();
  EXPECT_NE(read_text(folder_ / "srun.calls").find("--nodes=2 --relative=1 --ntasks=2 "), std::string::npos);

  // As through the tunnel: all that a viewer is told is on this machine.
  Program viewer("telesplat-viewer", {"--master", master, "--frames", "20", "--size", "320x200"}, folder_ / "viewer");
  EXPECT_EQ(viewer.wait(), 0) << viewer.err();

  job->signal(SIGTERM);  // as a minute before the job's time is over
  EXPECT_EQ(job->wait(), 0) << job->err();
  const auto summary = nlohmann::json::parse(read_text(folder_ / "run/summary.json"), nullptr, false);
  ASSERT_TRUE(summary.is_object());
  EXPECT_GT(summary["updates"], 0) << summary;
}

TEST_F(BatchJob, ASamplerThatIsKilledComesBack) {
  const int number = int(getpid()) + 1;
  const auto job = start(number);
  const std::string master = "tcp://127.0.0.1:" + std::to_string(20000 + number % 2500 * 5);
  pid_t victim = 0;
  ASSERT_TRUE(wait_status(master, [&](const auto& s) {
    for (const auto& p : s["processes"])
      if (p["role"] == "sampler") victim = p["pid"];
    return alive(s, "sampler") == 2;
  })) << job->err();
  ASSERT_EQ(kill(victim, SIGKILL), 0);
  EXPECT_TRUE(wait_status(master, [&](const auto& s) {
    for (const auto& p : s["processes"])
      if (p["pid"] == victim && p["alive"]) return false;
    return alive(s, "sampler") == 2;
  })) << job->err();
  EXPECT_NE(job->err().find("was killed by signal 9 and is started again"), std::string::npos) << job->err();
  job->signal(SIGTERM);
  EXPECT_EQ(job->wait(), 0) << job->err();
}

}  // namespace
}  // namespace telesplat::test
