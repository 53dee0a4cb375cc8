// Orders of `telesplat ctl` to a session: one row an order.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"

namespace telesplat::launcher {

/// A sub-command of `telesplat ctl` whose answer is one line.
struct Order {
  using Arguments = std::map<std::string, std::string>;  ///< those of wire::Control

  std::string name;   ///< name of the sub-command and of the command on the wire
  std::string help;   ///< one line for --help
  std::string words;  ///< help of the words that follow; empty: it takes no words
  /// Turns words that a person typed into arguments; may ask the master. Error: says what is wrong with the words.
  Result<Arguments> (*read)(const std::vector<std::string>& words, ControlClient& client) = nullptr;
  std::string shown;  ///< without words the order prints this field of the status, or "off"; empty: it needs words
};

const std::vector<Order>& orders();

/// Time limit for a master's answer.
inline constexpr double kPatience_s = 5;

/// Lists the sessions of this user on this machine.
Command list_command();
/// Sets how displays and server wait for each other, while a session runs.
Command coupling_command();
/// pick, measure, bookmark, notes: commands for places that people point at, and for their notes about them.
std::vector<Command> hands_commands();
/// Makes a command for each order of scene::settings() that a viewer or the launcher keeps, and `settings`, which lists
/// all that can be changed.
std::vector<Command> setting_commands();

}  // namespace telesplat::launcher
