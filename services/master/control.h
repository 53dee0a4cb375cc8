// Commands of `telesplat ctl`: their arguments, read and checked, and their outcome.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::master {

/// Outcome of a command to a scene.
struct Obeyed {
  bool begins_epoch = false;
  std::string answer;      ///< for the person; unused if an epoch begins: its number is the answer
  bool tells_all = false;  ///< every process gets a new welcome, though no epoch begins
};

/// `telesplat ctl play`: plays, pauses or steps an animation or a series.
struct PlayOrder {
  enum class How { kPlay, kPause, kStep } how = How::kPlay;
  int steps = 1;  ///< for kStep: forwards, or backwards if negative
};
/// Arguments "how" (play, pause or step) and "steps" (-4096 to 4096, not 0). Error: what is wrong with them.
Result<PlayOrder> read_play(const wire::Control& command);

/// `telesplat ctl coupling`: settings that viewers get in their welcome.
struct CouplingOrder {
  wire::CouplingOrder mode = wire::CouplingOrder::kAsync;
  uint64_t buffers = wire::SessionSettings{}.buffers;
  std::string viewer;  ///< name of the viewer that gets them; empty: all viewers that are here
  std::string text;    ///< for people: "loose, 3 buffers"
};
/// Arguments "coupling" (async, sync or loose), "buffers" (loose only) and "viewer". Error: what is wrong with them.
Result<CouplingOrder> read_coupling(const wire::Control& command);

/// Reads a new value for the parameter `name`. Error: the text is not a finite number; names the parameter.
Result<double> read_number(const std::string& name, const std::string& text);

}  // namespace telesplat::master
