// A viewer - worker, caches, display loop, renderers - in a session under the test's control: volumes and points, with
// every coupling.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "client/viewer/display/display_loop.h"
#include "client/viewer/display/headless_surface.h"
#include "client/viewer/slices/received_slices.h"
#include "common/core/clock.h"
#include "tests/support/fake_session.h"
#include "tests/support/patience.h"

namespace telesplat::viewer {
namespace {

struct Shown {
  test::FakeSession::Counts counts;
  std::vector<double> request, sequence, epoch, wait_ms, filled, drawn, coupling, buffers;
  std::vector<double> updates;
  std::map<std::string, double> status;
  std::vector<std::string> sources;  // kind of data in each frame: points, samples
  DisplayResult result;
};

// Runs a viewer from start to end: `frames` frames as fast as they come, or at target_fps.
Shown show(const test::FakeSession::Options& session_options, CouplingMode mode, uint64_t frames, double target_fps = 0,
           const std::string& renderer = "cpu", double most_wait_s = StallWatch::kMost_s) {
  static int number = 0;
  net::Context context;
  test::FakeSession session(context, session_options, std::to_string(++number));
  DisplayOptions display;
  display.width = 96;
  display.height = 64;
  display.target_fps = target_fps;
  display.span.duration_s = 120;  // a deadline
  display.span.frames = frames;
  display.most_wait_s = most_wait_s;
  const auto orbit = std::make_shared<const geometry::Trajectory>(geometry::Trajectory::orbit(1.2, 0.4, 20));
  HeadlessSurface surface(display, {.recorded = orbit});
  CouplingGate gate(buffers_of(mode, 3));
  auto renderers = Renderers::make(renderer, 1);
  metrics::TableRecorder table("frames", frame_columns());
  metrics::SpanRecorder spans;
  ViewerWorker::Options options;
  options.service.name = "viewer";
  options.service.master = session.master();
  options.requests.sampling_width = 96;
  options.requests.sampling_height = 64;
  options.requests.max_rate_hz = 200;
  Shown out;
  {
    ViewerWorker worker(context, options, gate, table, spans);
    const SourceMaker make = [&](Received& received, double) {
      auto made = received.make_source(display, *renderers);
      out.sources.push_back((*made)->units().drawn);
      return made;
    };
    out.result = run_display({display, surface, make, gate, worker, table, spans, nullptr});
  }
  if (session_options.change_every == 0 && !session_options.taken) {
    EXPECT_EQ(out.sources, std::vector<std::string>{session_options.volume ? "samples" : "points"});
  }
  // The worker's last rows and its last report are still on their way.
  const auto wait_until = [](const auto& there) {
    for (const double until = monotonic_s() + 20; !there() && monotonic_s() < until;) std::this_thread::yield();
  };
  wait_until([&] { return session.column("frames", "frame").size() >= frames; });
  out.counts = session.counts();
  out.request = session.column("frames", "request");
  out.sequence = session.column("frames", "sequence");
  out.epoch = session.column("frames", "epoch");
  out.wait_ms = session.column("frames", "wait_ms");
  out.filled = session.column("frames", "buffers_filled");
  out.drawn = session.column("frames", "points_drawn");
  out.coupling = session.column("frames", "coupling");
  out.buffers = session.column("frames", "buffers");
  wait_until([&] {
    const auto status = session.status();
    const auto told = status.find("frames");
    return told != status.end() && told->second >= double(frames) &&
           status.at("update_rows") == double(session.column("updates", "request").size());
  });
  out.status = session.status();
  out.updates = session.column("updates", "request");
  EXPECT_EQ(out.status["update_rows"], double(out.updates.size()));
  EXPECT_EQ(out.status["stage_rows"], double(session.column("stages", "request").size()));
  return out;
}

void expect_complete(const Shown& s, uint64_t frames) {
  EXPECT_EQ(s.result.error, "");
  EXPECT_FALSE(s.result.interrupted);
  EXPECT_EQ(s.result.frames, frames);
  ASSERT_EQ(s.request.size(), frames);
  for (const double drawn : s.drawn) EXPECT_GT(drawn, 0);
}

// Each frame shows a new update, in the order of requests. (Except the last one: at the end of its time it waits no
// longer.)
void expect_one_update_a_frame(const Shown& s) {
  for (size_t i = 1; i < s.request.size(); ++i) EXPECT_GT(s.request[i], s.request[i - 1]) << "frame " << i;
}

TEST(VolumeSession, AsynchronouslyFramesShowWhateverIsThere) {
  const Shown s = show({}, CouplingMode::kAsync, 60, 100);
  expect_complete(s, 60);
  EXPECT_TRUE(std::is_sorted(s.sequence.begin(), s.sequence.end()));
  EXPECT_EQ(*std::max_element(s.wait_ms.begin(), s.wait_ms.end()), 0) << "the display never waits";
  EXPECT_GE(s.counts.introductions, 1u);
  EXPECT_GT(s.counts.acknowledged, 0u);
  EXPECT_LE(s.counts.most_unacknowledged, ReceivedSlices::kAsyncBuffers);
  EXPECT_FALSE(s.counts.in_order);
  EXPECT_EQ(s.counts.buffers, 0u);
  EXPECT_FALSE(s.updates.empty());
}

TEST(VolumeSession, SynchronouslyEachFrameAsksAndWaits) {
  const Shown s = show({}, CouplingMode::kSync, 30);
  expect_complete(s, 30);
  expect_one_update_a_frame(s);
  EXPECT_EQ(s.request.back(), 30) << "one request a frame";
  EXPECT_EQ(s.counts.most_open, 1u);
  EXPECT_EQ(s.counts.most_unacknowledged, 1u);
  EXPECT_TRUE(s.counts.in_order);
  EXPECT_TRUE(s.counts.rising);
  EXPECT_EQ(s.counts.buffers, 1u);
  EXPECT_EQ(*std::max_element(s.filled.begin(), s.filled.end()), 0);
}

TEST(VolumeSession, LooselyFramesAreBufferedInOrder) {
  const Shown s = show({}, CouplingMode::kLoose, 30);
  expect_complete(s, 30);
  expect_one_update_a_frame(s);
  EXPECT_EQ(s.request.back(), 30);
  EXPECT_LE(s.counts.most_open, 3u);
  EXPECT_LE(s.counts.most_unacknowledged, 3u);
  EXPECT_TRUE(s.counts.rising);
  EXPECT_LE(*std::max_element(s.filled.begin(), s.filled.end()), 2);
}

TEST(VolumeSession, DamagedAndForgottenAnswersAreAskedForAgain) {
  const Shown s = show({.damaged = {5}, .forgotten = {9}}, CouplingMode::kSync, 20);
  expect_complete(s, 20);
  expect_one_update_a_frame(s);
  EXPECT_EQ(s.counts.repeated, 2u);
  EXPECT_EQ(s.status.at("messages_rejected"), 1) << "the damaged one, counted and dropped";
}

TEST(VolumeSession, DamagedAnswersAreToldAndHoldUpNothing) {
  for (const CouplingMode mode : {CouplingMode::kSync, CouplingMode::kLoose}) {
    const Shown s = show({.damaged = {5, 9}}, mode, 20);
    expect_complete(s, 20);
    EXPECT_EQ(s.counts.damaged, 2u);
    if (mode == CouplingMode::kSync) {
      EXPECT_EQ(s.counts.repeated, 2u) << "with buffers the next answer may be there before, and is shown";
    }
    EXPECT_LT(*std::max_element(s.wait_ms.begin(), s.wait_ms.end()), 0.75e3 * Coupling::kPatience_s);
  }
}

TEST(VolumeSession, ShowsEpochsAsTheyCome) {
  const Shown s = show({.epoch_every = 4}, CouplingMode::kLoose, 20);
  expect_complete(s, 20);
  EXPECT_TRUE(std::is_sorted(s.epoch.begin(), s.epoch.end()));
  EXPECT_GE(s.epoch.back(), 5);
  EXPECT_EQ(s.status.at("epochs_shown"), s.epoch.back() - s.epoch.front());
}

TEST(PointSession, SynchronouslyNoFrameShowsPartOfAnUpdate) {
  const Shown s = show({.volume = false, .coarse_patches = 1}, CouplingMode::kSync, 20);
  expect_complete(s, 20);
  expect_one_update_a_frame(s);
  for (const double sequence : s.sequence) EXPECT_EQ(int(sequence) % 3, 0) << "coarse, upper, lower half: all or none";
  EXPECT_EQ(s.counts.most_open, 1u);
  // The last frame, too, requests an update; it may still come before the viewer leaves.
  EXPECT_GE(s.updates.size(), s.request.size());
  EXPECT_LE(s.updates.size(), s.request.size() + 1);
}

TEST(PointSession, LooselyUpdatesAreHeldUntilTheirFrame) {
  const Shown s = show({.volume = false, .epoch_every = 5}, CouplingMode::kLoose, 30);
  expect_complete(s, 30);
  expect_one_update_a_frame(s);
  EXPECT_LE(s.counts.most_open, 3u);
  // An update has two patches, and the start of an epoch is an event: the frame with the n-th answer shows exactly the
  // events up to it.
  for (size_t i = 0; i < s.sequence.size(); ++i) {
    const double n = s.request[i];
    EXPECT_EQ(s.sequence[i], 2 * n + std::floor(n / 5)) << "frame " << i;
    EXPECT_EQ(s.epoch[i], 1 + std::floor(n / 5));
  }
}

TEST(PointSession, AsynchronouslyPointsAreShownAsTheyCome) {
  const Shown s = show({.volume = false}, CouplingMode::kAsync, 40);
  expect_complete(s, 40);
  EXPECT_TRUE(std::is_sorted(s.sequence.begin(), s.sequence.end()));
  EXPECT_EQ(*std::max_element(s.wait_ms.begin(), s.wait_ms.end()), 0);
}

TEST(VolumeSession, GoesOnWithAnotherMaster) {
  for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose}) {
    const Shown s = show({.restart_after = 6}, mode, 60);
    expect_complete(s, 60);
    if (mode == CouplingMode::kAsync) continue;
    expect_one_update_a_frame(s);
    EXPECT_GE(s.counts.repeated, 1u) << "what it had asked for is asked for again";
    // A repeated request that the new master already knows may overtake older ones.
    EXPECT_LE(s.request.back(), 62);
  }
}

