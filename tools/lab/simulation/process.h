// One process of a simulated session: its program, its clock, when it runs next, and what faults do to it. Times are
// the network's, in s.
#pragma once

#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "tools/lab/simulation/programs.h"

namespace telesplat::simulation {

inline constexpr double kNever_s = std::numeric_limits<double>::infinity();

/// A process' monotonic clock.
struct ProcessClock {
  std::string id;
  double offset_s = 0, drift = 0;
  double at(double network_s) const { return kBootTime_s + offset_s + network_s * (1 + drift); }

 private:
  static constexpr double kBootTime_s = 1000;
};

/// When a process runs: its turns one after another, and frames of its display at their rate.
struct Schedule {
  net::Wait wait;
  double wake_s = 0, busy_until_s = 0, next_frame_s = 0;
  double cpu_s = 0, slowness = 1;
  bool ready = false;  ///< a message came

  void begin(double now_s) { wake_s = busy_until_s = next_frame_s = now_s; }
  void work(double now_s, double spent_s);
  /// Ends a turn, after which the process waits.
  void turned(double now_s, net::Wait waits);
  double next_turn_s(double now_s) const;
};

/// Faults and orders that end, stop or restart a process.
struct Fate {
  bool stopped = false, told_to_stop = false;
  bool gone = false;  ///< it does not start again
  bool dies = false;  ///< it is killed before its next turn
  std::optional<double> starts_s, goes_on_s;
  std::optional<double> killed_after;  ///< messages

  void restart(double at_s) { starts_s = at_s; }
  void stop(double until_s) { stopped = true, goes_on_s = until_s; }
  void go_on() { stopped = false, goes_on_s.reset(); }
  /// Counts a message that it sends. True: it is killed by that.
  bool dies_by_message();
};

struct SimulatedProcess {
  Part part;
  int number = -1;  ///< on the network, of its present life
  std::string name;
  std::optional<Role> key_of;  ///< an intruder's: the role of its key
  ProcessClock clock;
  std::unique_ptr<net::Context> context;
  std::unique_ptr<Program> program;  ///< null: it does not run
  Schedule schedule;
  Fate fate;

  bool is_viewer() const { return part.role == Role::kViewer; }
  /// When something happens to it next; kNever_s: nothing will.
  double due_s(double now_s) const;
};

/// The disk of a session's record. While it is full, files of this process cannot grow.
class Disk {
 public:
  /// folder: of the record; empty: nothing is written, and the disk never fills.
  explicit Disk(std::string folder) : folder_(std::move(folder)) {}
  const std::string& folder() const { return folder_; }
  void fill(double until_s);
  void free();
  bool is_full() const { return free_s_ < kNever_s; }
  bool was_full() const { return was_full_; }
  double free_s() const { return free_s_; }  ///< kNever_s: it is not full

 private:
  const std::string folder_;
  bool was_full_ = false;
  double free_s_ = kNever_s;
};

}  // namespace telesplat::simulation
