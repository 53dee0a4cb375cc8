// How many pictures are asked for ahead, against servers and links of known speed.
#include "client/viewer/coupling/pipeline_depth.h"

#include <gtest/gtest.h>

#include <deque>

namespace telesplat::viewer {
namespace {

// Views go through stages one after the other; each stage has one view at a time, but for the way there and back.
struct Way {
  double draw_s = 0.03, send_s = 0.01, round_trip_s = 0;
  double drawn_s = 0, sent_s = 0;  // when these are free
  double arrival_s(double asked_s) {
    drawn_s = std::max(drawn_s, asked_s + round_trip_s / 2) + draw_s;
    sent_s = std::max(sent_s, drawn_s) + send_s;
    return sent_s + round_trip_s / 2;
  }
};

struct Outcome {
  double views_s = 0, latency_s = 0;
  int depth = 0;
};

// Asks as credits allow, `period_s` apart at least; figures of the last `last` views.
Outcome run(PipelineDepth& depth, Way& way, int views, double period_s = 1.0 / 60, int last = 100) {
  std::deque<std::pair<double, int>> open;  // asked, ahead
  std::deque<double> arrivals;
  double now_s = way.sent_s, due_s = now_s, first_s = 0, sum_s = 0;
  for (int answered = 0; answered < views;) {
    if (int(open.size()) < depth.depth() && (open.empty() || due_s <= arrivals.front())) {
      now_s = std::max(now_s, due_s);
      due_s = now_s + period_s;
      open.emplace_back(now_s, int(open.size()));
      arrivals.push_back(way.arrival_s(now_s));
      continue;
    }
    now_s = std::max(now_s, arrivals.front());
    const double latency_s = arrivals.front() - open.front().first;
    depth.answered(latency_s, open.front().second);
    open.pop_front();
    arrivals.pop_front();
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