// Another process that knows a viewer's instance may be the first to say hello to the new master.
TEST(ChangingSession, GoesOnAsAnotherInstanceWhereItsOwnIsTaken) {
  for (const bool volume : {true, false})
    for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync}) {
      const Shown s = show({.volume = volume, .restart_after = 6, .taken = true}, mode, 60, 100);
      expect_complete(s, 60);
      EXPECT_GT(s.updates.size(), 8u) << "updates come after the other master's hello, too";
      EXPECT_GT(*std::max_element(s.request.begin(), s.request.end()), 8);
      EXPECT_EQ(s.sources.size(), 2u);
    }
}

// Mesh, volume, mesh: the viewer follows, and the last picture stays until the next scene has one.
TEST(ChangingSession, FramesThatWaitShowEachUpdateFromTheSceneItIsOf) {
  for (const auto mode : {CouplingMode::kSync, CouplingMode::kLoose}) {
    const Shown s = show({.volume = false, .change_every = 15, .changes = 2}, mode, 50);
    expect_complete(s, 50);
    expect_one_update_a_frame(s);
    EXPECT_EQ(s.sources, (std::vector<std::string>{"points", "samples", "points"}));
    EXPECT_TRUE(std::is_sorted(s.epoch.begin(), s.epoch.end()));
    EXPECT_EQ(s.epoch.front(), 1);
    EXPECT_EQ(s.epoch.back(), 3);
    EXPECT_GE(s.counts.repeated, 2u) << "what was open at a change is asked for again";
  }
}

