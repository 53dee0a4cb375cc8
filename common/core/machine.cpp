#include "common/core/machine.h"

#include <sys/sysinfo.h>

#include <algorithm>
#include <fstream>
#include <iterator>
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

bool plain(const std::string& argument) {
  constexpr const char* kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_./:=,+@%";
  return !argument.empty() && argument.find_first_not_of(kPlain) == argument.npos;
}

}  // namespace

Machine this_machine() {
  Machine out;
  out.processor = cpu_info("model name");
  if (out.processor.empty()) out.processor = cpu_info("Model");  // of ARM boards
  out.cores = int(std::thread::hardware_concurrency());
  struct sysinfo info {};
  if (sysinfo(&info) == 0) out.memory_mb = double(info.totalram) * info.mem_unit / 1e6;
  return out;
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

}  // namespace telesplat
