// Orders and questions of people: errands of other processes, health, clips. No sockets, no clocks.
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
  static constexpr double kPatience_s = 3;  ///< time for an answer
  static constexpr size_t kMost = 256;      ///< orders under way; more are refused
  static constexpr size_t kMostOfOne = 16;  ///< orders of one person: a quarter of what a viewer keeps waiting

  struct Asker {
    std::string peer;    ///< routing id of the process that asked
    std::string person;  ///< name of the key; without keys, the connection
  };
  struct Reply {
    std::string peer;  ///< routing id of the process that asked
    wire::ControlReply reply;
  };

  /// Begins an order to these processes (routing ids) and returns its number. The first good answer counts, else the
  /// last answer. Error: too many orders are under way, in all or of this person.
  Result<uint64_t> begin(const Asker& asker, std::set<std::string> asked, double now_s);
  /// Likewise for the launcher, which is not a process of the session: it finds the order in wishes(), and answers as
  /// kLauncher. Error also: the session was started by hand and has no launcher.
  Result<uint64_t> ask_launcher(const Asker& asker, const wire::Control& order, const std::string& started_by,
                                double now_s);
  static constexpr const char* kLauncher = "launcher";
  /// Orders to the launcher that have no answer yet, by their numbers.
  std::map<uint64_t, wire::Control> wishes() const;
  /// Takes an answer of the process `from`; only its first one counts. nullopt: others may still answer, the order is
  /// over, or `from` was not asked.
  std::optional<Reply> answered(const std::string& from, const wire::OrderAnswer& answer);
  /// Process `asked` is gone. Returns the replies of orders for which only its answer was missing.
  std::vector<Reply> lost(const std::string& asked);
  /// Returns replies to orders that had no answer within kPatience_s.
  std::vector<Reply> overdue(double now_s);

 private:
  struct Errand {
    Asker asker;
    std::set<std::string> open;  // processes that have not answered yet
    std::string refusal;         // text of the newest refusal; empty: no refusal yet
    double until_s = 0;
    std::optional<wire::Control> wish;  // order for the launcher; nullopt: for others
  };
  uint64_t last_ = 0;
  std::map<uint64_t, Errand> errands_;
};

/// Returns the role that carries out an order of `telesplat ctl`: "viewer", "data" or Errands::kLauncher; empty: the
/// master does.
std::string errand_for(const std::string& command);

/// Reads the launcher's answer, "done": arguments "number", "ok" (true or false), "text". Error: "number" is no number.
Result<wire::OrderAnswer> read_done(const wire::Control& command);

// Health check (`health`, sent by telesplat-health): does a process take part in the session? The answer is one line,
// however many processes came and left.

/// Processes report every second: one that is silent for this time hangs.
inline constexpr double kHealthySilence_s = 3.0;

class HealthQuestion {
 public:
  /// Arguments role, name and host (fact "host" of the hello) select processes; a missing one selects all. Without all
  /// three, it is enough that the master answers. Other arguments are ignored.
  explicit HealthQuestion(const wire::Control& question);

  /// To be called for every process that the master remembers. silent_s: time since its last message.
  void look_at(const wire::Hello& process, bool gone, double silent_s);

  /// Returns "well". Error: names the process that was looked for, and what is wrong with the last one that fits.
  Result<std::string> answer() const;

 private:
  std::string role_, name_, host_;
  std::string wrong_ = "none takes part in the session";
  bool well_ = false;
};

// Keeps what is cut away of the session's scene: the order that people gave, and its planes in the room. No clocks.

class Clipping {
 public:
  /// order: the first one, as scene::parse_clip() takes it; empty: nothing is cut away.
  explicit Clipping(std::string order) : order_(std::move(order)) {}

  /// A data server said hello. Drops an order that was given for another data set. True: the planes changed. problem:
  /// the reason why the order cannot be followed; then nothing is cut away.
  bool adopt(const wire::Hello& data, std::string& problem);
  /// Carries out "clip", argument "clip". Begins an epoch. Error: what is wrong with it; then nothing changed.
  Result<Obeyed> obey(const wire::Control& command);
  /// Adds the planes, and for people the order, to a welcome.
  void describe(wire::Welcome& welcome) const;
  /// The planes, for the run's record; empty: nothing is cut away.
  std::string text() const { return geometry::to_text(clip_); }
  const std::string& order() const { return order_; }

 private:
  std::string order_;
  bool known_ = false;          // a data server was here
  std::string placement_text_;  // as the data server sent it
  scene::Placement placement_;
  geometry::Clip clip_;
};

}  // namespace telesplat::master
