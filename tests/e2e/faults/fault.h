// A running session to which something happens: what the display did meanwhile, when new views were shown again, and
// that nothing is left behind. Measured figures go into the test's properties; tools/faults makes a table of them.
#pragma once

#include <sys/types.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {

/// Limits of a fault's cost. With TELESPLAT_FAULTS=strict in the environment (tools/faults) those promised; else more,
/// since other tests run beside this one.
struct FaultBounds {
  double gap_ms = 0;    ///< between two displayed frames
  double resync_s = 0;  ///< from the fault's end until a view that was asked for afterwards is displayed
};
FaultBounds fault_bounds();

class Fault {
 public:
  /// Starts a run without an end. what: the fault, for the table.
  explicit Fault(const std::string& what, const std::vector<std::string>& arguments = {},
                 const std::string& scene = "");
  ~Fault();

  PipelineRun& run() { return *run_; }
  /// Waits until viewer-1 shows points and view updates come.
  bool showing();
  /// A further viewer, "viewer-2", which the test itself starts (again); waits until it shows points, if it shall.
  Program& start_guest(bool wait = true);
  /// Ends the guest in order, if it is there.
  void end_guest();

  /// The process id of a living member: a name of the status answer, "master" or "viewer-2"; 0: it is not there.
  pid_t pid_of(const std::string& name);
  /// Waits until another process than `before` has that name.
  bool wait_new_life(const std::string& name, pid_t before, double deadline_s = 20);
  /// Sends a signal to the member. Returns its process id; 0: it was not there.
  pid_t signal(const std::string& name, int number);
  /// Stops a sampler, so that it cannot finish what it holds, and returns when it holds a lease.
  bool stop_with_a_lease(const std::string& sampler);

  /// From now on the display must not stand still.
  void begins();
  /// Its cause is gone; from now on views are to be displayed again.
  void ends();
  /// Waits until views that were asked for after ends() are displayed, and, of points, until the packer has told a
  /// digest that the viewer has, too.
  void expect_resynchronised(const std::string& viewer = "viewer-1");
  /// The same without the digest, for tests that wait for updates of the display.
  void expect_updates(const std::string& viewer = "viewer-1");
  /// Between begins() and ends() the display shows at least this share of the frames a second that it showed before.
  /// Asked for on quiet machines only (TELESPLAT_FAULTS=strict).
  void expect_rate(double share) { least_rate_ = share; }
  /// Ends the session, and expects of it an exit code, a display that never stood still since begins(), and that no
  /// process is left behind.
  void finish(int exit_code = 0);
  /// The same after the session was ended some other way, or ended by itself.
  void finish_ended(int exit_code);

  /// Resident memory of a process now, MB; 0: it is not there.
  static double resident_mb(pid_t pid);
  /// Open descriptors of a process.
  static int descriptors(pid_t pid);

 private:
  double value_of(const std::string& viewer, const std::string& key);
  void measure();
  void measure_rate(double record_s);

  std::string what_;
  std::unique_ptr<PipelineRun> run_;
  std::unique_ptr<Program> guest_;
  int guests_ = 0;
  std::optional<double> shown_s_, begin_s_, end_s_;  // monotonic
  double least_rate_ = 0;
  double gap_before_ms_ = 0, gap_after_ms_ = 0;
  std::optional<double> resync_s_;
};

/// A relay of the test's own, for a process that it starts itself with --via data=address().
class OwnRelay {
 public:
  /// link: as telesplat-wan-relay takes it. at: an address to listen at, which is free.
  explicit OwnRelay(Fault& fault, const std::string& link = "local", const std::string& at = "127.0.0.1:*");
  const std::string& address() const { return address_; }

 private:
  Program program_;
  std::string address_;
};
/// So little passes that a list of chunks does, and chunks do not.
constexpr const char* kTrickle = "10kbit";

/// Sleeps; faults last some time.
void pass(double seconds);

}  // namespace telesplat::test
