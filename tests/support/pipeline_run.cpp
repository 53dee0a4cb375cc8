#include "tests/support/pipeline_run.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <thread>

#include "common/core/clock.h"
#include "common/net/master_address.h"
#include "tests/support/patience.h"
#include "tools/common/csv_table.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// Processes whose command line holds `text`.
std::vector<pid_t> running_with(const std::string& text) {
  std::vector<pid_t> out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/proc", error)) {
    const pid_t pid = std::atoi(entry.path().filename().c_str());
    if (pid > 0 && pid != getpid() && read_text(entry.path() / "cmdline").find(text) != std::string::npos &&
        is_running(pid))
      out.push_back(pid);
  }
  return out;
}

}  // namespace

bool wait_until(const std::function<bool()>& condition, double deadline_s) {
  for (const double until = monotonic_s() + patient(deadline_s);;) {
    if (condition()) return true;
    if (monotonic_s() > until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));  // between two looks, never instead of one
  }
}

bool is_running(pid_t pid) {
  const std::string stat = read_text(fmt::format("/proc/{}/stat", pid));
  const size_t name_end = stat.rfind(')');
  return name_end != std::string::npos && name_end + 2 < stat.size() && stat[name_end + 2] != 'Z' &&
         stat[name_end + 2] != 'X';
}

Program::Program(const std::string& name, std::vector<std::string> arguments, const std::string& prefix)
    : prefix_(prefix) {
  arguments.insert(arguments.begin(), name.starts_with("/") ? name : std::string(TELESPLAT_BIN) + "/" + name);
  std::vector<char*> argv;
  for (auto& a : arguments) argv.push_back(a.data());
  argv.push_back(nullptr);
  // Emptied first: they may hold output of a former program with this prefix.
  const auto emptied = [&](const char* suffix) {
    return ::open((prefix + suffix).c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644);
  };
  const int out = emptied(".out"), err = emptied(".err");
  pid_ = fork();
  if (pid_ != 0) {
    ::close(out);
    ::close(err);
    return;
  }
  dup2(out, 1);
  dup2(err, 2);
  // Sessions of tests and sessions of this machine's user must not find each other.
  setenv("TELESPLAT_RUNTIME", (prefix + ".runtime").c_str(), 0);
  execv(argv[0], argv.data());
  _exit(127);
}

Program::~Program() {
  if (exit_code_ >= 0) return;
  ::kill(pid_, SIGTERM);
  if (wait(10) >= 0) return;
  ::kill(pid_, SIGKILL);
  wait(10);
}

int Program::wait(double deadline_s) {
  wait_until(
      [&] {
        int status = 0;
        if (exit_code_ < 0 && waitpid(pid_, &status, WNOHANG) == pid_)
          exit_code_ = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
        return exit_code_ >= 0;
      },
      deadline_s);
  return exit_code_;
}

std::string Program::complaint() const {
  const std::string all = err();
  return all.starts_with("session at ") ? all.substr(std::min(all.find('\n'), all.size() - 1) + 1) : all;
}

void Program::signal(int number) {
  if (exit_code_ < 0) ::kill(pid_, number);
}

std::string address_of(const Program& master) {
  std::string out;
  EXPECT_TRUE(wait_until([&] {
    const std::string said = master.out(), words = "listening on ";
    const size_t begin = said.find(words), end = said.find('\n', begin);
    if (begin != said.npos && end != said.npos) out = said.substr(begin + words.size(), end - begin - words.size());
    return !out.empty();
  })) << master.err();
  return out;
}

PipelineRun::PipelineRun(const std::vector<std::string>& arguments, const std::string& mesh, const std::string& command)
    : out_(folder_ / "run") {
  const std::string terrain = mesh.empty() ? folder_ / "terrain.ply" : mesh;
  if (mesh.empty()) write_terrain(terrain);
  std::vector<std::string> a{
      command, terrain, "--out", out_, "--sampling-size", "320x200", "--tile-size", "64", "--sampler-threads", "1"};
  // The screens of a described wall have their own sizes.
  const auto described = [](const std::string& word) { return word.ends_with(".toml"); };
  if (std::none_of(arguments.begin(), arguments.end(), described)) a.insert(a.end(), {"--size", "480x300"});
  const bool surface = std::find(arguments.begin(), arguments.end(), "--iso") != arguments.end();
  if (mesh.empty() || mesh.ends_with(".ply") || surface) a.insert(a.end(), {"--cache", folder_ / "cache"});
  // Half the usual rate tests as much, and leaves time to other tests.
  if (command == "run") a.insert(a.end(), {"--target-fps", "30"});
  // Pictures must show only the scene, without the panel over it.
  if (command == "view" && std::find(arguments.begin(), arguments.end(), "--panel") == arguments.end())
    a.insert(a.end(), {"--panel", "off"});
  a.insert(a.end(), arguments.begin(), arguments.end());
  own_runtime_ = setenv("TELESPLAT_RUNTIME", (folder_ / "runtime").c_str(), 0) == 0 &&
                 std::getenv("TELESPLAT_RUNTIME") == folder_ / "runtime";
  program_ = std::make_unique<Program>("telesplat", a, folder_ / "telesplat");
}

