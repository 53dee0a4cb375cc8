// Programs carried out by a copy of this process: no other program is started, and what they say, their exit codes and
// what they leave on disk are those that a shell has.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "tests/support/files/made_data.h"

namespace telesplat::test {

struct Said {
  int code = 0;  ///< exit code, or 128 + signal; it is killed by SIGALRM after a minute
  std::string out, err;
};

/// Runs `program`, which is a main(). Returns its exit code and its output.
Said said_by(const std::function<int()>& program);

/// `telesplat` with these arguments. Sessions of the person at this machine are not found.
Said telesplat(const std::vector<std::string>& arguments);

}  // namespace telesplat::test
