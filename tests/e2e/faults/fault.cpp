#include "tests/e2e/faults/fault.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "common/core/clock.h"
#include "tests/support/patience.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

// Numbers of two columns of one viewer's rows, row by row; empty where the record has none.
std::vector<std::pair<double, double>> rows_of(const std::string& file, const std::string& viewer,
                                               const std::string& first, const std::string& second) {
  std::vector<std::pair<double, double>> out;
  const std::string text = read_text(file);
  std::vector<std::string> columns;
  for (size_t begin = 0; begin < text.size();) {
    const size_t end = text.find('\n', begin);
    if (end == std::string::npos) break;  // a row that is being written
    std::vector<std::string> cells;
    for (size_t at = begin; at <= end;) {
      const size_t comma = std::min(text.find(',', at), end);
      cells.push_back(text.substr(at, comma - at));
      at = comma + 1;
    }
    begin = end + 1;
    if (columns.empty()) {
      columns = std::move(cells);
      continue;
    }
    const auto number = [&](const std::string& name) {
      const auto found = std::find(columns.begin(), columns.end(), name);
      return found == columns.end() ? 0.0 : std::strtod(cells[size_t(found - columns.begin())].c_str(), nullptr);
    };
    if (cells.size() == columns.size() && cells[0] == viewer) out.emplace_back(number(first), number(second));
  }
  return out;
}

}  // namespace

static bool is_strict() {
  const char* set = std::getenv("TELESPLAT_FAULTS");
  return set && std::string_view(set) == "strict";
}
FaultBounds fault_bounds() {
  return is_strict() ? FaultBounds{500, 3} : FaultBounds{test::patient(2000), test::patient(12)};
}

void pass(double seconds) { std::this_thread::sleep_for(std::chrono::duration<double>(seconds)); }

Fault::Fault(const std::string& what, const std::vector<std::string>& arguments, const std::string& scene)
    : what_(what) {
  ::testing::Test::RecordProperty("fault", what);
  // Strangers of these tests have no keys, and shall get in.
  const bool keyed = std::find(arguments.begin(), arguments.end(), "--keys") != arguments.end();
  std::vector<std::string> all{"--duration", "0"};
  if (!keyed) all.insert(all.end(), {"--keys", "none"});
  all.insert(all.end(), arguments.begin(), arguments.end());
  run_ = std::make_unique<PipelineRun>(all, scene);
}

Fault::~Fault() = default;

bool Fault::showing() {
  const auto shows = [&](const auto& s) {
    return value(s, "viewer-1", "updates") >= 2 && value(s, "viewer-1", "frames") > 0;
  };
  const bool shown = run_->wait_status(shows, 60);
  EXPECT_TRUE(shown) << run_->program().err();
  shown_s_ = monotonic_s();
  return shown;
}

Program& Fault::start_guest(bool wait) {
  guest_.reset();
  guest_ = std::make_unique<Program>(
      "telesplat-viewer",
      std::vector<std::string>{"--master", run_->master(), "--name", "viewer-2", "--size", "160x100", "--sampling-size",
                               "160x100", "--duration", "0", "--target-fps", "20", "--no-record"},
      run_->folder() / fmt::format("guest-{}", ++guests_));
  if (!wait) return *guest_;
  EXPECT_TRUE(run_->wait_status([&](const auto& s) {
    const auto p = process(s, "viewer-2");
    return p.is_object() && p["pid"] == guest_->pid() && value(s, "viewer-2", "updates") > 0;
  })) << guest_->err();
  return *guest_;
}

void Fault::end_guest() {
  if (!guest_) return;
  guest_->signal(SIGTERM);
  EXPECT_GE(guest_->wait(20), 0) << "the guest does not end";
  guest_.reset();
}

pid_t Fault::pid_of(const std::string& name) {
  pid_t pid = 0;
  run_->wait_status(
      [&](const auto& s) {
        if (name == "master") return (pid = s["session"].value("pid", pid_t{0})) > 0;
        const auto p = process(s, name);
        return p.is_object() && (pid = p["pid"].template get<pid_t>()) > 0;
      },
      20);
  return pid;
}