TEST(ChangingSession, AsynchronouslyNoFrameIsEmpty) {
  const Shown s = show({.volume = false, .change_every = 15, .changes = 2}, CouplingMode::kAsync, 300, 100);
  expect_complete(s, 300);
  EXPECT_EQ(s.sources, (std::vector<std::string>{"points", "samples", "points"}));
  EXPECT_TRUE(std::is_sorted(s.epoch.begin(), s.epoch.end()));
  EXPECT_EQ(s.epoch.back(), 3);
  EXPECT_EQ(*std::max_element(s.wait_ms.begin(), s.wait_ms.end()), 0);
}

// The context of one renderer is destroyed before the next one is made.
TEST(ChangingSession, OpenGlRenderersFollowEachOther) {
  if (const auto gl = Renderers::make("gl", 1); !gl) GTEST_SKIP() << gl.error().text;
  const Shown s = show({.volume = false, .change_every = 8, .changes = 2}, CouplingMode::kLoose, 28, 0, "gl");
  expect_complete(s, 28);
  expect_one_update_a_frame(s);
  EXPECT_EQ(s.sources, (std::vector<std::string>{"points", "samples", "points"}));
}

TEST(ChangingSession, AVolumeMayBecomeAMeshToo) {
  const Shown s = show({.change_every = 10, .changes = 1}, CouplingMode::kLoose, 25);
  expect_complete(s, 25);
  EXPECT_EQ(s.sources, (std::vector<std::string>{"samples", "points"}));
}

