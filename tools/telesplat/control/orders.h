// What `telesplat ctl` can order of a session: one row an order.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {

/// A sub-command of `telesplat ctl` whose answer is one line.
struct Order {
  using Arguments = std::map<std::string, std::string>;  ///< as wire::Control has them

  std::string name;   ///< of the sub-command and of the command on the wire
  std::string help;   ///< what it does
  std::string words;  ///< help of the words that follow; empty: none may
  /// What the words come to. Error: what is wrong with them; a person typed them. It may ask the master.
  Result<Arguments> (*read)(const std::vector<std::string>& words, ControlClient& client) = nullptr;
  std::string shown;  ///< without words it prints this of the session's status, or "off"; empty: it does not
};

const std::vector<Order>& orders();

/// How long a master may take to answer.
inline constexpr double kPatience_s = 5;

/// The sessions of this user on this machine.
Command list_command();
/// How displays and server wait for each other, while a session runs.
Command coupling_command();
/// pick, measure, bookmark, notes: what people point at, and what they keep about it.
std::vector<Command> hands_commands();
/// One for each order of scene::settings() that a viewer or the launcher keeps, and `settings`, which lists all that
/// can be changed.
std::vector<Command> setting_commands();

}  // namespace telesplat::launcher