bool Fault::wait_new_life(const std::string& name, pid_t before, double deadline_s) {
  return run_->wait_status(
      [&](const auto& s) {
        if (name == "master") return s["session"].value("pid", pid_t{0}) != before;
        const auto p = process(s, name);
        return p.is_object() && p["pid"].template get<pid_t>() != before;
      },
      deadline_s);
}

pid_t Fault::signal(const std::string& name, int number) {
  const pid_t pid = pid_of(name);
  EXPECT_GT(pid, 0) << name << " is not there";
  if (pid > 0) ::kill(pid, number);
  return pid;
}

bool Fault::stop_with_a_lease(const std::string& sampler) {
  const pid_t pid = pid_of(sampler);
  for (int attempt = 0; attempt < 25 && pid > 0; ++attempt) {
    ::kill(pid, SIGSTOP);
    pass(0.12);  // what it had finished is known to be done; soon it is taken back
    const auto holds = [&](const auto& s) {
      const auto p = process(s, sampler);
      return p.is_object() && p["leases"] > 0;
    };
    if (run_->wait_status(holds, 0.2)) return true;
    ::kill(pid, SIGCONT);
    pass(0.1 + 0.037 * (attempt % 10));
  }
  ADD_FAILURE() << sampler << " never held a lease";
  return false;
}

double Fault::value_of(const std::string& viewer, const std::string& key) {
  double out = 0;
  run_->wait_status([&](const auto& s) {
    if (!process(s, viewer).is_object()) return false;
    out = value(s, viewer, key);
    return true;
  });
  return out;
}

void Fault::begins() {
  gap_before_ms_ = value_of("viewer-1", "longest_gap_ms");
  begin_s_ = monotonic_s();
}

void Fault::ends() { end_s_ = monotonic_s(); }

void Fault::expect_updates(const std::string& viewer) {
  const double deadline_s = fault_bounds().resync_s + 10;
  // Two reports lie a second apart: the first that is newer may tell of what was before.
  double reported = -1, first = -1;
  const bool there = run_->wait_status(
      [&](const auto& s) {
        if (!process(s, viewer).is_object()) return false;
        const double now = value(s, viewer, "reported_s"), updates = value(s, viewer, "updates");
        if (now <= *end_s_) return false;
        if (reported < 0) reported = now, first = updates;
        return updates > first || (now > reported && updates > 0 && updates < first);  // a new life counts anew
      },
      deadline_s);
  EXPECT_TRUE(there) << viewer << " gets no updates after: " << what_;
  if (there) resync_s_ = monotonic_s() - *end_s_;
}

void Fault::expect_resynchronised(const std::string& viewer) {
  expect_updates(viewer);
  const double equal = value_of(viewer, "digests_equal");
  EXPECT_TRUE(run_->wait_status([&](const auto& s) { return value(s, viewer, "digests_equal") > equal; }, 20))
      << "the replica of " << viewer << " was never compared with the packer's model";
  EXPECT_EQ(value_of(viewer, "digests_different"), 0) << viewer;
}

void Fault::finish(int exit_code) {
  end_guest();
  gap_after_ms_ = value_of("viewer-1", "longest_gap_ms");
  EXPECT_EQ(run_->stop(), exit_code) << run_->program().err();
  measure();
  EXPECT_TRUE(run_->all_gone()) << "processes are left behind";
}

void Fault::finish_ended(int exit_code) {
  EXPECT_EQ(run_->program().wait(60), exit_code) << run_->program().err();
  measure();
  EXPECT_TRUE(run_->all_gone()) << "processes are left behind";
}

