#include "common/net/service.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <cstdlib>
#include <fstream>

#include "common/core/log.h"
#include "common/core/machine.h"
#include "common/core/version.h"
#include "common/net/master_address.h"
#include "common/options/complain.h"

namespace telesplat::net {

namespace {

constexpr const char* kWhoComes = "who takes part, and how much";
std::atomic<bool> stop_flag{false};
void set_flag(int) { stop_flag = true; }
void end_process(int) { _exit(0); }

void handle_signals(void (*handler)(int)) {
  struct sigaction action {};
  action.sa_handler = handler;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);
}

bool is_wildcard(std::string_view host) { return host == "*" || host == "0.0.0.0" || host == "[::]" || host == "::"; }
}  // namespace

options::Table service_table(ServiceOptions& o, Ends ends) {
  options::Table out;
  if (ends != Ends::kBinds)
    out.push_back({.flag = "--master",
                   .value = &o.master,
                   .help = "address of the master; auto: of the one session of yours that runs on this machine",
                   .reach = options::Reach::kHere,
                   .environment = kMasterVariable});
  out.push_back(
      {.flag = "--name", .value = &o.name, .help = "name in logs and metrics", .reach = options::Reach::kHere});
  if (ends != Ends::kConnects)
    out.push_back({.flag = "--bind",
                   .value = &o.bind,
                   .help =
                       "address to bind to; port * takes a free one; a process of several sockets takes this port and "
                       "those after it",
                   .reach = options::Reach::kHere});
  if (ends != Ends::kConnects) out = options::joined(std::move(out), peer_limit_table(o));
  if (ends == Ends::kBoth)
    out.push_back({.flag = "--max-messages",
                   .value = &o.max_messages,
                   .help = "requests of one peer a second; what is beyond is dropped and counted",
                   .limits = options::Range{10.0, 1e6}});
  if (ends == Ends::kBoth)
    out.push_back(
        {.flag = "--advertise",
         .value = &o.advertise,
         .help =
             "host that others are told to connect to; default: as bound, this host's name where that is a wildcard",
         .limits = options::Check(complain_about_host),
         .reach = options::Reach::kHere});
  if (ends == Ends::kConnects) {
    out.push_back({.flag = "--via",
                   .value = &o.via,
                   .help =
                       "HOST:PORT of a SOCKS5 proxy that connections go through; ROLE=HOST:PORT: those to processes "
                       "of this role, such as data",
                   .reach = options::Reach::kHere});
    out.push_back({.flag = "--link",
                   .value = &o.link,
                   .help = "what the link through --via is like, for the record",
                   .reach = options::Reach::kHere});
  }
  out.push_back({.flag = "--insecure",
                 .value = &o.insecure,
                 .help = "allow addresses other than loopback without encryption",
                 .reach = options::Reach::kHere});
  out.push_back(keys_row(o.keys));
  if (ends != Ends::kBinds) out.push_back(give_up_row(o.give_up_after_s));
  out.push_back({.flag = "--log-level",
                 .value = &o.log_level,
                 .help = "trace, debug, info, warn, error or off",
                 .limits = options::Names{"trace", "debug", "info", "warn", "error", "off"}});
  return out;
}

options::Table peer_limit_table(ServiceOptions& o) {
  return {{.flag = "--max-connections",
           .value = &o.max_connections,
           .help = "connections to each socket at a time; further ones are refused until there is room",
           .limits = options::Range{1, 1 << 20},
           .not_in_scene = kWhoComes},
          {.flag = "--queue-limit-mb",
           .value = &o.queue_limit_mb,
           .help = "MB that wait for one peer who does not read them; what is beyond is dropped and counted",
           .limits = options::Range{1.0, 1e6},
           .not_in_scene = kWhoComes}};
}

options::Row give_up_row(double& after_s) {
  return {.flag = "--give-up-after",
          .value = &after_s,
          .help =
              "seconds to wait for a master, or for what its session lacks, before it ends with exit code 1; 0: "
              "for ever",
          .limits = options::Range{0.0, 1e9},
          .reach = options::Reach::kChild};
}

options::Row keys_row(std::string& folder) {
  return {
      .flag = "--keys",
      .value = &folder,
      .help =
          "folder of keys, made by telesplat keys: encrypts, and lets in only those on its allow-list; none: without "
          "keys",
      .reach = options::Reach::kHere,
      .environment = kKeysVariable};
}

