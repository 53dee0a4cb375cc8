// Orders of people that another process carries out: a viewer or a data server. The master passes them on, and their
// answers back. No sockets, no clocks.
#pragma once

#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::master {

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

}  // namespace telesplat::master
