// What a health check asks (`health`, of telesplat-health): whether one process takes part in the session. The answer
// is a line, however many processes came and left.
#pragma once

#include <string>

#include "common/core/result.h"
#include "common/wire/messages.h"

namespace telesplat::master {

/// Processes report every second: who said nothing for so long hangs.
inline constexpr double kHealthySilence_s = 3.0;

class HealthQuestion {
 public:
  /// Arguments role, name and host (fact "host" of the hello) tell whom it is about; one that is not there fits every
  /// process. None at all: no process in particular, that the master answers is enough. Others are ignored.
  explicit HealthQuestion(const wire::Control& question);

  /// To be called for every process that the master remembers. silent_s: since it was heard, s.
  void look_at(const wire::Hello& process, bool gone, double silent_s);

  /// What was found. The error says who was looked for, and what is wrong with the last of those who fit.
  Result<std::string> answer() const;

 private:
  std::string role_, name_, host_;
  std::string wrong_ = "none takes part in the session";
  bool well_ = false;
};

}  // namespace telesplat::master
