// A whole session in one process: the real services of a master, a data server, samplers, a packer and viewers take
// turns on a simulated network, and each has a clock of its own. What happens is the same for the same scenario, to the
// byte, on every x86-64 machine. One session at a time: it is the World of its process (common/core/machine.h).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/machine.h"
#include "common/net/turns.h"
#include "tools/lab/simulation/dice.h"
#include "tools/lab/simulation/process.h"

namespace telesplat::simulation {

/// Is called while a session runs. Times are the network's, in s.
class Observer {
 public:
  virtual ~Observer() = default;
  virtual void on_passed(const Passed&) {}
  virtual void on_event(const Event&) {}
  /// A life of a part begins or ends. process: its number on the network.
  virtual void on_begin(Part, int /*process*/, double /*now_s*/) {}
  virtual void on_end(Part, int /*process*/, double /*now_s*/, const std::string& /*how*/) {}
  /// A viewer displayed a frame.
  virtual void on_frame(Part, SimulatedViewer&, const viewer::DrawnFrame&, double /*now_s*/) {}
  /// A process refused a message.
  virtual void on_rejected(Part, std::string_view /*socket*/, const net::Message&, const std::string& /*why*/) {}
  /// A process ended with this code though nothing had told it to, or could not begin.
  virtual void on_unexpected(Part, const std::string& /*what*/, double /*now_s*/) {}
};

struct Heard;

class Session final : public World {
 public:
  /// folder: of the record, where the scenario has one; empty: none.
  Session(const Scenario& scenario, std::vector<Observer*> observers, std::string folder = {});
  ~Session() override;

  /// Takes turns until then, or until stop() is called.
  void run_until(double until_s);
  void stop() { stopped_ = true; }
  /// Tells the master to end the session, and takes turns until all processes have ended.
  void end();

  double now_s() const { return now_s_; }
  const Scenario& scenario() const { return scenario_; }
  Part part_of(int process) const { return lives_.at(size_t(process)); }
  /// Null: it does not run.
  SimulatedViewer* viewer(int number);
  bool runs(Part part) const;
  /// Returns the scene that the data servers show now.
  Show show() const { return show_; }
  /// Returns the number of processes of a role that run or are about to.
  int count(Role role) const;
  geometry::Pose head(int viewer) const;
  uint64_t turns() const { return turns_; }
  uint64_t frames() const { return frames_; }
  const SimulatedNetwork& network() const { return network_; }

  // World
  double monotonic_s() override;
  double thread_cpu_s() override;
  const std::string& clock_id() override;
  uint64_t random_bits() override { return dice_.bits(); }
  uint64_t process_id() override;
  bool stop_requested() override;
  /// The process whose turn it is works for so long.
  void spend(double seconds) { spent_s_ += seconds; }

 private:
  using Process = SimulatedProcess;
  Process& process(Part part);
  void add(Part part, double starts_s);
  void begin(Process& p);
  void kill(Process& p, const std::string& how);
  void ended(Process& p);
  void take_turn(Process& p);
  void display(Process& p);
  void run_as(Process& p, const std::function<void()>& what);
  void apply(const Event& event);
  void trouble_links(const Event& event);
  void speak(const Event& event);
  void join(Role role, std::optional<Role> key_of = {});
  void change_show(const Event& event);
  void leave(Part part);
  void begin_calm();
  void passed(const Passed& message);
  void link(Process& p);

  const Scenario scenario_;
  Show show_;
  const std::vector<Observer*> observers_;
  Disk disk_;
  Dice dice_;
  SimulatedNetwork network_;
  std::vector<std::unique_ptr<Process>> processes_;
  std::vector<Part> lives_;                    // by number on the network
  std::map<int, geometry::Trajectory> heads_;  // by number of the viewer
  Process* current_ = nullptr;
  double now_s_ = 0, spent_s_ = 0;
  size_t next_event_ = 0;
  bool stopped_ = false, ends_ = false, calm_ = false;
  uint64_t turns_ = 0, frames_ = 0;
  class Peer;
  std::unique_ptr<Heard> heard_;
  std::vector<std::unique_ptr<Peer>> peers_;
};

}  // namespace telesplat::simulation
