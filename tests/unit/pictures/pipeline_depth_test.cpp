// Number of pictures that a viewer asks for ahead, against servers and links of known speed.
#include "client/viewer/coupling/coupling.h"

#include <gtest/gtest.h>

#include <deque>

namespace telesplat::viewer {
namespace {

// Stages that each have one view at a time; only the round trip takes any number of views at once.
struct Way {
  double draw_s = 0.03, send_s = 0.01, round_trip_s = 0;
  double drawn_s = 0, sent_s = 0;  // times at which the two stages are free
  struct Arrival {
    double s = 0;
    PipelineDepth::View view;
  };
  Arrival arrival(double asked_s, int ahead) {
    const double came_s = asked_s + round_trip_s / 2, queued_s = std::max(0.0, drawn_s - came_s);
    drawn_s = came_s + queued_s + draw_s;
    sent_s = std::max(sent_s, drawn_s) + send_s;
    const double s = sent_s + round_trip_s / 2;
    return {s,
            {.latency_ms = 1e3 * (s - asked_s),
             .queued_ms = 1e3 * queued_s,
             .network_ms = 1e3 * (s - asked_s - queued_s - draw_s),
             .ahead = ahead}};
  }
};

struct Outcome {
  double views_s = 0, latency_s = 0;
  int depth = 0;
};

// Asks as credits allow, at least `period_s` apart. Returns figures of the last `last` views.
Outcome run(PipelineDepth& depth, Way& way, int views, double period_s = 1.0 / 60, int last = 100) {
  std::deque<Way::Arrival> open;
  double now_s = way.sent_s, due_s = now_s, first_s = 0, sum_s = 0;
  for (int answered = 0; answered < views;) {
    if (int(open.size()) < depth.depth() && (open.empty() || due_s <= open.front().s)) {
      now_s = std::max(now_s, due_s);
      due_s = now_s + period_s;
      open.push_back(way.arrival(now_s, int(open.size())));
      continue;
    }
    now_s = std::max(now_s, open.front().s);
    const double latency_s = open.front().view.latency_ms * 1e-3;
    depth.answered(open.front().view);
    open.pop_front();
    if (++answered == views - last) first_s = now_s;
    if (answered > views - last) sum_s += latency_s;
  }
  return {last / (now_s - first_s), sum_s / last, depth.depth()};
}

TEST(PipelineDepth, ASamplerOnThisMachineIsKeptBusyByTwo) {
  PipelineDepth depth;
  Way way{.draw_s = 0.03, .send_s = 0.01};
  const Outcome o = run(depth, way, 400);
  EXPECT_GT(o.views_s, 0.95 / 0.03);
  EXPECT_LT(o.latency_s, 0.09);
}

// The first view waits for the data, so it does not show how long a view takes by itself; later views differ in weight.
TEST(PipelineDepth, AFirstViewThatWaitsForTheDataDeepensNothing) {
  PipelineDepth depth;
  Way way{.draw_s = 0.03, .send_s = 0.001, .drawn_s = 5};
  const Outcome o = run(depth, way, 300);
  EXPECT_GT(o.views_s, 0.95 / 0.03);
  EXPECT_EQ(o.depth, 2);
  EXPECT_LT(o.latency_s, 0.065);
}

TEST(PipelineDepth, AFarServerGetsAsManyAsFillTheWayAndFewWait) {
  PipelineDepth depth;
  Way way{.draw_s = 0.03, .send_s = 0.02, .round_trip_s = 0.15};
  const Outcome o = run(depth, way, 400);
  EXPECT_GT(o.views_s, 0.9 / 0.03) << "with two there would be 10 a second";
  EXPECT_LT(o.latency_s, 1.5 * 0.2);
  EXPECT_GE(o.depth, 6);
}

TEST(PipelineDepth, AViewThatTakesTheLinkLongHasFewBehindIt) {
  PipelineDepth depth;
  Way way{.draw_s = 0.03, .send_s = 0.2, .round_trip_s = 0.05};
  const Outcome o = run(depth, way, 200);
  EXPECT_GT(o.views_s, 0.95 / 0.2);
  EXPECT_LE(o.depth, 3);
  EXPECT_LT(o.latency_s, 3 * 0.2 + 0.08);
}

TEST(PipelineDepth, FollowsAScenesWeightBothWays) {
  PipelineDepth depth;
  Way way{.draw_s = 0.02, .send_s = 0.01, .round_trip_s = 0.1};
  run(depth, way, 200);
  way.draw_s = 0.1;
  const Outcome heavy = run(depth, way, 300);
  EXPECT_GT(heavy.views_s, 0.85 / 0.1);
  EXPECT_LT(heavy.latency_s, 3.5 * 0.1 + 0.11) << "no queue of views of the past";
  way.draw_s = 0.02;
  EXPECT_GT(run(depth, way, 400).views_s, 0.85 / 0.02);
}

TEST(PipelineDepth, WhereThereIsTimeLeftItDoesNotGrow) {
  PipelineDepth depth;
  Way way{.draw_s = 0.004, .send_s = 0.001};
  const Outcome o = run(depth, way, 400);
  EXPECT_LE(o.depth, PipelineDepth::kFirst) << "sixty a second are all that is wanted";
}

}  // namespace
}  // namespace telesplat::viewer
