// What a command tells while it works, on stderr.
#pragma once

#include <unistd.h>

#include <cstdio>
#include <string>

#include "common/core/clock.h"

namespace telesplat::launcher {

/// One line that is rewritten on a terminal, or a line every few seconds in a log.
class ProgressLine {
 public:
  ~ProgressLine() { close(); }
  void show(const std::string& text) {
    if (terminal_) {
      std::fprintf(stderr, "\r\033[K%s", text.c_str());
      std::fflush(stderr);
      open_ = true;
    } else if (monotonic_s() - last_s_ >= 2.0) {
      std::fprintf(stderr, "%s\n", text.c_str());
      last_s_ = monotonic_s();
    }
  }
  void line(const std::string& text) {
    close();
    std::fprintf(stderr, "%s\n", text.c_str());
  }
  void close() {
    if (open_) std::fprintf(stderr, "\n");
    open_ = false;
  }

 private:
  bool terminal_ = isatty(2), open_ = false;
  double last_s_ = monotonic_s();
};

}  // namespace telesplat::launcher