// Settings of a session that goes through all couplings, forth and back. Key: number of answers before the change.
std::map<uint64_t, wire::SessionSettings> all_couplings() {
  using Order = wire::CouplingOrder;
  const auto told = [](Order coupling, uint64_t buffers = 1) {
    return wire::SessionSettings{.steering = false, .coupling = coupling, .buffers = buffers};
  };
  return {{6, told(Order::kSync)},      {14, told(Order::kLoose, 3)}, {26, told(Order::kAsync)},
          {34, told(Order::kLoose, 8)}, {46, told(Order::kSync)},     {54, told(Order::kAsync)},
          {62, told(Order::kSync)},     {70, told(Order::kAsync)}};
}

// Each frame that waited shows a new update, in the order of requests; no update is left out, and no wait was long.
void expect_changes_without_loss(const Shown& s) {
  ASSERT_EQ(s.coupling.size(), s.request.size());
  std::vector<std::pair<double, double>> order;  // couplings in force, with their buffers
  double most_wait_ms = 0;
  const std::set<double> updates(s.updates.begin(), s.updates.end());
  for (size_t i = 0; i < s.request.size(); ++i) {
    if (order.empty() || order.back() != std::pair(s.coupling[i], s.buffers[i]))
      order.emplace_back(s.coupling[i], s.buffers[i]);
    most_wait_ms = std::max(most_wait_ms, s.wait_ms[i]);
    if (i == 0) continue;
    EXPECT_GE(s.request[i], s.request[i - 1]) << "frame " << i << " goes back";
    if (s.coupling[i] == 0) continue;
    EXPECT_GT(s.request[i], s.request[i - 1]) << "frame " << i << " shows an update again";
    if (s.coupling[i - 1] == 0) continue;
    for (const double update : updates)
      EXPECT_FALSE(update > s.request[i - 1] && update < s.request[i]) << "no frame shows update " << update;
  }
  // On a busy machine the first change may come before the first frame.
  if (!order.empty() && order.front() != std::pair(0.0, 0.0)) order.insert(order.begin(), {0, 0});
  const decltype(order) told{{0, 0}, {1, 1}, {2, 3}, {0, 0}, {2, 8}, {1, 1}, {0, 0}, {1, 1}, {0, 0}};
  if (test::kSlow) {  // a coupling may come and go between two frames
    size_t found = 0;
    for (const auto& coupling : told) found += found < order.size() && order[found] == coupling;
    EXPECT_EQ(found, order.size()) << "in another order, or of other buffers";
    EXPECT_GE(found, 5u);
  } else {
    EXPECT_EQ(order, told);
  }
  EXPECT_LT(most_wait_ms, Coupling::kPatience_s * 1e3) << "a change cost the patience";
  EXPECT_EQ(s.status.at("coupling"), 0);
}

