// What people order and ask: errands of other processes, health, clips. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/scene/clip_order.h"
#include "common/wire/messages.h"
#include "services/master/control.h"

namespace telesplat::master {

// Orders of people that another process carries out: a viewer or a data server. The master passes them on, and their
// answers back. No sockets, no clocks.

class Errands {
 public:
  static constexpr double kPatience_s = 3;  ///< for an answer
  static constexpr size_t kMost = 256;      ///< under way; more are refused
  static constexpr size_t kMostOfOne = 16;  ///< of these, one person's: a quarter of what a viewer keeps waiting

  struct Asker {
    std::string peer;    ///< who asked
    std::string person;  ///< the name of the key; where there are no keys the connection
  };
  struct Reply {
    std::string peer;  ///< who asked
    wire::ControlReply reply;
  };

  /// An order that these processes (routing ids) have been sent, under this number; the first answer that is good
  /// counts, and if none is the last one. Error: too many are under way, of all or of this person.
  Result<uint64_t> begin(const Asker& asker, std::set<std::string> asked, double now_s);
  /// Likewise an order to the launcher, which is no process of the session: it finds the order among wishes(), and
  /// answers as kLauncher. Only sessions that a launcher started have one.
  Result<uint64_t> ask_launcher(const Asker& asker, const wire::Control& order, const std::string& started_by,
                                double now_s);
  static constexpr const char* kLauncher = "launcher";
  /// Orders to the launcher that have no answer yet, by their numbers.
  std::map<uint64_t, wire::Control> wishes() const;
  /// from: who answers. Of each that was asked one answer counts. Nothing: others may still answer, nobody waits for it
  /// any more, or this one was not asked.
  std::optional<Reply> answered(const std::string& from, const wire::OrderAnswer& answer);
  /// It is gone and will answer nothing: those for which it was the last to be asked.
  std::vector<Reply> lost(const std::string& asked);
  /// Those that nobody answered in time.
  std::vector<Reply> overdue(double now_s);

 private:
  struct Errand {
    Asker asker;
    std::set<std::string> open;  // who has not answered yet
    std::string refusal;         // what the last one said that could not; empty: none did yet
    double until_s = 0;
    std::optional<wire::Control> wish;  // for the launcher
  };
  uint64_t last_ = 0;
  std::map<uint64_t, Errand> errands_;
};

/// Who carries out an order of `telesplat ctl`: "viewer", "data" or Errands::kLauncher; empty: the master does.
std::string errand_for(const std::string& command);

/// "done", by which the launcher answers: arguments "number", "ok" (true or false) and "text". Error: it is no answer.
Result<wire::OrderAnswer> read_done(const wire::Control& command);

// What a health check asks (`health`, of telesplat-health): whether one process takes part in the session. The answer
// is a line, however many processes came and left.

/// Processes report every second: who said nothing for so long hangs.
inline constexpr double kHealthySilence_s = 3.0;

class HealthQuestion {
 public:
  /// Arguments role, name and host (fact "host" of the hello) tell whom it is about; one that is not there fits every
  /// process. None at all: no process in particular, that the master answers is enough. Others are ignored.
  explicit HealthQuestion(const wire::Control& question);

  /// To be called for every process that the master remembers. silent_s: since it was heard, s.
  void look_at(const wire::Hello& process, bool gone, double silent_s);

  /// What was found. The error says who was looked for, and what is wrong with the last of those who fit.
  Result<std::string> answer() const;

 private:
  std::string role_, name_, host_;
  std::string wrong_ = "none takes part in the session";
  bool well_ = false;
};

// What is cut away of the session's scene: what people ordered, and the planes in the room that this comes to. No
// clocks.

class Clipping {
 public:
  /// order: from the beginning, as scene::parse_clip() takes it; empty: nothing is cut away.
  explicit Clipping(std::string order) : order_(std::move(order)) {}

  /// A data server said hello. An order that was given for another data set is dropped. True: something else is cut
  /// away than before. problem: why the order cannot be followed; then nothing is cut away.
  bool adopt(const wire::Hello& data, std::string& problem);
  /// "clip", argument "clip". Begins an epoch. Error: what is wrong with it; then nothing changed.
  Result<Obeyed> obey(const wire::Control& command);
  /// Fills in what everyone is told: the planes, and for people the order.
  void describe(wire::Welcome& welcome) const;
  /// The planes, for the run's record; empty: nothing is cut away.
  std::string text() const { return geometry::to_text(clip_); }
  const std::string& order() const { return order_; }

 private:
  std::string order_;
  bool known_ = false;          // a data server was here
  std::string placement_text_;  // that it told
  scene::Placement placement_;
  geometry::Clip clip_;
};

}  // namespace telesplat::master
