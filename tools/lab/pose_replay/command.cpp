// `telesplat-lab pose-replay`: publishes a recorded head movement as a tracker would, at its true rate.
#include <chrono>
#include <cstdio>
#include <thread>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/geometry/trajectory.h"
#include "common/net/plain/plain_socket.h"
#include "common/net/service.h"
#include "common/options/complain.h"
#include "common/wire/head_pose.h"
#include "tools/common/progress_line.h"
#include "tools/lab/commands.h"
#include "tools/lab/pose_replay/schedule.h"

namespace telesplat::lab {
namespace {

constexpr double kMostSleep_s = 0.05;  // short enough to see a signal soon

struct ReplayOptions {
  std::string file;
  std::string bind = "tcp://127.0.0.1:7790";
  double jitter_ms = 0;  ///< each pose is late by 0 to this, evenly distributed
  double loss = 0;       ///< share of the poses that is never sent
  uint64_t seed = 1;     ///< for both jitter and loss
  bool loop = false;
  bool wait = false;      ///< until a subscriber is there
  bool no_times = false;  ///< sends poses without a time: the viewer takes the time of arrival
  bool insecure = false;
};

options::Table table(ReplayOptions& o) {
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
          {.flag = "--insecure", .value = &o.insecure, .help = "bind to addresses other than loopback"}};
}

void sleep_s(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

// False: a signal asked to stop.
bool sleep_until(double t_s) {
  for (double left_s = t_s - monotonic_s(); left_s > 0 && !net::stop_requested(); left_s = t_s - monotonic_s())
    sleep_s(std::min(left_s, kMostSleep_s));
  return !net::stop_requested();
}

void wait_for_listener(net::PlainPublisher& publisher) {
  while (!publisher.heard() && !net::stop_requested()) sleep_s(0.01);
}

int replay(ReplayOptions o, const options::Given&) {
  log::initialise("pose-replay", "info");
  auto samples = geometry::read_samples(o.file);
  if (!samples) return complain(samples.error());
  auto publisher = net::PlainPublisher::bind(o.bind, o.insecure);
  if (!publisher) return complain({"--bind: " + publisher.error().text});
  net::install_signal_handlers();
  std::printf("poses at %s\n", (*publisher)->endpoint().c_str());
  std::fflush(stdout);
  if (o.wait) wait_for_listener(**publisher);

  Schedule schedule(std::move(*samples), o.loop, {o.jitter_ms * 1e-3, o.loss, o.seed});
  tools::ProgressLine progress(2);
  const double begin_s = monotonic_s();
  uint64_t sent = 0;
  for (auto due = schedule.next(); due && sleep_until(begin_s + due->send_s); due = schedule.next(), ++sent) {
    const std::optional<double> t_s = o.no_times ? std::nullopt : std::optional(due->t_s);
    (*publisher)->send(wire::encode_head_pose({t_s, due->pose}));
    (*publisher)->heard();
    if (schedule.length_s() > 0) progress.show("replaying", due->t_s / schedule.length_s());
  }
  progress.close();
  log::info("{} poses sent, {} lost on purpose, in {:.1f} s", sent, schedule.lost(), monotonic_s() - begin_s);
  return 0;
}

}  // namespace

launcher::Command pose_replay_command() {
  return launcher::make_command("pose-replay",
                                "publish a recorded head movement as a tracker would, at its true rate; viewers follow "
                                "it with --poses",
                                table, replay);
}

}  // namespace telesplat::lab
