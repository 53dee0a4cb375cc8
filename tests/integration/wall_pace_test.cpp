// Displays of a wall over real sockets, led by the master's barrier: they present together, go on without one that
// stops, and by themselves without a master.
#include <gtest/gtest.h>

#include <atomic>
#include <map>
#include <memory>
#include <mutex>
#include <thread>

#include "client/viewer/wall_pace.h"
#include "common/core/clock.h"
#include "services/master/wall/swap_barrier.h"

namespace telesplat::viewer {
namespace {

constexpr double kPeriod_s = 0.02;
constexpr int kViewers = 3;

// The part of a master that leads walls, in its own thread.
class Leader {
 public:
  Leader() : socket_(context_, net::Kind::kRouter, "master"), barrier_({42}) {
    const auto bound = socket_.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound.ok());
    if (bound) endpoint_ = *bound;
    thread_ = std::thread([this] { serve(); });
  }
  ~Leader() {
    stop_ = true;
    thread_.join();
  }
  const std::string& endpoint() const { return endpoint_; }
  uint64_t incomplete() const { return incomplete_; }

 private:
  void serve() {
    while (!stop_) {
      const double until_s = barrier_.due_s().value_or(monotonic_s() + 0.01) - monotonic_s();
      net::wait_readable_s({&socket_}, std::clamp(until_s, 0.0, 0.01));
      while (const auto m = socket_.receive())
        if (const auto ready = socket_.decode<wire::SwapReady>(*m)) barrier_.on(m->peer, *ready, monotonic_s());
      barrier_.tick(monotonic_s());
      for (const auto& [peer, swap] : barrier_.take_outgoing()) socket_.send(swap, peer);
      incomplete_ = barrier_.figures().incomplete;
    }
  }
  net::Context context_;
  net::Socket socket_;
  master::SwapBarrier barrier_;
  std::string endpoint_;
  std::atomic<bool> stop_{false};
  std::atomic<uint64_t> incomplete_{0};
  std::thread thread_;
};

// Frames that displays presented, by the wall's frame number.
struct Presented {
  std::mutex mutex;
  struct Frame {
    double first_s = 1e300, last_s = 0, x = 0;
    int displays = 0;
    bool one_head = true;
  };
  std::map<uint64_t, Frame> frames;
  void add(uint64_t frame, double x, double now_s) {
    const std::lock_guard lock(mutex);
    Frame& f = frames[frame];
    f.one_head = f.displays == 0 || (f.one_head && f.x == x);
    f.x = x;
    f.first_s = std::min(f.first_s, now_s);
    f.last_s = std::max(f.last_s, now_s);
    ++f.displays;
  }
};

// A display that draws for draw_s; its own head is where no other display's is.
void show(const std::string& master, int number, double draw_s, double stops_s, double resumes_s, double ends_s,
          Presented& presented, std::atomic<int>& alone) {
  net::Context context;
  WallPace pace(
      context,
      {.master = master,
       .name = "viewer-" + std::to_string(number + 1),
       .wall = "lab",
       .number = uint64_t(number),
       .viewers = kViewers,
       .period_s = kPeriod_s},
      [number] { return InstanceId{100 + uint64_t(number)}; }, [](double s) { return s; });
  const auto stopped = [&] { return monotonic_s() > ends_s; };
  const auto wish = [&] {
    WallPace::Wish out;
    out.t_s = monotonic_s();
    out.head.position_room = {monotonic_s(), double(number), 0};
    return out;
  };
  pace.drawn(wish(), stopped);
  while (!stopped()) {
    if (monotonic_s() > stops_s && monotonic_s() < resumes_s)
      std::this_thread::sleep_for(std::chrono::duration<double>(resumes_s - monotonic_s()));
    const auto turn = pace.turn();
    std::this_thread::sleep_for(std::chrono::duration<double>(draw_s));
    const auto swapped = pace.drawn(wish(), stopped);
    const double now_s = monotonic_s();
    pace.presented(now_s);
    if (swapped.alone) {
      if (!stopped()) ++alone;
      std::this_thread::sleep_for(std::chrono::duration<double>(kPeriod_s));
    } else {
      presented.add(turn.frame, turn.head.position_room.x, now_s);
    }
  }
}

TEST(WallPace, DisplaysPresentTogetherFromOneHead) {
  Leader leader;
  Presented presented;
  std::atomic<int> alone{0};
  const double ends_s = monotonic_s() + 2;
  std::vector<std::thread> displays;
  for (int i = 0; i < kViewers; ++i)
    displays.emplace_back(
        [&, i] { show(leader.endpoint(), i, 0.002 * (i + 1), 1e300, 1e300, ends_s, presented, alone); });
  for (auto& d : displays) d.join();
  size_t whole = 0, near = 0;
  for (const auto& [number, f] : presented.frames) {
    EXPECT_TRUE(f.one_head) << number;
    whole += f.displays == kViewers;
    near += f.displays == kViewers && f.last_s - f.first_s < 0.01;
  }
  EXPECT_GT(presented.frames.size(), 40u);
  EXPECT_GT(whole, presented.frames.size() * 8 / 10);
  EXPECT_GT(near, whole * 8 / 10) << "of " << whole;
}

TEST(WallPace, OneThatStopsHoldsTheOthersOnceAndComesBack) {
  Leader leader;
  Presented presented;
  std::atomic<int> alone{0};
  const double begin_s = monotonic_s(), stops_s = begin_s + 0.8, resumes_s = begin_s + 1.6, ends_s = begin_s + 2.6;
  std::vector<std::thread> displays;
  for (int i = 0; i < kViewers; ++i)
    displays.emplace_back(
        [&, i] { show(leader.endpoint(), i, 0.002, i == 2 ? stops_s : 1e300, resumes_s, ends_s, presented, alone); });
  for (auto& d : displays) d.join();
  int meanwhile = 0, after = 0;
  double before_s = 0, longest_s = 0;
  for (const auto& [number, f] : presented.frames) {
    meanwhile += f.first_s > stops_s + 0.1 && f.last_s < resumes_s && f.displays == 2;
    after += f.first_s > resumes_s + 0.2 && f.displays == kViewers;
    if (before_s > begin_s + 0.3) longest_s = std::max(longest_s, f.first_s - before_s);
    before_s = f.first_s;
  }
  EXPECT_GT(meanwhile, 20) << "the others go on";
  EXPECT_GT(after, 20) << "it is back";
  EXPECT_LT(longest_s, 0.15) << "they were held for a frame of 20 ms or so, however busy the machine is";
  EXPECT_GE(leader.incomplete(), 1u);
  EXPECT_EQ(alone, 0);
}

// A master that was started again may begin at a lower number.
TEST(WallPace, AnotherMastersNumbersMayBeLower) {
  net::Context context;
  net::Socket master(context, net::Kind::kRouter, "master");
  const auto bound = master.bind("tcp://127.0.0.1:*");
  ASSERT_TRUE(bound);
  std::atomic<bool> stop{false};
  struct Word {
    uint64_t master, frame;
  };
  const std::vector<Word> words{{1, 500}, {1, 501}, {2, 3}, {2, 4}};
  std::vector<uint64_t> drawn;
  std::thread leads([&] {
    while (!stop) {
      net::wait_readable_s({&master}, 0.02);
      while (const auto m = master.receive()) {
        const auto ready = master.decode<wire::SwapReady>(*m);
        if (!ready || (!drawn.empty() && drawn.back() == ready->frame)) continue;  // repeated until answered
        drawn.push_back(ready->frame);
        if (drawn.size() > words.size()) continue;
        const Word& word = words[drawn.size() - 1];
        master.send(wire::Swap{.master = {word.master}, .frame = word.frame, .at_s = monotonic_s()}, m->peer);
      }
    }
  });
  WallPace pace(
      context, {.master = *bound, .name = "viewer-1", .wall = "lab", .period_s = kPeriod_s},
      [] { return InstanceId{100}; }, [](double s) { return s; });
  for (const Word& word : words) {
    const auto swapped = pace.drawn({}, [] { return false; });
    EXPECT_FALSE(swapped.alone) << word.frame;
    EXPECT_EQ(pace.turn().frame, word.frame + 1);
  }
  stop = true;
  leads.join();
  EXPECT_EQ(drawn, (std::vector<uint64_t>{0, 501, 502, 4}));
}

TEST(WallPace, WithoutAMasterADisplayGoesOnByItself) {
  Presented presented;
  std::atomic<int> alone{0};
  const double ends_s = monotonic_s() + WallPace::kFirstPatience_s + 0.5;
  show("tcp://127.0.0.1:9", 0, 0.001, 1e300, 1e300, ends_s, presented, alone);
  EXPECT_GT(alone, 5);
  EXPECT_TRUE(presented.frames.empty());
}

}  // namespace
}  // namespace telesplat::viewer
