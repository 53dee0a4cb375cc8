#include "tools/lab/simulation/command.h"

#include <fmt/format.h>
#include <hwy/targets.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/version.h"
#include "tools/common/progress_line.h"
#include "tools/lab/simulation/chart.h"
#include "tools/lab/simulation/figures/figures.h"
#include "tools/lab/simulation/run.h"

namespace telesplat::simulation {
namespace {

struct SimulateOptions {
  uint64_t seed = 1, seeds = 1;
  double hours = 0;
  int threads = 1;
  bool trace = false, shrink = false, first = false, figures = false, digests = false;
  std::string walk;
  double from_s = 0, until_s = 1e9;
  std::string log_level = "off", simd = "best";
};

options::Table table(SimulateOptions& o) {
  using options::Range;
  return {{.flag = "--seed", .value = &o.seed, .help = "which session; the same seed, the same messages to the byte"},
          {.flag = "--seeds",
           .value = &o.seeds,
           .help = "number of sessions, from --seed on, on all processors; failures are printed",
           .limits = Range{1, 10'000'000}},
          {.flag = "--first", .value = &o.first, .help = "of --seeds: end with the first one that fails"},
          {.flag = "--digests", .value = &o.digests, .help = "of --seeds: print each session's digest"},
          {.flag = "--hours",
           .value = &o.hours,
           .help = "length of a session with one viewer and two samplers, hours; 0: a session of 11 to 16 s",
           .limits = Range{0, 100}},
          {.flag = "--threads",
           .value = &o.threads,
           .help = "of the computations in one session; the messages do not depend on it",
           .limits = Range{1, 64}},
          {.flag = "--simd",
           .value = &o.simd,
           .help = "which instruction set computes; the messages do not depend on it",
           .limits = options::Names{"best", "avx512", "avx2", "sse4"}},
          {.flag = "--trace", .value = &o.trace, .help = "print the session as a sequence chart"},
          {.flag = "--from", .value = &o.from_s, .help = "seconds: where --trace begins", .limits = Range{0, 1e9}},
          {.flag = "--until", .value = &o.until_s, .help = "seconds: where --trace ends", .limits = Range{0, 1e9}},
          {.flag = "--shrink", .value = &o.shrink, .help = "take events away as long as the session fails"},
          {.flag = "--figures", .value = &o.figures, .help = "print the golden figures of the standard walks, as JSON"},
          {.flag = "--walk", .value = &o.walk, .help = "this standard walk alone, with --figures or as the session"},
          {.flag = "--log-level",
           .value = &o.log_level,
           .help = "of the processes: trace, debug, info, warn, error or off"}};
}

void choose_instructions(const std::string& simd) {
  const int64_t best = simd == "avx512" ? HWY_AVX3 : simd == "avx2" ? HWY_AVX2 : HWY_SSE4;
  if (simd != "best") hwy::DisableTargets(best - 1);
}

Scenario scenario_of(const SimulateOptions& o, uint64_t seed) {
  for (Walk& walk : standard_walks())
    if (walk.name == o.walk) return std::move(walk.scenario);
  return o.hours > 0 ? draw_long(seed, o.hours) : draw_scenario(seed);
}

std::string text_of(const Scenario& s, const Outcome& o) {
  std::string out = o.failure ? fmt::format("seed {} FAILS at {:.4f} s: {}: {}", s.seed, o.failure->at_s,
                                            o.failure->check, o.failure->text)
                              : fmt::format("seed {} holds", s.seed);
  return out + fmt::format(
                   " ({} messages, digest {:016x}, {} frames, {} updates, {} turns, {} rays, {} bytes, {} points, "
                   "{:.2f} % holes, {:.1f} dB)",
                   o.messages, o.digest, o.frames, o.updates, o.turns, o.rays, o.bytes, o.points, o.holes * 100,
                   o.psnr_db);
}

Scenario shrunk(const SimulateOptions& o) {
  tools::ProgressLine progress(2);
  return shrink(scenario_of(o, o.seed),
                [&](const Scenario& s) { progress.show(fmt::format("fails with {} events", s.events.size())); });
}

int simulate_one(const SimulateOptions& o) {
  const Scenario scenario = o.shrink ? shrunk(o) : scenario_of(o, o.seed);
  std::fputs(text_of(scenario).c_str(), stdout);
  std::fflush(stdout);
  log::initialise("simulation", o.log_level);
  const double begin_s = monotonic_s();
  Chart chart(o.from_s, o.until_s, false);
  const Outcome outcome = run_scenario(scenario, o.trace ? std::vector<Observer*>{&chart} : std::vector<Observer*>{});
  if (o.trace) std::fputs(chart.text().c_str(), stdout);
  std::printf("%s\nin %.2f s, version %s\n", text_of(scenario, outcome).c_str(), monotonic_s() - begin_s,
              version().c_str());
  return outcome.failure ? 1 : 0;
}

int simulate_many(const SimulateOptions& o) {
  std::vector<Scenario> scenarios;
  for (uint64_t n = 0; n < o.seeds; ++n) scenarios.push_back(scenario_of(o, o.seed + n));
  tools::ProgressLine progress(2);
  const double begin_s = monotonic_s();
  size_t done = 0, failed = 0;
  run_children(scenarios, usable_processors(), [&](const Scenario& s, const Ran& ran) {
    ++done;
    if (ran.outcome.failure) {
      ++failed;
      progress.close();
      std::printf("%s\n", text_of(s, ran.outcome).c_str());
      std::fflush(stdout);
    } else if (o.digests) {
      std::printf("%s\n", fmt::format("seed-{}: digest {:016x}", s.seed, ran.outcome.digest).c_str());
    }
    progress.show(fmt::format("{} of {} sessions, {} failed", done, scenarios.size(), failed));
    return !(o.first && failed > 0);
  });
  progress.close();
  std::printf("%zu of %zu sessions hold, in %.1f s, version %s\n", done - failed, done, monotonic_s() - begin_s,
              version().c_str());
  return failed ? 1 : 0;
}

// Digests go to stderr. Exit code 1: a walk failed or was left out.
int print_figures(const SimulateOptions& o) {
  log::initialise("simulation", o.log_level);
  std::map<std::string, WalkFigures> all;
  bool left_out = false;
  for (const Walk& walk : standard_walks()) {
    if (!o.walk.empty() && walk.name != o.walk) continue;
    if (!has_data(walk)) {
      std::fprintf(stderr, "%s is left out: %s is not there\n", walk.name.c_str(), walk.scenario.file.c_str());
      left_out = true;
      continue;
    }
    const double begin_s = monotonic_s();
    const auto result = run_walk(walk);
    const std::string why = !result                   ? result.error().text
                            : result->outcome.failure ? text_of(walk.scenario, result->outcome)
                                                      : "";
    if (!why.empty()) return std::fprintf(stderr, "%s: %s\n", walk.name.c_str(), why.c_str()), 1;
    const std::string digest = fmt::format("{}: digest {:016x}", walk.name, result->outcome.digest);
    std::fprintf(stderr, "%s, in %.1f s\n", digest.c_str(), monotonic_s() - begin_s);
    all[walk.name] = result->figures;
  }
  std::fputs(json_of(all).c_str(), stdout);
  return left_out ? 1 : 0;
}

int simulate(SimulateOptions o, const options::Given&) {
  choose_plain_functions();
  choose_instructions(o.simd);
  const tbb::global_control threads(tbb::global_control::max_allowed_parallelism, size_t(o.threads));
  if (o.figures) return print_figures(o);
  return o.seeds > 1 ? simulate_many(o) : simulate_one(o);
}

}  // namespace

void choose_plain_functions() {
  constexpr const char* kVariable = "GLIBC_TUNABLES";
  constexpr const char* kPlain = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F";
  const char* now = std::getenv(kVariable);
  if (now && std::string(now) == kPlain) return;
  setenv(kVariable, kPlain, 1);
  std::string line;
  std::vector<std::string> words;
  if (std::FILE* file = std::fopen("/proc/self/cmdline", "rb")) {
    for (int c = 0; (c = std::fgetc(file)) != EOF;)
      if (c == 0)
        words.push_back(std::exchange(line, {}));
      else
        line += char(c);
    std::fclose(file);
  }
  std::vector<char*> arguments;
  for (std::string& w : words) arguments.push_back(w.data());
  arguments.push_back(nullptr);
  if (!words.empty()) execv("/proc/self/exe", arguments.data());
}

launcher::Command simulate_command() {
  return launcher::make_command("simulate", "play whole sessions in one process, with faults drawn by a seed", table,
                                simulate);
}

}  // namespace telesplat::simulation
