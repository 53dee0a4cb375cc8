#include "tools/pose_replay/options.h"

namespace telesplat::pose_replay {

options::Table table(Options& o) {
  using options::Range;
  return {{.flag = "file",
           .value = &o.file,
           .help = "recorded head movement: a CSV file with the columns t_s, px, py, pz, qw, qx, qy, qz",
           .required = true},
          {.flag = "--bind",
           .value = &o.bind,
           .help = "where viewers hear it (--poses): tcp://ADDRESS:PORT, port *: a free one, or ipc://PATH"},
          {.flag = "--jitter",
           .value = &o.jitter_ms,
           .help = "milliseconds: each pose is late by a random time up to this; their order stays",
           .limits = Range{0, 10'000}},
          {.flag = "--loss",
           .value = &o.loss,
           .help = "share of the poses that is never sent, 0 to 1",
           .limits = Range{0, 1}},
          {.flag = "--seed", .value = &o.seed, .help = "of jitter and loss: the same seed, the same poses"},
          {.flag = "--loop", .value = &o.loop, .help = "begin again at the end, until stopped"},
          {.flag = "--wait", .value = &o.wait, .help = "begin when somebody listens"},
          {.flag = "--no-times", .value = &o.no_times, .help = "send poses without their times"},
          {.flag = "--insecure", .value = &o.insecure, .help = "bind to addresses other than loopback"},
          {.flag = "--name", .value = &o.name, .help = "name in logs"},
          {.flag = "--log-level",
           .value = &o.log_level,
           .help = "trace, debug, info, warn, error or off",
           .limits = options::Names{"trace", "debug", "info", "warn", "error", "off"}}};
}

}  // namespace telesplat::pose_replay
