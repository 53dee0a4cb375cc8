// The processes of one session on this machine: started in any order, supervised, ended together.
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
  int restarts = 0;            ///< how often it was started again in the last minute (Restarts::lately)
  bool chosen = false;         ///< it serves a data set that a person chose at a window
  bool record_failed = false;  ///< it said that it could not write all of the record, and nothing else was wrong
  bool others = false;         ///< a viewer: others that the launcher started are there
};
enum class Consequence {
  kNone,
  kRestart,
  kGiveUp,  ///< the session goes on without it, and its windows tell why
  kFinish,  ///< the session's end, in order
  kFail,    ///< the same, as an error
  kRefuse,  ///< the same: what it was given cannot be used
};
/// What follows from its end.
Consequence consequence_of(const Ended& ended);

class Pipeline {
 public:
  /// Starts master, data servers, packer, samplers and viewers (the viewers alone if options.join_master is set). Those
  /// of a wall follow in supervise(), once the data servers have read their data.
  static Result<Pipeline> start(const RunOptions& options);

  const std::string& master_endpoint() const { return group_.endpoint(); }
  /// By which its master is asked.
  const net::Access& access() const { return group_.access(); }
  /// The process of its first viewer; 0: it does not run.
  pid_t display();
  /// Names of the viewers that were started.
  std::vector<std::string> viewers();

  enum class State { kRunning, kFinished, kFailed, kBadInput };
  /// Looks after the children; does not wait. Servers that die are started again, the master at its old address, unless
  /// they die too often (Restarts). The death of the last viewer that is left ends the run, which is finished when all
  /// viewers are. A data set that was chosen at a window and cannot be served does not end it. `news` gets lines for
  /// the person.
  State supervise(std::vector<std::string>& news);
  /// "reading a.ply 43 %, 12 s left" and the like, from the children's progress lines; empty: nothing to tell.
  const std::string& progress() const { return progress_; }
  /// Lines that viewers told the person, since the last call.
  std::vector<std::string> take_notes() { return std::exchange(notes_, {}); }
  /// Data sets that people at windows want to see, since the last call.
  std::vector<std::string> take_wishes() { return std::exchange(wishes_, {}); }
  /// Says something to the viewers that it started with a window (viewer::LauncherLines).
  void tell_viewers(const std::string& line);
  /// The session goes on with the data set of these options: other data servers take the place of those that are there.
  /// goes_back: where they cannot be served, those that were there before are again.
  Status open(const RunOptions& options, bool goes_back = false);
  /// What the data set is read with that is shown.
  const data::DataServiceOptions& data() const { return options_.data; }
  /// From now on so many samplers run here: others are started, or the newest ones told to finish.
  Status set_samplers(int count);
  /// Ends everything: viewers first, then a "stop" to the master, then whoever is left.
  void finish();
  /// After that: what could not be written of the record, a line a process; empty: it is whole.
  const std::vector<std::string>& record_failures() const { return record_failures_; }
  /// A viewer has died, and the session went on for the others.
  bool viewer_died() const { return viewer_died_; }

 private:
  Pipeline(const RunOptions& options, ProcessGroup group);
  Status start_servers();
  Status start_data();
  Status start_sampler(int number);
  Status start_viewers(double clock_from_s);
  Status start_wall();
  /// Puts the link of a place, if there is one, before a process that is not started yet, or before several: starts its
  /// relay the first time.
  Status put_link(links::Place place, const std::string& name, Member& before);
  void read(Member& member);
  /// Names of the viewers that run, this one left out.
  std::vector<std::string> viewing_beside(const Member& member);
  /// How it ended, and the last line that it logged.
  std::string last_words(const Member& member);
  /// It has ended, and the session goes on without it.
  void give_up(Member& member, std::vector<std::string>& news);
  void read_progress(const std::string& member, const std::string& told);
  /// What the end of a process means for the run.
  State ended(Member& member, std::vector<std::string>& news);
  /// It has died, and its time has come.
  State start_again(Member& member, std::vector<std::string>& news);

  RunOptions options_;
  ProcessGroup group_;
  std::string progress_;
  std::map<std::string, tools::TimeLeft> time_left_;  // by member
  std::vector<std::string> notes_, wishes_, record_failures_;
  std::string told_progress_;                  // the viewers
  std::map<std::string, std::string> relays_;  // where they listen, by name
  bool has_viewers_ = false, viewer_died_ = false;
  bool chosen_ = false;  // the data set, by a person at a window: one that cannot be read does not end the session
  std::unique_ptr<ControlClient> control_;  // while a wall's viewers wait
  double asked_s_ = -1e9;
  std::optional<data::DataServiceOptions> before_;  // shown again if what was chosen cannot be
  bool goes_back_ = false;                          // to that, with the next supervise()
  int last_sampler_ = 0;                            // number
};

}  // namespace telesplat::launcher
