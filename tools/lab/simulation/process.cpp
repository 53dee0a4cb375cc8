#include "tools/lab/simulation/process.h"

#include <sys/resource.h>

#include <algorithm>
#include <utility>

namespace telesplat::simulation {
namespace {

constexpr double kTurn_s = 40e-6;  // that each turn takes

void limit_files(rlim_t bytes) {
  rlimit limit{};
  getrlimit(RLIMIT_FSIZE, &limit);
  limit.rlim_cur = std::min(bytes, limit.rlim_max);
  setrlimit(RLIMIT_FSIZE, &limit);
}

}  // namespace

void Schedule::work(double now_s, double spent_s) {
  cpu_s += spent_s;
  busy_until_s = std::max(busy_until_s, now_s + spent_s);
}

void Schedule::turned(double now_s, net::Wait waits) {
  busy_until_s = std::max(busy_until_s, now_s) + kTurn_s;
  wait = std::move(waits);
  wake_s = busy_until_s + wait.for_s;
  ready = ready || (!wait.sockets.empty() && net::wait_readable(wait.sockets, 0));
}

double Schedule::next_turn_s(double now_s) const { return std::max(busy_until_s, ready ? now_s : wake_s); }

bool Fate::dies_by_message() {
  if (!killed_after || --*killed_after > 0) return false;
  killed_after.reset();
  dies = true;
  return true;
}

double SimulatedProcess::due_s(double now_s) const {
  if (fate.starts_s) return std::max(*fate.starts_s, now_s);
  if (!program) return kNever_s;
  if (fate.stopped) return fate.goes_on_s.value_or(kNever_s);
  double out = schedule.next_turn_s(now_s);
  if (is_viewer()) out = std::min(out, schedule.next_frame_s);
  return std::max(out, now_s);
}

void Disk::fill(double until_s) {
  if (folder_.empty()) return;
  was_full_ = true;
  free_s_ = until_s;
  limit_files(1);
}

void Disk::free() {
  free_s_ = kNever_s;
  limit_files(RLIM_INFINITY);
}

}  // namespace telesplat::simulation
