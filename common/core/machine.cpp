#include "common/core/machine.h"

#include <sched.h>
#include <sys/sysinfo.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <thread>

namespace telesplat {
namespace {

constexpr size_t kMaxCommandLine = 8192;

// The value behind the first line "key : value" of /proc/cpuinfo.
std::string cpu_info(const std::string& key) {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);) {
    const size_t colon = line.find(": ");
    if (line.starts_with(key) && colon != line.npos) return line.substr(colon + 2);
  }
  return {};
}

// Processors whose time the control group of this folder may use; 0: no limit, or the system does not report it.
double quota_of(const std::filesystem::path& group) {
  std::ifstream in(group / "cpu.max");
  double quota_us = 0, period_us = 0;  // or "max 100000", which is no number
  return in >> quota_us >> period_us && period_us > 0 ? quota_us / period_us : 0;
}

// Bytes that the control group of this folder may use; 0: no limit, or the system does not report it.
double memory_of(const std::filesystem::path& group) {
  std::ifstream in(group / "memory.max");
  double bytes = 0;  // or "max"
  return in >> bytes ? bytes : 0;
}

// The least limit of this process' control group and of the groups around it; 0: no limit.
double least_limit(double (*limit_of)(const std::filesystem::path&)) {
  std::ifstream in("/proc/self/cgroup");
  std::string line;
  while (std::getline(in, line) && !line.starts_with("0::")) {
  }
  if (!line.starts_with("0::/")) return 0;
  const std::filesystem::path root = "/sys/fs/cgroup";
  double out = 0;
  for (auto group = root / line.substr(4);; group = group.parent_path()) {
    if (const double limit = limit_of(group); limit > 0) out = out > 0 ? std::min(out, limit) : limit;
    if (group.string().size() <= root.string().size() + 1) return out;
  }
}

bool plain(const std::string& argument) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_./:=,+@%";
  return !argument.empty() && argument.find_first_not_of(kPlain) == argument.npos;
}

}  // namespace

Machine this_machine() {
  Machine out;
  out.processor = cpu_info("model name");
  if (out.processor.empty()) out.processor = cpu_info("Model");  // the key on ARM boards
  out.cores = usable_processors();
  struct sysinfo info {};
  if (sysinfo(&info) == 0) out.memory_mb = double(info.totalram) * info.mem_unit / 1e6;
  return out;
}

int usable_processors() {
  cpu_set_t set;
  int out = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : int(std::thread::hardware_concurrency());
  if (const double quota = least_limit(quota_of); quota > 0) out = std::min(out, int(std::ceil(quota)));
  return std::max(out, 1);
}

double usable_memory_mb() {
  const double machine_mb = this_machine().memory_mb, group_mb = least_limit(memory_of) / 1e6;
  return group_mb > 0 && (machine_mb == 0 || group_mb < machine_mb) ? group_mb : machine_mb;
}

std::string shell_line(const std::vector<std::string>& arguments) {
  std::string out;
  for (const std::string& argument : arguments) {
    if (!out.empty()) out += ' ';
    if (plain(argument)) {
      out += argument;
      continue;
    }
    out += '\'';
    for (const char c : argument) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
    out += '\'';
  }
  return out;
}

std::string command_line() {
  std::ifstream in("/proc/self/cmdline", std::ios::binary);
  const std::string all((std::istreambuf_iterator<char>(in)), {});
  std::vector<std::string> arguments;
  for (size_t at = 0; at < all.size();) {
    const size_t end = std::min(all.find('\0', at), all.size());
    arguments.push_back(all.substr(at, end - at));
    at = end + 1;
  }
  std::string out = shell_line(arguments);
  if (out.size() > kMaxCommandLine) out = out.substr(0, kMaxCommandLine) + "...";
  return out;
}

namespace {

std::atomic<World*> world_now{nullptr};

}  // namespace

void enter_world(World* world) { world_now.store(world, std::memory_order_release); }
World* simulated_world() { return world_now.load(std::memory_order_acquire); }

uint64_t random_bits() {
  if (World* world = simulated_world()) return world->random_bits();
  std::random_device random;
  const uint64_t high = random();
  return high << 32 | random();
}

uint64_t process_id() {
  World* world = simulated_world();
  return world ? world->process_id() : uint64_t(getpid());
}

}  // namespace telesplat