PipelineRun::~PipelineRun() {
  control_.reset();
  program_.reset();
  if (own_runtime_) unsetenv("TELESPLAT_RUNTIME");
  for (const pid_t pid : running_with(folder_.path())) ::kill(pid, SIGKILL);
  if (!master_.empty())
    for (const pid_t pid : running_with(master_)) ::kill(pid, SIGKILL);
}

const std::string& PipelineRun::master() {
  if (master_.empty())
    wait_until([&] {
      const std::string log = read_text(out_ + "/logs/master.log"), words = "listening on ";
      const size_t begin = log.find(words), end = log.find('\n', begin);
      if (begin == std::string::npos || end == std::string::npos) return false;
      master_ = log.substr(begin + words.size(), end - begin - words.size());
      return true;
    });
  return master_;
}

void PipelineRun::use_keys(const std::string& keys, net::Access operators) {
  keys_ = keys;
  access_ = std::move(operators);
}

const net::Access& PipelineRun::access() {
  if (!access_) {
    auto found = net::Access::open({}, net::find_master(master()).keys, net::asking_roles());
    EXPECT_TRUE(found.ok()) << (found ? "" : found.error().text);
    access_ = found ? *std::move(found) : net::Access();
  }
  return *access_;
}

nlohmann::json PipelineRun::status() {
  if (master().empty()) return {};
  if (!control_) control_ = std::make_unique<launcher::ControlClient>(master(), access());
  const auto answer = control_->ask("status", 2);
  return answer ? nlohmann::json::parse(*answer, nullptr, false) : nlohmann::json();
}

bool PipelineRun::wait_status(const std::function<bool(const nlohmann::json&)>& condition, double deadline_s) {
  return wait_until(
      [&] {
        const auto s = status();
        return s.is_object() && condition(s);
      },
      deadline_s);
}

bool PipelineRun::wait_showing() {
  return wait_status(
      [](const auto& s) { return value(s, "viewer-1", "points") > 0 && value(s, "viewer-1", "frames") > 0; });
}

bool PipelineRun::wait_at_rest() {
  constexpr double kFramesMoving = 2 * 30;  // at most: the constructor asks for 30 frames a second
  struct Model {
    double points, updates;
  };
  std::map<std::string, Model> last;  // each viewer's, when its points last changed
  return wait_status([&](const auto& s) {
    int viewers = 0, complete = 0;
    for (const auto& p : s["processes"]) {
      if (p["role"] != "viewer") continue;
      ++viewers;
      const std::string name = p["name"];
      if (value(s, name, "frames") <= kFramesMoving) continue;
      const Model now{value(s, name, "points"), value(s, name, "updates")};
      Model& then = last.emplace(name, now).first->second;
      if (now.points > 1.001 * then.points) then = now;
      complete += now.updates > then.updates + 3;
    }
    return viewers > 0 && complete == viewers;
  });
}

int PipelineRun::stop() {
  std::vector<std::string> arguments{"ctl", "stop", "--master", master()};
  if (!keys_.empty()) arguments.insert(arguments.end(), {"--keys", keys_});
  Program command("telesplat", arguments, folder_ / "stop");
  return command.wait() == 0 ? program_->wait(60) : -1;
}

bool PipelineRun::all_gone(double deadline_s) {
  return wait_until(
      [&] { return running_with(folder_.path()).empty() && (master_.empty() || running_with(master_).empty()); },
      deadline_s);
}

nlohmann::json PipelineRun::summary() const {
  return nlohmann::json::parse(read_text(out_ + "/summary.json"), nullptr, false);
}

