#include "tools/telesplat/sweep/load.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <sstream>

#include "common/core/clock.h"

namespace telesplat::launcher {
namespace {

std::string text_of(const char* path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

double busy_now() { return busy_seconds(text_of("/proc/stat"), double(sysconf(_SC_CLK_TCK))).value_or(0); }
double load_now() { return mean_load(text_of("/proc/loadavg")).value_or(0); }

// CPU time of this process and of children that were waited for.
double own_now() {
  double out = 0;
  for (const int who : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage usage{};
    if (getrusage(who, &usage) != 0) continue;
    for (const timeval& t : {usage.ru_utime, usage.ru_stime}) out += double(t.tv_sec) + double(t.tv_usec) * 1e-6;
  }
  return out;
}

}  // namespace

std::optional<double> busy_seconds(const std::string& stat, double ticks_per_s) {
  // "cpu user nice system idle iowait irq softirq steal guest guest_nice"; guests are in user and nice already.
  std::istringstream in(stat);
  std::string word;
  if (!(in >> word) || word != "cpu" || ticks_per_s <= 0) return std::nullopt;
  double ticks = 0, value = 0;
  int read = 0;
  for (; read < 8 && in >> value; ++read)
    if (read != 3 && read != 4) ticks += value;
  if (read < 5) return std::nullopt;
  return ticks / ticks_per_s;
}

std::optional<double> mean_load(const std::string& loadavg) {
  std::istringstream in(loadavg);
  double out = 0;
  return in >> out ? std::optional(out) : std::nullopt;
}

double others_share(double busy_s, double own_s, double elapsed_s, int cores) {
  const double all_s = elapsed_s * cores;
  return all_s > 0 ? std::clamp((busy_s - own_s) / all_s, 0.0, 1.0) : 0;
}

LoadMeter::LoadMeter() : begin_s_(monotonic_s()), load_(load_now()), busy_s_(busy_now()), own_s_(own_now()) {}

Load LoadMeter::measured() const {
  // All of the machine, not only what this process may use: /proc/stat tells of all.
  const int cores = int(std::max(1l, sysconf(_SC_NPROCESSORS_ONLN)));
  const double elapsed_s = monotonic_s() - begin_s_, own_s = own_now() - own_s_;
  return {load_, load_now(), others_share(own_s, 0, elapsed_s, cores),
          others_share(busy_now() - busy_s_, own_s, elapsed_s, cores)};
}

}  // namespace telesplat::launcher
