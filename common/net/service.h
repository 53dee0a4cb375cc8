// What all service programs share: common flags, signals, process figures.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/net/keys/access.h"
#include "common/options/table.h"

namespace telesplat::net {

struct ServiceOptions {
  std::string name;
  std::string master = "tcp://127.0.0.1:7700";
  std::string bind = "tcp://127.0.0.1:*";  ///< where data and packer bind; `*`: a free port
  std::string advertise;  ///< host that others are told to connect to; empty: as bound, or host_name() for a wildcard
  bool insecure = false;
  std::string keys;              ///< folder of keys; empty: without
  std::vector<std::string> via;  ///< proxies, as Via::parse() takes them
  std::string link;              ///< what the links through them are like, for the record; empty: they are none
  std::string log_level = "info";
  double give_up_after_s = 0;       ///< what it waits for, its master or others of the session; 0: never
  uint64_t max_connections = 1024;  ///< of each socket that is bound, at a time
  double queue_limit_mb = 256;      ///< that wait for one peer to read them, 10^6 bytes
  double max_messages = 20000;      ///< requests of one peer, a second
  uint64_t queue_limit_bytes() const { return uint64_t(queue_limit_mb * 1e6); }
};

/// Adds --name, --log-level, --insecure, --keys; --bind, --max-connections and --queue-limit-mb if the program binds,
/// --master (or TELESPLAT_MASTER in the environment) if it connects to one, --advertise and --max-messages if it does
/// both, --via and --link if it only connects, --give-up-after if it connects.
enum class Ends { kConnects, kBinds, kBoth };
options::Table service_table(ServiceOptions& options, Ends ends);

/// --max-connections and --queue-limit-mb, of services that bind and of who starts them.
options::Table peer_limit_table(ServiceOptions& options);
/// The environment variable that names a folder of keys where --keys is not given.
inline constexpr const char* kKeysVariable = "TELESPLAT_KEYS";
/// The row of --keys, of services and of programs that ask a master; kNoKeys: without, whatever the environment or the
/// session's file names.
options::Row keys_row(std::string& folder);

/// The row of --give-up-after, of services that connect and of who starts them.
options::Row give_up_row(double& after_s);

/// What options.via and options.keys come to. roles, binds: as read_keys() takes them. Error: names the flag and its
/// value.
Result<Access> access_of(const ServiceOptions& options, const std::vector<Role>& roles, bool binds = false);

/// What every service begins with: its log, SIGINT and SIGTERM that set a flag, and its access, as access_of() has it.
Result<Access> begin_service(const ServiceOptions& options, const std::vector<Role>& roles, bool binds = false);

/// Finds the session that --master auto means, and the keys that it runs with. connects: the program has a master.
/// Returns 0, or writes to stderr why no master is found and returns the exit code.
int settle_master(ServiceOptions& options, bool connects);

/// This machine's name; in a container that of the container.
std::string host_name();
/// ROLE-HOST-PID: process ids alone are no names, every container has a process 1.
std::string unique_name(const std::string& role);
/// What others are told to connect to for `endpoint`, as Socket::bind returned it: tcp://HOST:PORT with `advertise` for
/// HOST, or with host_name() if it was bound to a wildcard (0.0.0.0, [::]) and `advertise` is empty. Other transports
/// stay as they are.
std::string announced(const std::string& endpoint, const std::string& advertise);
/// Empty if `host` is a name or address that others can connect to, else what is wrong with it.
std::string complain_about_host(const std::string& host);

/// SIGINT and SIGTERM end the process at once with code 0: for the time when there is nothing to lose and no loop that
/// could look at a flag. To be called first: a first process of a container that has no handlers is not reached by
/// them.
void end_on_signals();
/// From now on SIGINT and SIGTERM set a flag instead of ending the process.
void install_signal_handlers();
bool stop_requested();
/// What was asked for has been done; another signal asks anew.
void forget_stop();

/// From now on this process may have as many files and connections open as it may ask for. Returns how many.
uint64_t raise_file_limit();

/// Lowers the calling thread's priority by `levels` of nice: for work that must not take the processor from a display.
void lower_thread_priority(int levels);

/// Keeps up to 128 MB of freed memory for the next images of tiles, which are as large: to get them anew from the
/// system, page by page, costs as much as to fill them.
void keep_freed_memory();
/// Gives freed memory back to the system, but for 1 MB: what was needed once must not stay for ever. Takes some
/// milliseconds.
void return_freed_memory();

/// Resident memory of this process now / at most so far, MB.
double resident_mb();
double peak_resident_mb();

/// Runs a program's body: exceptions that escape become one line and exit code 1.
int guarded_main(const std::function<int()>& body);

// What every process tells the record of a run about itself.

/// Facts of a hello: "host", "version", "processor", "cores", "memory_mb", "command" (its command line), "launched_by"
/// (the command line of the launcher that started it). What the system does not tell is not there.
std::map<std::string, std::string> process_facts();

}  // namespace telesplat::net
