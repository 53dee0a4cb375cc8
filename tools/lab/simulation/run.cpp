#include "tools/lab/simulation/run.h"

#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>

#include "common/core/log.h"

namespace telesplat::simulation {
namespace {

// A child's report on its pipe: in one piece, and short.
struct Report {
  Figures figures;
  double at_s;
  bool failed;
  char check[32], text[512];
};

// The master's messages name the folder of its record: its name must be the same on every machine.
constexpr const char* kFolder = "/proc/self/cwd/run";

void put(char* to, size_t size, const std::string& text) {
  std::strncpy(to, text.c_str(), size - 1);
  to[size - 1] = 0;
}

}  // namespace

Outcome run_scenario(const Scenario& scenario, const std::vector<Observer*>& others) {
  std::error_code error;
  const auto before = std::filesystem::current_path(error);
  char made[] = "/tmp/telesplat-simulation-XXXXXX";
  std::string folder;
  std::signal(SIGXFSZ, SIG_IGN);  // as services do, which meet a full disk as an error
  if (scenario.records && mkdtemp(made) && chdir(made) == 0) folder = kFolder;
  Checks checks(scenario);
  std::vector<Observer*> observers{&checks};
  observers.insert(observers.end(), others.begin(), others.end());
  {
    Session session(scenario, observers, folder);
    checks.on_failure = [&] { session.stop(); };
    session.run_until(scenario.duration_s);
    checks.at_rest(session);
    if (!checks.outcome().failure) session.end();
    checks.at_end(folder, session.now_s());
  }
  std::filesystem::current_path(before, error);
  if (!folder.empty()) std::filesystem::remove_all(made, error);
  return checks.outcome();
}

namespace {

struct Child {
  size_t scenario = 0;
  int pipe = -1;
  pid_t pid = -1;
};

// A session that never ends is killed, and counts as crashed. 16 s of a session take 1 s.
void limit_work(double duration_s) {
  rlimit limit{};
  getrlimit(RLIMIT_CPU, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, rlim_t(60 + duration_s));
  setrlimit(RLIMIT_CPU, &limit);
}

Child begin_child(const Scenario& scenario, size_t number) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const pid_t pid = fork();
  if (pid == 0) {
    close(ends[0]);
    limit_work(scenario.duration_s);
    log::initialise("simulation", "off");
    const Outcome outcome = run_scenario(scenario);
    Report report{};
    report.failed = outcome.failure.has_value();
    if (outcome.failure) {
      report.at_s = outcome.failure->at_s;
      put(report.check, sizeof report.check, outcome.failure->check);
      put(report.text, sizeof report.text, outcome.failure->text);
    }
    report.figures = outcome;
    [[maybe_unused]] const ssize_t n = ::write(ends[1], &report, sizeof report);
    _exit(0);
  }
  close(ends[1]);
  return {number, ends[0], pid};
}

Ran finish_child(const Child& child) {
  Report report{};
  const bool whole = ::read(child.pipe, &report, sizeof report) == ssize_t(sizeof report);
  close(child.pipe);
  int status = 0;
  waitpid(child.pid, &status, 0);
  Ran out;
  if (!whole) {
    out.crashed = true;
    out.outcome.failure = Failure{"crash", WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : "it ended", 0};
    return out;
  }
  static_cast<Figures&>(out.outcome) = report.figures;
  if (report.failed) out.outcome.failure = Failure{report.check, report.text, report.at_s};
  return out;
}

}  // namespace

void run_children(const std::vector<Scenario>& scenarios, int at_once,
                  const std::function<bool(const Scenario&, const Ran&)>& done) {
  std::vector<Child> running;
  size_t next = 0;
  bool goes_on = true;
  while (!running.empty() || (goes_on && next < scenarios.size())) {
    while (goes_on && next < scenarios.size() && int(running.size()) < at_once)
      running.push_back(begin_child(scenarios[next], next)), ++next;
    std::vector<pollfd> items;
    for (const Child& c : running) items.push_back({c.pipe, POLLIN, 0});
    if (poll(items.data(), items.size(), -1) < 0) continue;
    for (size_t i = running.size(); i-- > 0;) {
      if (!items[i].revents) continue;
      const Ran ran = finish_child(running[i]);
      goes_on = done(scenarios[running[i].scenario], ran) && goes_on;
      running.erase(running.begin() + long(i));
    }
  }
}

// Halves, quarters, and so on down to single events, as delta debugging does (Zeller, Hildebrandt 2002).
Scenario shrink(const Scenario& scenario, const std::function<void(const Scenario&)>& on_smaller) {
  const auto fails = [](const Scenario& s) {
    std::string check;
    run_children({s}, 1, [&](const Scenario&, const Ran& ran) {
      if (ran.outcome.failure) check = ran.outcome.failure->check;
      return true;
    });
    return check;
  };
  Scenario best = scenario;
  const std::string check = fails(best);
  for (size_t size = std::max<size_t>(1, best.events.size() / 2); !check.empty(); size /= 2) {
    for (size_t at = 0; at < best.events.size();) {
      Scenario tried = best;
      const auto begin = tried.events.begin() + long(at);
      tried.events.erase(begin, begin + long(std::min(size, tried.events.size() - at)));
      if (fails(tried) == check)
        best = std::move(tried), on_smaller(best);
      else
        at += size;
    }
    if (size <= 1) break;
  }
  return best;
}

}  // namespace telesplat::simulation
