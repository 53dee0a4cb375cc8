// `telesplat bench thesis`: the thesis's tables 7.1 to 7.4 and figures 6.1 to 6.3 by one command, each beside its own
// numbers. Every step is a command of its own (telesplat run, bench scaling, bench volume) in a folder of its own.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/utf8.h"
#include "common/core/version.h"
#include "common/core/whole_file.h"
#include "common/net/service.h"
#include "tools/common/complain.h"
#include "tools/common/json_file.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/bench/bench_commands.h"
#include "tools/telesplat/bench/thesis/direct.h"
#include "tools/telesplat/bench/thesis/report.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/run/process_group.h"
#include "tools/telesplat/sweep/manifest.h"
#include "tools/telesplat/sweep/one_run.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

constexpr const char* kStateFile = "thesis.json";
constexpr int kDirectFrames = 8, kQuickDirectFrames = 3;

struct ThesisOptions {
  std::string out = "thesis", data = default_data_folder(), parts = "6,7.1,7.2,7.3,7.4";
  bool quick = false, dry_run = false;
};

/// Which steps are done, of what, and how busy others kept the machine meanwhile: DIR/thesis.json.
struct Progress {
  bool quick = false;
  std::string data;  // folder of data sets, valid UTF-8; empty: no step needed one so far
  std::map<std::string, std::pair<double, double>> done;  // step -> seconds, share of the cores that others used
};

Result<std::optional<Progress>> read_progress(const std::string& directory) try {
  const std::string path = directory + "/" + kStateFile;
  std::error_code error;
  if (!fs::exists(path, error)) return std::optional<Progress>();
  const auto json = tools::read_json_file(path);
  Progress out;
  out.quick = json.at("quick").get<bool>();
  out.data = json.value("data", std::string());
  for (const auto& [title, step] : json.at("done").items())
    out.done[title] = {step.at("wall_s").get<double>(), step.at("others_cpu").get<double>()};
  return std::optional(std::move(out));
} catch (const nlohmann::json::exception&) {
  return Error{fmt::format("{}/{}: is no record of bench thesis", directory, kStateFile)};
}

Status write_progress(const Progress& progress, const std::string& directory) {
  auto done = nlohmann::ordered_json::object();
  for (const auto& [title, step] : progress.done) done[title] = {{"wall_s", step.first}, {"others_cpu", step.second}};
  return write_whole(directory + "/" + kStateFile,
                     nlohmann::ordered_json{{"quick", progress.quick}, {"data", progress.data}, {"done", done}}.dump(
                         2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) +
                         "\n");
}

class Thesis {
 public:
  Thesis(std::vector<Step> steps, Progress state, std::string directory)
      : steps_(std::move(steps)), state_(std::move(state)), directory_(std::move(directory)) {}

  /// Error: a step failed, or Ctrl-C came.
  Status run() {
    for (size_t i = 0; i < steps_.size(); ++i) {
      const Step& step = steps_[i];
      if (state_.done.contains(step.title)) continue;
      what_ = fmt::format("step {} of {}: {}", i + 1, steps_.size(), step.title);
      later_s_ = 0;
      for (size_t k = i + 1; k < steps_.size(); ++k)
        if (!state_.done.contains(steps_[k].title)) later_s_ += steps_[k].expected_s;
      const auto end = carry_out_step(step);
      if (!end) return end.error();
      state_.done[step.title] = {end->wall_s, end->load.others_cpu};
      if (const Status s = write_progress(state_, directory_); !s) return s;
      if (end->interrupted) return stop();
    }
    progress_.close();
    return ok_status();
  }
  const Progress& state() const { return state_; }
  bool interrupted() const { return interrupted_; }

 private:
  Error stop() {
    interrupted_ = true;
    return Error{"interrupted"};
  }

