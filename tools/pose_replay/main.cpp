// telesplat-pose-replay: publishes a recorded head movement as a tracker would, at its true rate.
#include <chrono>
#include <cstdio>
#include <thread>

#include "common/core/clock.h"
#include "common/core/log.h"
#include "common/core/version.h"
#include "common/geometry/trajectory_file.h"
#include "common/net/plain/plain_socket.h"
#include "common/net/service.h"
#include "common/options/parser.h"
#include "common/wire/head_pose.h"
#include "tools/common/complain.h"
#include "tools/common/progress_line.h"
#include "tools/pose_replay/options.h"
#include "tools/pose_replay/schedule.h"

using namespace telesplat;

namespace {

constexpr const char* kProgram = "telesplat-pose-replay";
constexpr double kMostSleep_s = 0.05;  // so that a signal is seen

void sleep_s(double s) { std::this_thread::sleep_for(std::chrono::duration<double>(s)); }

// False: told to stop.
bool sleep_until(double t_s) {
  for (double left_s = t_s - monotonic_s(); left_s > 0 && !net::stop_requested(); left_s = t_s - monotonic_s())
    sleep_s(std::min(left_s, kMostSleep_s));
  return !net::stop_requested();
}

void wait_for_listener(net::PlainPublisher& publisher) {
  while (!publisher.heard() && !net::stop_requested()) sleep_s(0.01);
}

int replay(const pose_replay::Options& o) {
  log::initialise(o.name, o.log_level);
  auto samples = geometry::read_samples(o.file);
  if (!samples) return tools::complain(samples.error(), 2, kProgram);
  auto publisher = net::PlainPublisher::bind(o.bind, o.insecure);
  if (!publisher) return tools::complain({"--bind: " + publisher.error().text}, 2, kProgram);
  net::install_signal_handlers();
  std::printf("poses at %s\n", (*publisher)->endpoint().c_str());
  std::fflush(stdout);
  if (o.wait) wait_for_listener(**publisher);

  pose_replay::Schedule schedule(std::move(*samples), o.loop, {o.jitter_ms * 1e-3, o.loss, o.seed});
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

int main(int argc, char** argv) {
  return net::guarded_main([&] {
    pose_replay::Options o;
    options::Parser parser(
        "telesplat-pose-replay: publishes a recorded head movement as a tracker would, at its true rate; viewers "
        "follow it with --poses");
    parser.add(pose_replay::table(o));
    parser.version(version());
    parser.parse_or_exit(kProgram, {argv + 1, argv + argc});
    return replay(o);
  });
}
