#include "tools/telesplat/sweep/one_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/core/clock.h"
#include "common/core/utf8.h"
#include "common/net/service.h"
#include "tools/telesplat/run/child_process.h"

namespace telesplat::launcher {
namespace {

constexpr double kLook_s = 0.05;
constexpr double kEndPatience_s = 30;  // of a run that is told to end because it took too long
constexpr size_t kLongestReason = 300;

std::string reason_for(int exit_code, const std::string& said) {
  const std::string why = complaint_in(said);
  const std::string how =
      exit_code > 128 ? fmt::format("ended by signal {}", exit_code - 128) : fmt::format("exit code {}", exit_code);
  return why.empty() ? how : how + ": " + why;
}

/// Waits for the child and passes on what this process is told.
class Watch {
 public:
  Watch(ChildProcess& child, double limit_s) : child_(child), limit_s_(limit_s) {}

  void until_ended(const std::function<void(double)>& watch) {
    while (!child_.ended()) {
      child_.read_lines();  // a full pipe must not hold it up
      const double elapsed_s = monotonic_s() - begin_s_;
      if (net::stop_requested()) pass_on();
      if (limit_s_ > 0 && elapsed_s > limit_s_) end_late(elapsed_s);
      watch(elapsed_s);
      std::this_thread::sleep_for(std::chrono::duration<double>(kLook_s));
    }
  }
  bool stopped() const { return stops_ > 0; }
  bool late() const { return late_; }
  double elapsed_s() const { return monotonic_s() - begin_s_; }

 private:
  void pass_on() {
    net::forget_stop();
    child_.signal(++stops_ < 3 ? SIGINT : SIGKILL);
  }
  void end_late(double elapsed_s) {
    if (!late_) child_.signal(SIGINT);
    if (elapsed_s > limit_s_ + kEndPatience_s) child_.signal(SIGKILL);
    late_ = true;
  }

  ChildProcess& child_;
  double limit_s_, begin_s_ = monotonic_s();
  int stops_ = 0;
  bool late_ = false;
};

}  // namespace

std::string complaint_in(const std::string& log) {
  std::istringstream in(log);
  std::string line, last, complaint;
  while (std::getline(in, line)) {
    std::erase_if(line, [](unsigned char c) { return c < ' ' || c == 0x7f; });
    if (line.starts_with("telesplat: ")) complaint = line.substr(11);
    if (!line.empty()) last = line;
  }
  return to_utf8((complaint.empty() ? last : complaint).substr(0, kLongestReason));
}

std::string last_words(const std::string& path, uintmax_t offset) {
  std::error_code error;
  const uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in || size <= offset) return {};
  const uintmax_t from = std::max(offset, size - std::min(size, kMostLastWords));
  in.seekg(std::streamoff(from));
  std::string out(size_t(size - from), '\0');
  in.read(out.data(), std::streamsize(out.size()));
  out.resize(size_t(in.gcount()));
  return out;
}

RunEnd carry_out(const RunRequest& request, const std::function<void(double)>& watch) {
  std::error_code error;
  const auto size = std::filesystem::file_size(request.log, error);
  const uintmax_t said_before = error ? 0 : size;
  const LoadMeter meter;
  auto child = ChildProcess::start("run", request.program, request.arguments, request.log, 0);
  if (!child) return {1, child.error().text, false, 0, meter.measured()};
  Watch watched(*child, request.limit_s);
  watched.until_ended(watch);
  RunEnd out{child->exit_code(), {}, watched.stopped(), watched.elapsed_s(), meter.measured()};
  if (watched.late())
    out.reason = fmt::format("took longer than {:.0f} s", request.limit_s);
  else if (out.exit_code != 0)
    out.reason = reason_for(out.exit_code, last_words(request.log, said_before));
  return out;
}

}  // namespace telesplat::launcher
