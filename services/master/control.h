// What commands of `telesplat ctl` come to.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::master {

/// What a scene did with a command.
struct Obeyed {
  bool begins_epoch = false;
  std::string answer;      ///< for the person; unused where an epoch begins: its number is the answer
  bool tells_all = false;  ///< the session is told to everyone anew, though no epoch begins
};

/// `telesplat ctl play`: what becomes of an animation or a series that is playing or could.
struct PlayOrder {
  enum class How { kPlay, kPause, kStep } how = How::kPlay;
  int steps = 1;  ///< of kStep: forwards, or if negative backwards
};
/// Arguments "how" (play, pause or step) and "steps" (-4096 to 4096, not 0). Error: what is wrong with them.
Result<PlayOrder> read_play(const wire::Control& command);

/// `telesplat ctl coupling`, as viewers are told it: settings of the welcome.
struct CouplingOrder {
  wire::CouplingOrder mode = wire::CouplingOrder::kAsync;
  uint64_t buffers = wire::SessionSettings{}.buffers;
  std::string viewer;  ///< whose; empty: everyone's who is here
  std::string text;    ///< for people: "loose, 3 buffers"
};
/// Arguments "coupling" (async, sync or loose), "buffers" (of loose) and "viewer". Error: what is wrong with them.
Result<CouplingOrder> read_coupling(const wire::Control& command);

/// Reads the value that someone wants a parameter to have. Error: no finite number; names it.
Result<double> read_number(const std::string& name, const std::string& text);

}  // namespace telesplat::master
