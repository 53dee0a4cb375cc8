// Sends questions and orders to the master over its control socket.
#pragma once

#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/net/socket.h"
#include "common/options/table.h"

namespace telesplat::launcher {

/// An answer does not name its question: while an answer is still due, the next question closes the connection and
/// opens another one.
class ControlClient {
 public:
  /// Connects when the first question is asked.
  explicit ControlClient(const std::string& master_endpoint, const net::Access& access = {});
  ~ControlClient();

  /// Sends a command and waits for its answer. Error: the master refused, or there is no answer.
  Result<std::string> ask(const std::string& command, double timeout_s,
                          const std::map<std::string, std::string>& arguments = {});
  /// Returns the master's answer to "status". Error: as ask(), or the answer is no JSON object.
  Result<nlohmann::ordered_json> status(double timeout_s);
  /// Does the same as ask(), but a refusal is an answer.
  Result<wire::ControlReply> order(const std::string& command, double timeout_s,
                                   const std::map<std::string, std::string>& arguments = {});
  /// True if the last question had no answer: its error is not about the question's content.
  bool unanswered() const { return unanswered_; }
  /// Sends "status" without waiting; poll_status() gives the answer once it is there, unless ask() or order() comes
  /// before.
  void request_status() { tell("status", {}); }
  /// Sends a command without waiting for the answer.
  void tell(const std::string& command, const std::map<std::string, std::string>& arguments);
  /// True if, since the last answer, no process accepts connections at the master's address.
  bool nobody_there() const;
  /// Returns the master's reason for refusing this person, as a sentence; empty: it did not refuse.
  std::string refusal() const;
  std::optional<nlohmann::json> poll_status();

 private:
  struct Line;  // to the master
  Line& line();

  std::string endpoint_;
  net::Access access_;
  std::unique_ptr<Line> line_;
  bool unanswered_ = false, nobody_there_ = false;
};

/// An order of a person to the launcher (scene::Keeper::kLauncher), as it stands in the master's status.
struct Wish {
  uint64_t number = 0;  ///< the master's
  uint64_t master = 0;  ///< its process id: a new master counts from 1 again
  std::string order, value;
};

/// Returns the orders that have no answer yet. Malformed ones are left out.
std::vector<Wish> wishes_of(const nlohmann::json& status);

/// Flags that name the session of a `telesplat ctl` command.
struct SessionChoice {
  std::string master;   ///< --master, or TELESPLAT_MASTER in the environment; empty: the one on this machine
  std::string session;  ///< --session: as net::find_master() takes it
  std::string keys;     ///< --keys: folder; empty: the one in the session's file, if it runs here
};

options::Table session_rows(SessionChoice& choice);

/// Connects to the session's master. Null: its address or keys are unknown; stderr has the reason, `exit_code` is set.
std::unique_ptr<ControlClient> reach(const SessionChoice& choice, const options::Given& given, int& exit_code,
                                     const std::vector<net::Role>& roles = net::asking_roles());

/// Prints the master's answer to an order; done: replaces an empty answer. Exit code: 1: there is no answer, 2: the
/// master refused, so the order was wrong.
int tell_answer(const Result<wire::ControlReply>& reply, const std::string& done = {});

}  // namespace telesplat::launcher