std::vector<double> PipelineRun::column(const std::string& file, const std::string& name) const {
  std::vector<double> out;
  std::ifstream in(out_ + "/" + file);
  std::string line, cell;
  std::getline(in, line);
  int wanted = -1, index = 0;
  for (std::istringstream header(line); std::getline(header, cell, ','); ++index)
    if (cell == name) wanted = index;
  while (wanted >= 0 && std::getline(in, line)) {
    index = 0;
    for (std::istringstream row(line); std::getline(row, cell, ','); ++index)
      if (index == wanted) out.push_back(std::strtod(cell.c_str(), nullptr));
  }
  return out;
}

int ctl(PipelineRun& run, std::vector<std::string> arguments, std::string* out, std::string* err) {
  arguments.insert(arguments.begin(), "ctl");
  arguments.insert(arguments.end(), {"--master", run.master()});
  Program program("telesplat", arguments, run.folder() / "ctl");
  const int code = program.wait(30);
  if (out) *out = program.out();
  if (err) *err = program.err();
  return code;
}

nlohmann::json process(const nlohmann::json& status, const std::string& name) {
  if (status.is_object())
    for (const auto& p : status["processes"])
      if (p["name"] == name && p["alive"] == true) return p;
  return {};
}

double value(const nlohmann::json& status, const std::string& name, const std::string& key) {
  const auto p = process(status, name);
  return p.is_object() && p.contains("values") ? p["values"].value(key, 0.0) : 0.0;
}

std::string newest_picture(const PipelineRun& run) {
  std::string out;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(run.out() + "/images", error))
    if (entry.path().filename().string().starts_with("frame-") && entry.path().extension() == ".png")
      out = std::max(out, entry.path().string());
  return out;
}

double psnr_db(const image::View& a, const image::View& b) {
  double sum = 0;
  for (size_t i = 0; i < a.colour.size(); ++i)
    for (const int shift : {0, 8, 16})
      sum += std::pow(double(a.colour[i] >> shift & 255) - double(b.colour[i] >> shift & 255), 2);
  return sum == 0 ? 99 : 10 * std::log10(255.0 * 255 * 3 * double(a.colour.size()) / sum);
}

std::vector<uint64_t> on_screen(const std::string& run, double fps) {
  const auto table = tools::CsvTable::read(run + "/frames.csv", {});
  EXPECT_TRUE(table.ok()) << table.error().text;
  const auto t = table->numbers(*table->column("t_s")), took = table->numbers(*table->column("construction_ms")),
             number = table->numbers(*table->column("frame"));
  const auto shown_s = [&](size_t i) { return t[i] + took[i] / 1e3 - (t[0] + took[0] / 1e3); };
  std::vector<uint64_t> out;
  size_t i = 0;
  for (size_t k = 0; double(k) / fps <= shown_s(t.size() - 1); ++k) {
    while (i + 1 < t.size() && shown_s(i + 1) <= double(k) / fps) ++i;
    out.push_back(uint64_t(number[i]));
  }
  return out;
}

size_t expect_as_displayed(const PipelineRun& run, double fps) {
  const std::string folder = run.folder() / "frames";
  Program movie("telesplat", {"movie", run.out(), folder + "/", "--fps", fmt::format("{}", fps)},
                run.folder() / "movie");
  EXPECT_EQ(movie.wait(100), 0) << movie.err();
  const auto wanted = on_screen(run.out(), fps);
  size_t compared = 0;
  for (size_t k = 0; k < wanted.size(); ++k) {
    const std::string mine = fmt::format("{}/{:06}.png", folder, k);
    const std::string recorded = fmt::format("{}/images/frame-{:06}.png", run.out(), wanted[k]);
    EXPECT_TRUE(fs::exists(mine)) << mine;
    if (!fs::exists(recorded) || !fs::exists(mine)) continue;
    const auto a = image::read_view(mine), b = image::read_view(recorded);
    EXPECT_TRUE(a.ok() && b.ok());
    if (!a || !b) continue;
    EXPECT_EQ(a->width, b->width);
    EXPECT_TRUE(a->colour == b->colour) << "movie frame " << k << " is not displayed frame " << wanted[k];
    ++compared;
  }
  EXPECT_FALSE(fs::exists(fmt::format("{}/{:06}.png", folder, wanted.size()))) << "there is one too many";
  EXPECT_GT(compared, wanted.size() / 2);
  return compared;
}

}  // namespace telesplat::test
