// Asks the master things over its control socket.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "common/net/socket.h"

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
  /// The same, but a refusal is an answer.
  Result<wire::ControlReply> order(const std::string& command, double timeout_s,
                                   const std::map<std::string, std::string>& arguments = {});
  /// Whether the last question had no answer, so that an error is not of what was asked.
  bool unanswered() const { return unanswered_; }
  /// Sends "status" without waiting; poll_status() gives the answer once it is there, unless ask() or order() comes
  /// before.
  void request_status();
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

}  // namespace telesplat::launcher
