// The processes of one session on this machine: starts them in any order, supervises them, ends them together.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/links/link.h"
#include "tools/common/progress_line.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/process_group.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {

/// A process of a session that ended.
struct Ended {
  std::string role;
  int code = 0;                ///< exit code; 128 + the signal's number
  int restarts = 0;            ///< restarts in the last minute (Restarts::lately)
  bool chosen = false;         ///< it serves a data set that a person chose in a window
  bool record_failed = false;  ///< it reported that it could not write all of the record, and nothing else was wrong
  bool others = false;         ///< a viewer: other viewers of this launcher still run
};
enum class Consequence {
  kNone,
  kRestart,
  kGiveUp,  ///< the session goes on without it, and its windows say why
  kFinish,  ///< the session's end, in order
  kFail,    ///< the session's end, as an error
  kRefuse,  ///< kFinish: its input cannot be used
};
/// Returns the consequence of a process' end.
Consequence consequence_of(const Ended& ended);

class Pipeline {
 public:
  /// Starts master, data servers, packer, samplers and viewers (the viewers alone if options.join_master is set). A
  /// wall's viewers follow in supervise(), once the data servers have read their data.
  static Result<Pipeline> start(const RunOptions& options);

  const std::string& master_endpoint() const { return group_.endpoint(); }
  /// Keys for asking the master.
  const net::Access& access() const { return group_.access(); }
  /// Process id of its first viewer; 0: it does not run.
  pid_t display();
  /// Names of the viewers that were started.
  std::vector<std::string> viewers();

  enum class State { kRunning, kFinished, kFailed, kBadInput };
  /// Looks after the children; does not wait. Starts servers that died again, the master at its old address, unless
  /// they die too often (Restarts). The death of the last viewer ends the run, which is finished when all viewers are.
  /// A data set chosen in a window that cannot be served does not end it. `news` gets lines for the person.
  State supervise(std::vector<std::string>& news);
  /// "reading a.ply 43 %, 12 s left" and the like, from the children's progress lines; empty: no progress to show.
  const std::string& progress() const { return progress_; }
  /// Takes the viewers' lines for the person, since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Takes the data sets that people chose in windows, since the last call.
  std::vector<std::string> take_wishes() { return std::exchange(wishes_, {}); }
  /// Sends a line to the viewers that it started with a window (viewer::LauncherLines).
  void tell_viewers(const std::string& line);
  /// Continues the session with the data set of these options: new data servers replace the old ones. goes_back: if
  /// they cannot serve it, the old data set returns.
  Status open(const RunOptions& options, bool goes_back = false);
  /// Options of the data set that is shown.
  const data::DataServiceOptions& data() const { return options_.data; }
  /// Changes the number of samplers here to `count`: starts more, or asks the newest ones to finish.
  Status set_samplers(int count);
  /// Ends everything: viewers first, then a "stop" to the master, then the remaining processes.
  void finish();
  /// After finish(): parts of the record that could not be written, a line a process; empty: it is whole.
  const std::vector<std::string>& record_failures() const { return record_failures_; }
  /// True if a viewer has died, and the session went on for the others.
  bool viewer_died() const { return viewer_died_; }

 private:
  Pipeline(const RunOptions& options, ProcessGroup group);
  Status start_servers();
  Status start_data();
  Status start_sampler(int number);
  Status start_viewers(double clock_from_s);
  Status start_wall();
  /// Puts the link of a place, if it has one, before a process that is not started yet, or before several: starts its
  /// relay the first time.
  Status put_link(links::Place place, const std::string& name, Member& before);
  void read(Member& member);
  /// Names of the viewers that run, without `member`.
  std::vector<std::string> viewing_beside(const Member& member);
  /// Returns how it ended, and the last line that it logged.
  std::string last_words(const Member& member);
  /// Gives up a process that ended; the session goes on without it.
  void give_up(Member& member, std::vector<std::string>& news);
  void read_progress(const std::string& member, const std::string& told);
  /// Handles the end of a process.
  State ended(Member& member, std::vector<std::string>& news);
  /// Starts a process that died, once its waiting time is over.
  State start_again(Member& member, std::vector<std::string>& news);

  RunOptions options_;
  ProcessGroup group_;
  std::string progress_;
  std::map<std::string, tools::TimeLeft> time_left_;  // by member
  std::vector<std::string> notes_, wishes_, record_failures_;
  std::string told_progress_;                  // the last progress that viewers were sent
  std::map<std::string, std::string> relays_;  // relay -> its address
  bool has_viewers_ = false, viewer_died_ = false;
  bool chosen_ = false;  // a person chose the data set in a window: if it cannot be read, the session goes on
  std::unique_ptr<ControlClient> control_;  // used while a wall's viewers wait
  double asked_s_ = -1e9;
  std::optional<data::DataServiceOptions> before_;  // shown again if the chosen data set cannot be
  bool goes_back_ = false;                          // to before_, with the next supervise()
  int last_sampler_ = 0;                            // its number
};

}  // namespace telesplat::launcher