  Result<RunEnd> carry_out_step(const Step& step) {
    // What lies there is of a step that did not end, and ours.
    const std::string folder = directory_ + "/" + step.folder;
    std::error_code error;
    fs::remove_all(folder, error);
    fs::create_directories(step.direct.empty() ? fs::path(folder).parent_path() : fs::path(folder), error);
    if (error) return Error{fmt::format("{}: cannot be made: {}", folder, error.message())};
    if (!step.direct.empty()) return direct(step, folder);
    auto words = step.arguments;
    words.insert(words.end(), {"--out", folder});
    const auto end = carry_out({program_directory() + "/telesplat", words, folder + ".log", 0}, [&](double elapsed_s) {
      progress_.show(fmt::format("{}: {:.0f} s, {} left", what_, elapsed_s,
                                 tools::duration_text(std::max(0.0, step.expected_s - elapsed_s) + later_s_)));
    });
    if (!end.reason.empty() && end.interrupted) return stop();
    if (!end.reason.empty()) return Error{fmt::format("{}: {}", step.title, end.reason)};
    return end;
  }

  Result<RunEnd> direct(const Step& step, const std::string& folder) {
    const LoadMeter meter;
    const double begin_s = monotonic_s();
    const Status s = measure_direct(step.direct, kThesisWidth, kThesisHeight,
                                    state_.quick ? kQuickDirectFrames : kDirectFrames, folder, progress_);
    if (net::stop_requested()) return stop();
    if (!s) return Error{fmt::format("{}: {}", step.title, s.error().text)};
    return RunEnd{0, {}, false, monotonic_s() - begin_s, meter.measured()};
  }

  std::vector<Step> steps_;
  Progress state_;
  std::string directory_, what_;
  double later_s_ = 0;
  bool interrupted_ = false;
  tools::ProgressLine progress_;
};

Status check_data(const std::vector<Step>& steps) {
  std::error_code error;
  for (const Step& step : steps)
    for (size_t i = 0; i < step.arguments.size() || i == 0; ++i) {
      const std::string& word = step.arguments.empty() ? step.direct : step.arguments[i];
      if (word.starts_with("/") && !fs::exists(word, error))
        return Error{fmt::format("{} ({}): is not there; --data names the folder of data sets, --only what needs none",
                                 word, step.title)};
    }
  return ok_status();
}

std::vector<std::string> about(const Progress& state, const std::string& directory) {
  const Machine machine = this_machine();
  std::vector<std::string> out{
      fmt::format("Measured by `telesplat bench thesis{}` on {} with {} cores; telesplat {}; record: {}.",
                  state.quick ? " --quick" : "", machine.processor, machine.cores, version(), directory)};
  double most = 0;
  for (const auto& [title, step] : state.done) most = std::max(most, step.second);
  out.push_back(fmt::format("Others used up to {:.0f} % of the machine's cores during a step.", 100 * most));
  if (state.quick) out.emplace_back("This is the short form: short runs, a smaller tree, fewer nodes.");
  return out;
}

Status report(const Progress& state, const std::vector<std::string>& parts, const std::string& directory) {
  ThesisReport found = read_results(directory, parts, state.quick, this_machine().cores);
  found.about = about(state, directory);
  for (const ThesisFigure& figure : found.figures)
    if (!figure.svg.empty())
      if (const Status s = write_whole(directory + "/" + figure.file, figure.svg); !s) return s;
  for (const auto& [file, text] : {std::pair{"/thesis.md", to_markdown(found)}, {"/thesis.html", to_html(found)}})
    if (const Status s = write_whole(directory + file, text); !s) return s;
  std::printf("%s\nreport: %s/thesis.html, %s/thesis.md\n", to_text(found).c_str(), directory.c_str(),
              directory.c_str());
  return ok_status();
}

// Without a slash at its end.
std::string whole_path(const std::string& path) {
  std::error_code error;
  const fs::path out = fs::absolute(path, error).lexically_normal();
  return (out.filename().empty() ? out.parent_path() : out).string();
}

