// Parts that all service programs share: common flags, signals, process figures.
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
  std::string bind = "tcp://127.0.0.1:*";  ///< address that data and packer bind; `*`: a free port
  std::string advertise;  ///< host for others to connect to; empty: as bound, or host_name() for a wildcard
  bool insecure = false;
  std::string keys;              ///< folder of keys; empty: without keys
  std::vector<std::string> via;  ///< proxies, as Via::parse() takes them
  std::string link;              ///< properties of the proxies' links, for the record; empty: unknown
  std::string log_level = "info";
  double give_up_after_s = 0;       ///< limit of a wait for the master or others of the session; 0: none
  uint64_t max_connections = 1024;  ///< at a time, of each socket that binds
  double queue_limit_mb = 256;      ///< limit of bytes that wait for one peer, 10^6 bytes
  double max_messages = 20000;      ///< limit of requests of one peer, a second
  uint64_t queue_limit_bytes() const { return uint64_t(queue_limit_mb * 1e6); }
};

/// Adds --name, --log-level, --insecure, --keys; --bind, --max-connections and --queue-limit-mb if the program binds;
/// --master (or TELESPLAT_MASTER in the environment) if it connects to one; --advertise and --max-messages if it does
/// both; --via and --link if it only connects; --give-up-after if it connects.
enum class Ends { kConnects, kBinds, kBoth };
options::Table service_table(ServiceOptions& options, Ends ends);

/// --max-connections and --queue-limit-mb, for services that bind and for programs that start them.
options::Table peer_limit_table(ServiceOptions& options);
/// The environment variable that names a folder of keys; used without --keys.
inline constexpr const char* kKeysVariable = "TELESPLAT_KEYS";
/// The row of --keys, for services and for programs that ask a master. kNoKeys: without keys, even if the environment
/// or the session's file names a folder.
options::Row keys_row(std::string& folder);

/// The row of --give-up-after, for services that connect and for programs that start them.
options::Row give_up_row(double& after_s);

/// Makes the access that options.via and options.keys describe. roles, binds: as read_keys() takes them. Error: names
/// the flag and its value.
Result<Access> access_of(const ServiceOptions& options, const std::vector<Role>& roles, bool binds = false);

/// First call of every service: opens its log, lets SIGINT and SIGTERM set a flag, and returns access_of().
Result<Access> begin_service(const ServiceOptions& options, const std::vector<Role>& roles, bool binds = false);

/// Finds the session that --master auto means, and its keys. connects: the program has a master. Returns 0, or writes
/// to stderr why no master is found and returns the exit code.
int settle_master(ServiceOptions& options, bool connects);

/// This machine's name; in a container the container's.
std::string host_name();
/// ROLE-HOST-PID: process ids alone are not unique, since every container has a process 1.
std::string unique_name(const std::string& role);
/// Address for others to connect to. endpoint: as Socket::bind returned it. Returns tcp://HOST:PORT with `advertise`
/// for HOST, or with host_name() if it was bound to a wildcard (0.0.0.0, [::]) and `advertise` is empty. Other
/// transports stay as they are.
std::string announced(const std::string& endpoint, const std::string& advertise);
/// Returns what is wrong with a host for others to connect to; empty: it is a valid name or address.
std::string complain_about_host(const std::string& host);

/// Lets SIGINT and SIGTERM end the process at once with code 0: while no data can be lost and no loop looks at a flag.
/// To be called first: the first process of a container ignores these signals until it has handlers.
void end_on_signals();
/// From now on SIGINT and SIGTERM set a flag instead of ending the process.
void install_signal_handlers();
bool stop_requested();
/// Clears the flag when the stop has been handled; the next signal sets it again.
void forget_stop();

/// Raises the limit of open files and connections to the most that this process may ask for. Returns that number.
uint64_t raise_file_limit();

/// Lowers the calling thread's priority by `levels` of nice: for work that must not take the processor from a display.
void lower_thread_priority(int levels);

/// Keeps up to 128 MB of freed memory for the images of the next tiles, which have the same size: getting it anew from
/// the system, page by page, costs as much as filling it.
void keep_freed_memory();
/// Gives freed memory back to the system, except 1 MB, so that one large need is not kept for ever. Takes some
/// milliseconds.
void return_freed_memory();

/// Resident memory of this process now / at most so far, MB.
double resident_mb();
double peak_resident_mb();

/// Runs a program's body: exceptions that escape become one line and exit code 1.
int guarded_main(const std::function<int()>& body);

// Facts that every process reports about itself for the record of a run.

/// Facts of a hello: "host", "version", "processor", "cores", "memory_mb", "command" (its command line), "launched_by"
/// (the command line of the launcher that started it). Omits facts that the system does not report.
std::map<std::string, std::string> process_facts();

}  // namespace telesplat::net
