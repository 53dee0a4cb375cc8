// What commands of `telesplat ctl` come to.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::master {

/// What a scene did with a command.
struct Obeyed {
  bool begins_epoch = false;
  std::string answer;      ///< for the person; unused where an epoch begins: its number is the answer
  bool tells_all = false;  ///< the session is told to everyone anew, though no epoch begins
};

/// Reads the value that someone wants a parameter to have. Error: no finite number; names it.
Result<double> read_number(const std::string& name, const std::string& text);

}  // namespace telesplat::master