// data: that the steps need; empty: they need none.
Result<Progress> begin(const ThesisOptions& o, const std::string& data, const std::string& directory) {
  auto before = read_progress(directory);
  if (!before) return before.error();
  std::error_code error;
  if (!*before && fs::exists(directory, error) && !fs::is_empty(directory, error))
    return Error{fmt::format("--out {}: is not empty, and holds no record of bench thesis", o.out)};
  Progress out = before->value_or(Progress{o.quick, data, {}});
  const auto refuse = [&](const std::string& difference) {
    return holds_another("--out " + o.out, "record of bench thesis", difference);
  };
  if (out.quick != o.quick)
    return refuse(
        fmt::format("it was begun {} --quick, not {}", out.quick ? "with" : "without", o.quick ? "with" : "without"));
  if (!out.data.empty() && !data.empty() && out.data != data)
    return refuse(fmt::format("it was begun with --data {}, not {}", out.data, data));
  if (out.data.empty()) out.data = data;
  return out;
}

int thesis(ThesisOptions o, const options::Given&) {
  log::initialise("bench", "warn");
  std::error_code error;
  const std::string directory = whole_path(o.out);
  const auto parts = parse_parts(o.parts);
  if (!parts) return tools::complain({"--only: " + parts.error().text});
  const std::string data = whole_path(o.data);
  auto todo = steps({data, o.quick, *parts});
  const bool needs_data = std::any_of(todo.begin(), todo.end(), [&](const Step& step) {
    return !step.direct.empty() || std::any_of(step.arguments.begin(), step.arguments.end(),
                                               [&](const std::string& word) { return word.starts_with(data + "/"); });
  });
  auto state = begin(o, needs_data ? to_utf8(data) : std::string(), directory);
  if (!state) return tools::complain(state.error());
  if (const Status s = check_data(todo); !s) return tools::complain(s.error());
  if (o.dry_run) {
    for (const Step& step : todo)
      std::printf("%s: %s%s\n", step.title.c_str(),
                  step.direct.empty() ? ("telesplat " + shell_line(step.arguments)).c_str()
                                      : ("draws " + step.direct + " without points").c_str(),
                  state->done.contains(step.title) ? " (done)" : "");
    return 0;
  }
  fs::create_directories(directory, error);
  if (const Status s = write_progress(*state, directory); !s) return tools::complain(s.error());
  net::install_signal_handlers();
  Thesis work(std::move(todo), std::move(*state), directory);
  const Status done = work.run();
  if (const Status s = report(work.state(), *parts, directory); !s) return tools::complain(s.error(), 1);
  if (done) return 0;
  tools::complain({fmt::format("{}; the same command goes on", done.error().text)}, 1);
  return work.interrupted() ? kInterrupted : 1;
}

options::Table thesis_table(ThesisOptions& o) {
  return {{.flag = "--out", .value = &o.out, .help = "folder of the record and the report; a begun one goes on"},
          {.flag = "--data",
           .value = &o.data,
           .help = "folder of the data sets that stand for the thesis's",
           .default_text = "$TELESPLAT_DATA, else ~/.cache/telesplat-data"},
          {.flag = "--only",
           .value = &o.parts,
           .help = "tables, and 6 for figures 6.1 to 6.3",
           .limits = options::Check([](const std::string& text) {
             const auto parts = parse_parts(text);
             return parts ? std::string() : parts.error().text;
           })},
          {.flag = "--quick", .value = &o.quick, .help = "short runs, a smaller tree, fewer nodes: minutes"},
          {.flag = "--dry-run", .value = &o.dry_run, .help = "print the steps, start none"}};
}

}  // namespace

Command bench_thesis_command() {
  return make_command("thesis", "the thesis's tables 7.1 to 7.4 and figures 6.1 to 6.3, each beside its own numbers",
                      thesis_table, thesis);
}

}  // namespace telesplat::launcher