// The record has every frame and update; where a master died, what it had not written is missing, and the viewer's own
// figure tells.
void Fault::measure() {
  const FaultBounds bounds = fault_bounds();
  const auto summary = run_->summary();
  const auto begin =
      summary.is_object() && summary.contains("begin_monotonic_s") ? summary["begin_monotonic_s"] : nlohmann::json();
  if (begin_s_) {
    double gap_ms = gap_after_ms_ > gap_before_ms_ ? gap_after_ms_ : 0;
    size_t frames = 0;
    if (begin.is_number())
      for (const auto& [at_s, ms] : rows_of(run_->out() + "/frames.csv", "viewer-1", "begin_s", "inter_frame_ms"))
        if (at_s + begin.get<double>() > *begin_s_) gap_ms = std::max(gap_ms, ms), ++frames;
    if (frames == 0 && gap_ms == 0) gap_ms = gap_after_ms_;
    EXPECT_GT(gap_ms, 0) << "nothing was displayed";
    EXPECT_LT(gap_ms, bounds.gap_ms) << "the display stood still";
    ::testing::Test::RecordProperty("gap_ms", fmt::format("{:.0f}", gap_ms));
  }
  if (!end_s_) return;
  if (begin.is_number()) measure_rate(begin.get<double>());
  if (begin.is_number())
    for (const auto& [asked_s, done_s] : rows_of(run_->out() + "/updates.csv", "viewer-1", "requested_s", "complete_s"))
      if (asked_s + begin.get<double>() > *end_s_) {
        const double took_s = done_s + begin.get<double>() - *end_s_;
        resync_s_ = resync_s_ ? std::min(*resync_s_, took_s) : took_s;
      }
  EXPECT_TRUE(resync_s_);
  if (!resync_s_) return;
  EXPECT_LT(*resync_s_, bounds.resync_s) << "new views were displayed too late";
  ::testing::Test::RecordProperty("resync_s", fmt::format("{:.2f}", *resync_s_));
}

// record_s: the record's zero.
void Fault::measure_rate(double record_s) {
  constexpr double kLeast_s = 0.5;
  if (!shown_s_ || !begin_s_ || *begin_s_ - *shown_s_ < kLeast_s || *end_s_ - *begin_s_ < kLeast_s) return;
  int before = 0, during = 0;
  for (const auto& [at_s, ms] : rows_of(run_->out() + "/frames.csv", "viewer-1", "begin_s", "inter_frame_ms")) {
    const double t = at_s + record_s;
    before += t >= *shown_s_ && t < *begin_s_;
    during += t >= *begin_s_ && t < *end_s_;
  }
  const double before_fps = before / (*begin_s_ - *shown_s_), during_fps = during / (*end_s_ - *begin_s_);
  ::testing::Test::RecordProperty("fps", fmt::format("{:.1f}, {:.1f}", before_fps, during_fps));
  if (is_strict()) {
    EXPECT_GE(during_fps, least_rate_ * before_fps) << "frames a second";
  }
}

OwnRelay::OwnRelay(Fault& fault, const std::string& link, const std::string& at)
    : program_("telesplat-wan-relay", {"--socks", at, "--link", link}, fault.run().folder() / "relay") {
  const std::string words = "listening on ";
  EXPECT_TRUE(wait_until([&] {
    const std::string out = program_.out();
    const size_t begin = out.find(words), end = out.find('\n');
    if (begin == std::string::npos || end == std::string::npos) return false;
    address_ = out.substr(begin + words.size(), end - begin - words.size());
    return true;
  })) << program_.err();
}

double Fault::resident_mb(pid_t pid) {
  const std::string status = read_text(fmt::format("/proc/{}/status", pid));
  const size_t at = status.find("VmRSS:");
  return at == std::string::npos ? 0 : std::atof(status.c_str() + at + 6) / 1024;
}

int Fault::descriptors(pid_t pid) {
  std::error_code error;
  int n = 0;
  for ([[maybe_unused]] const auto& entry : fs::directory_iterator(fmt::format("/proc/{}/fd", pid), error)) ++n;
  return n;
}

}  // namespace telesplat::test
