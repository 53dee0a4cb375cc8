// What all service programs share: common flags, signals, process figures.
#pragma once

#include <functional>
#include <string>

#include "common/core/result.h"

namespace CLI {
class App;
}

namespace telesplat::net {

struct ServiceOptions {
  std::string name;
  std::string master = "tcp://127.0.0.1:7700";
  std::string bind = "tcp://127.0.0.1:*";  ///< where data and packer bind; `*`: a free port
  bool insecure = false;
  std::string log_level = "info";
};

/// Adds --name, --log-level, --insecure; --bind if the program binds, --master if it connects to one.
enum class Ends { kConnects, kBinds, kBoth };
void add_service_flags(CLI::App& app, ServiceOptions& options, Ends ends);

/// Parses; --help prints and exits 0, bad usage prints what is wrong and exits 2.
void parse_or_exit(CLI::App& app, int argc, char** argv);

/// SIGINT and SIGTERM set a flag instead of ending the process.
void install_signal_handlers();
bool stop_requested();

/// Lowers the calling thread's priority by `levels` of nice: for work that must not take the processor from a display.
void lower_thread_priority(int levels);

/// Resident memory of this process now / at most so far, MB.
double resident_mb();
double peak_resident_mb();

/// Runs a program's body: exceptions that escape become one line and exit code 1.
int guarded_main(const std::function<int()>& body);

}  // namespace telesplat::net