Result<Access> access_of(const ServiceOptions& o, const std::vector<Role>& roles, bool binds) {
  auto via = Via::parse(o.via);
  if (!via) return via.error();
  auto access = Access::open(*std::move(via), o.keys, roles, binds);
  if (access && o.insecure) access->allow_clear();
  return access;
}

Result<Access> begin_service(const ServiceOptions& o, const std::vector<Role>& roles, bool binds) {
  log::initialise(o.name, o.log_level);
  install_signal_handlers();
  return access_of(o, roles, binds);
}

int settle_master(ServiceOptions& o, bool connects) {
  if (connects) {
    MasterSearch search = find_master(o.master);
    if (search.address.empty()) return complain({search.problem}, search.exit_code());
    o.master = std::move(search.address);
    if (o.keys.empty()) o.keys = std::move(search.keys);
  }
  if (o.keys == kNoKeys) o.keys.clear();
  return 0;
}

std::string host_name() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 && *name ? name : "localhost";
}

std::string unique_name(const std::string& role) { return fmt::format("{}-{}-{}", role, host_name(), getpid()); }

std::string announced(const std::string& endpoint, const std::string& advertise) {
  constexpr std::string_view kTcp = "tcp://";
  const size_t colon = endpoint.rfind(':');
  if (!endpoint.starts_with(kTcp) || colon < kTcp.size()) return endpoint;
  const std::string bound = endpoint.substr(kTcp.size(), colon - kTcp.size());
  if (advertise.empty() && !is_wildcard(bound)) return endpoint;
  std::string host = advertise.empty() ? host_name() : advertise;
  if (host.find(':') != host.npos && host.front() != '[') host = "[" + host + "]";  // an IPv6 address
  return fmt::format("{}{}{}", kTcp, host, endpoint.substr(colon));
}

std::string complain_about_host(const std::string& host) {
  if (host.empty() || host.size() > 253) return "is empty or longer than the 253 characters of a host name";
  if (is_wildcard(host)) return host + " is a wildcard: nobody can connect to it";
  if (host.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789.-_:[]%") != host.npos)
    return host + " is neither a host name nor an address (without transport and port)";
  return {};
}

void end_on_signals() { handle_signals(end_process); }
void install_signal_handlers() {
  handle_signals(set_flag);
  std::signal(SIGXFSZ, SIG_IGN);  // a write beyond the file size limit becomes an error, like a full disk
}
bool stop_requested() {
  World* world = simulated_world();
  return world ? world->stop_requested() : stop_flag.load();
}
void forget_stop() { stop_flag = false; }

void keep_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 128 << 20);
#endif
}

void return_freed_memory() {
  if (simulated_world()) return;
#ifdef __GLIBC__
  malloc_trim(1 << 20);
#endif
}

uint64_t raise_file_limit() {
  rlimit limit{};
  if (getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  const rlimit raised{limit.rlim_max, limit.rlim_max};
  return setrlimit(RLIMIT_NOFILE, &raised) == 0 ? raised.rlim_cur : limit.rlim_cur;
}

void lower_thread_priority(int levels) {
  const auto thread = static_cast<id_t>(syscall(SYS_gettid));
  setpriority(PRIO_PROCESS, thread, getpriority(PRIO_PROCESS, thread) + levels);
}

double resident_mb() {
  if (simulated_world()) return 0;
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

double peak_resident_mb() {
  if (simulated_world()) return 0;
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024 / 1e6;
}

int guarded_main(const std::function<int()>& body) {
  try {
    return body();
  } catch (const std::exception& e) {
    return complain({e.what()}, 1);
  }
}

std::map<std::string, std::string> process_facts() {
  if (simulated_world()) return {};
  const Machine machine = this_machine();
  std::map<std::string, std::string> out{{"host", host_name()}, {"version", version()}, {"command", command_line()}};
  if (!machine.processor.empty()) out["processor"] = machine.processor;
  if (machine.cores > 0) out["cores"] = std::to_string(machine.cores);
  if (machine.memory_mb > 0) out["memory_mb"] = fmt::format("{:.0f}", machine.memory_mb);
  if (const char* launcher = std::getenv(kLaunchedByVariable); launcher && *launcher) out["launched_by"] = launcher;
  return out;
}

}  // namespace telesplat::net
