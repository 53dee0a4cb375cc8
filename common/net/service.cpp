#include "common/net/service.h"

#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <fstream>

namespace telesplat::net {
namespace {
std::atomic<bool> stop_flag{false};
void on_signal(int) { stop_flag = true; }
}  // namespace

void add_service_flags(CLI::App& app, ServiceOptions& o, Ends ends) {
  if (ends != Ends::kBinds) app.add_option("--master", o.master, "address of the master")->capture_default_str();
  app.add_option("--name", o.name, "name in logs and metrics")->capture_default_str();
  if (ends != Ends::kConnects)
    app.add_option("--bind", o.bind, "address to bind to; port * takes a free one")->capture_default_str();
  app.add_flag("--insecure", o.insecure, "allow addresses other than loopback without encryption");
  app.add_option("--log-level", o.log_level, "trace, debug, info, warn, error or off")
      ->capture_default_str()
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
}

void parse_or_exit(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    std::exit(app.exit(e) == 0 ? 0 : 2);
  }
}

void install_signal_handlers() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}
bool stop_requested() { return stop_flag; }

void lower_thread_priority(int levels) {
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + levels);
}

double resident_mb() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

double peak_resident_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

int guarded_main(const std::function<int()>& body) {
  try {
    return body();
  } catch (const std::exception& e) {
    std::fprintf(stderr, "telesplat: %s\n", e.what());
    return 1;
  }
}

}  // namespace telesplat::net
