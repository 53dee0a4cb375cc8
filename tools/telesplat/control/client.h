// Asks the master things over its control socket.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>

#include "common/net/socket.h"

namespace telesplat::launcher {

class ControlClient {
 public:
  /// Connects when the first question is asked.
  explicit ControlClient(const std::string& master_endpoint, const net::Access& access = {});

  /// Sends a command and waits for its answer. Error: the master refused, or there is no answer.
  Result<std::string> ask(const std::string& command, double timeout_s,
                          const std::map<std::string, std::string>& arguments = {});
  /// The same, but a refusal is an answer.
  Result<wire::ControlReply> order(const std::string& command, double timeout_s,
                                   const std::map<std::string, std::string>& arguments = {});
  /// Whether the last question had no answer, so that an error is not of what was asked.
  bool unanswered() const { return unanswered_; }
  /// Sends "status" without waiting; poll_status() gives the answer once it is there.
  void request_status();
  /// Nobody takes connections at the master's address any more, since the last answer.
  bool nobody_there() const { return socket_.failed_connections() > failed_before_; }
  std::optional<nlohmann::json> poll_status();

 private:
  void connect();

  std::string endpoint_;
  net::Context context_;
  net::Socket socket_;
  bool connected_ = false, unanswered_ = false;
  uint64_t failed_before_ = 0;  // attempts to connect, by the last answer
};

}  // namespace telesplat::launcher
