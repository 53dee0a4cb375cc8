// What the panel orders of a session's master: the commands of `telesplat ctl`.
#pragma once

#include <map>
#include <string>

namespace telesplat::viewer {

struct Order {
  std::string command;  ///< wire::Control
  std::map<std::string, std::string> arguments;
  /// Of orders that wait, a later one of the same subject takes the place of an earlier one: a slider that is dragged
  /// orders often. Empty: none is replaced.
  std::string subject;
  bool operator==(const Order&) const = default;
};

struct OrderAnswer {
  Order order;
  bool obeyed = false;
  std::string text;  ///< what the master said, or why it said nothing; a line for the person
};

}  // namespace telesplat::viewer
