// Asks the master things over its control socket.
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

/// An answer does not say what it answers: where one may still come, the connection is given up, and the next question
/// goes over another one.
class ControlClient {
 public:
  /// Connects when the first question is asked.
  explicit ControlClient(const std::string& master_endpoint, const net::Access& access = {});
  ~ControlClient();

  /// Sends a command and waits for its answer. Error: the master refused, or there is no answer.
  Result<std::string> ask(const std::string& command, double timeout_s,
                          const std::map<std::string, std::string>& arguments = {});
  /// What the master answers to "status". Error: as ask(), or that is none.
  Result<nlohmann::ordered_json> status(double timeout_s);
  /// As ask(), but a refusal is an answer.
  Result<wire::ControlReply> order(const std::string& command, double timeout_s,
                                   const std::map<std::string, std::string>& arguments = {});
  /// Whether the last question had no answer, so that an error is not of what was asked.
  bool unanswered() const { return unanswered_; }
  /// Sends "status" without waiting; poll_status() gives the answer once it is there, unless ask() or order() comes
  /// before.
  void request_status() { tell("status", {}); }
  /// Says something whose answer nobody waits for.
  void tell(const std::string& command, const std::map<std::string, std::string>& arguments);
  /// Nobody takes connections at the master's address any more, since the last answer.
  bool nobody_there() const;
  /// Why the master does not take this person in, as a sentence; empty: it did not refuse.
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

/// An order of a person to the launcher (scene::Keeper::kLauncher), as the master's status tells it.
struct Wish {
  uint64_t number = 0;  ///< the master's
  uint64_t master = 0;  ///< process id: another one counts from 1 again
  std::string order, value;
};

/// Those without an answer yet. What is strange is left out.
std::vector<Wish> wishes_of(const nlohmann::json& status);

/// Which session a command of `telesplat ctl` means.
struct SessionChoice {
  std::string master;   ///< --master, or TELESPLAT_MASTER in the environment; empty: the one that runs here
  std::string session;  ///< --session: as net::find_master() takes it
  std::string keys;     ///< --keys: folder; empty: those that the session's file names, if it runs here
};

options::Table session_rows(SessionChoice& choice);

/// A connection to the session's master. Null: it is not known; why was said on stderr, and `exit_code` is set.
std::unique_ptr<ControlClient> reach(const SessionChoice& choice, const options::Given& given, int& exit_code,
                                     const std::vector<net::Role>& roles = net::asking_roles());

/// Prints what the master answered to an order; done: in place of an answer that says nothing. Exit code: 1: there is
/// no answer, 2: it refused, so it was asked for something wrong.
int tell_answer(const Result<wire::ControlReply>& reply, const std::string& done = {});

}  // namespace telesplat::launcher