TEST(CouplingChange, OfPointsLosesAndRepeatsNothing) {
  const Shown s = show({.volume = false, .settings_after = all_couplings()}, CouplingMode::kAsync, 400, 100);
  expect_complete(s, 400);
  expect_changes_without_loss(s);
}

TEST(CouplingChange, OfVolumesLosesAndRepeatsNothing) {
  const Shown s = show({.settings_after = all_couplings()}, CouplingMode::kAsync, 400, 100);
  expect_complete(s, 400);
  expect_changes_without_loss(s);
  EXPECT_TRUE(s.counts.rising);
}

TEST(CouplingChange, WithEpochsNoFrameIsEmpty) {
  for (const bool volume : {false, true}) {
    const Shown s =
        show({.volume = volume, .epoch_every = 5, .settings_after = all_couplings()}, CouplingMode::kAsync, 400, 100);
    expect_complete(s, 400);
    EXPECT_TRUE(std::is_sorted(s.epoch.begin(), s.epoch.end()));
    EXPECT_GE(s.epoch.back(), 5);
  }
}

// A server is silent for longer than the display waits: frames show the old data until it answers.
TEST(Stall, TheDisplayGoesOnAfterItsLongestWait) {
  for (const bool volume : {false, true}) {
    const Shown s = show({.volume = volume, .silent_after_s = {{8, 3}}}, CouplingMode::kSync, 40, 0, "cpu", 1.5);
    expect_complete(s, 40);
    size_t again = 0;
    double waited_ms = 0;
    for (size_t i = 1; i < s.request.size(); ++i) {
      EXPECT_GE(s.request[i], s.request[i - 1]);
      again += s.request[i] == s.request[i - 1];
      waited_ms = std::max(waited_ms, s.wait_ms[i]);
    }
    EXPECT_GE(again, 3u) << "about ten frames a second of what is there, for 1.5 s";
    EXPECT_GE(waited_ms, 1400);
    EXPECT_LT(again, 25u) << "then each frame waits for its own update again";
    EXPECT_GE(s.counts.repeated, 1u) << "it was asked for again";
  }
}

TEST(PointSession, ABoxBeyondTheLimitIsRefusedAndTheSessionGoesOn) {
  const Shown s = show({.volume = false, .strange_after = 5}, CouplingMode::kSync, 15);
  expect_complete(s, 15);
  expect_one_update_a_frame(s);
}

TEST(PointSession, AForgottenRequestIsMadeAgain) {
  const Shown s = show({.volume = false, .forgotten = {3}}, CouplingMode::kLoose, 10);
  expect_complete(s, 10);
  expect_one_update_a_frame(s);
}

// An unexplained difference is noticed, counted and mended, and the display goes on.
TEST(PointSession, AReplicaThatIsNotThePackersIsMadeAnew) {
  const Shown undisturbed = show({.volume = false}, CouplingMode::kAsync, 60, 60);
  const Shown s = show({.volume = false, .other_digest_after = 5}, CouplingMode::kAsync, 60, 60);
  expect_complete(s, 60);
  EXPECT_EQ(s.status.at("digests_different"), 1);
  EXPECT_EQ(undisturbed.counts.began_anew, 1u);
  EXPECT_EQ(s.counts.began_anew, 2u) << "at the beginning, and everything was asked for again, once";
  EXPECT_GT(s.sequence.back(), 20) << "later events are shown";
}

}  // namespace
}  // namespace telesplat::viewer
