// The line of figures of `telesplat run`: true to the viewers' counts at any time of asking.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "tools/telesplat/run/live_figures.h"

namespace telesplat::launcher {
namespace {

/// A session whose viewer displays frames steadily and reports its counters once a second.
struct Session {
  double fps = 58, offset_s = 0.3, stops_s = 1e9;
  bool stamps = true;  // reports have the time of their making
  double displayed(double t_s) const { return std::floor(fps * std::min(t_s, stops_s)); }

  // Returns the master's knowledge at t_s: the newest report, made at a whole second after offset_s.
  nlohmann::json status(double t_s) const {
    const double made_s = std::floor(t_s - offset_s) + offset_s;
    nlohmann::json viewer{{"role", "viewer"}, {"name", "viewer-1"}, {"pid", 7}, {"alive", true}};
    if (made_s > 0) {
      viewer["values"] = {{"frames", displayed(made_s)},
                          {"updates", std::floor(5 * made_s)},
                          {"points", 2e6},
                          {"bytes_received", 1e6 * made_s},
                          {"rss_mb", 100 + 0.01 * made_s}};
      if (stamps) viewer["values"]["reported_s"] = 1000 + made_s;
    }
    const nlohmann::json sampler{{"role", "sampler"}, {"name", "sampler-1"}, {"pid", 8}, {"alive", true}};
    return {{"processes", {viewer, sampler}}};
  }
};

double fps_of(const std::string& line) { return std::strtod(line.c_str(), nullptr); }

// Asks every `period_s` for 30 s; every line after the first 3 s shows 58 frames a second.
void expect_steady(const Session& session, double period_s) {
  SessionFigures figures;
  for (int i = 0; i * period_s < 30; ++i) {
    const double t_s = i * period_s;
    const std::string line = figures.update(session.status(t_s), t_s);
    if (line.empty()) {
      EXPECT_LT(t_s, 3) << "no line yet";
      continue;
    }
    EXPECT_GT(fps_of(line), 0) << line;
    if (t_s > 3) EXPECT_NEAR(fps_of(line), 58, 1) << "at " << t_s << " s: " << line;
  }
}

TEST(SessionFigures, ASteadyRateIsShownAskedEveryHalfSecond) { expect_steady({}, 0.5); }
TEST(SessionFigures, ASteadyRateIsShownAskedEverySecond) { expect_steady({}, 1); }
TEST(SessionFigures, ASteadyRateIsShownAskedOutOfStepWithTheReports) {
  for (const double period_s : {0.13, 0.52, 0.7, 1.02, 1.3}) expect_steady({}, period_s);
}
TEST(SessionFigures, AViewerThatDoesNotTellWhenItReportedIsTimedByWhatIsSeen) {
  Session session;
  session.stamps = false;
  for (const double period_s : {0.5, 1.0}) expect_steady(session, period_s);
}

TEST(SessionFigures, ADisplayThatStopsComesToZero) {
  SessionFigures figures;
  Session session;
  session.stops_s = 10.3;
  std::string line;
  for (double t_s = 0; t_s < 16; t_s += 0.5) line = figures.update(session.status(t_s), t_s);
  EXPECT_EQ(fps_of(line), 0) << line;
  EXPECT_NE(line.find("2.00 M points"), std::string::npos) << line;
}

TEST(SessionFigures, ASilentViewerShowsNoRate) {
  SessionFigures figures;
  const Session session;
  for (double t_s = 0; t_s < 10; t_s += 0.5) figures.update(session.status(t_s), t_s);
  EXPECT_NEAR(fps_of(figures.update(session.status(9.5), 10.5)), 58, 1);
  EXPECT_EQ(fps_of(figures.update(session.status(9.5), 20)), 0);
}

TEST(SessionFigures, ARestartedViewerBeginsAnew) {
  SessionFigures figures;
  Session session;
  for (double t_s = 0; t_s < 10; t_s += 0.5) figures.update(session.status(t_s), t_s);
  std::string line;
  for (double t_s = 0; t_s < 6; t_s += 0.5) {
    line = figures.update(session.status(t_s), 20 + t_s);
    if (!line.empty()) EXPECT_GE(fps_of(line), 0) << line;
  }
  EXPECT_NEAR(fps_of(line), 58, 1) << line;
}

TEST(SessionFigures, SeveralViewersShareALine) {
  SessionFigures figures;
  std::string line;
  for (double t_s = 0; t_s < 8; t_s += 0.5) {
    auto status = Session{}.status(t_s), other = Session{.fps = 30}.status(t_s);
    other["processes"][0]["name"] = "viewer-2";
    status["processes"].push_back(other["processes"][0]);
    line = figures.update(status, t_s);
  }
  EXPECT_NEAR(fps_of(line), 44, 1) << line;
  EXPECT_NE(line.find("1 sampler, each of 2 viewers"), std::string::npos) << line;
  EXPECT_NE(line.find("5.0 updates/s"), std::string::npos) << line;
  EXPECT_NE(line.find("2.00 MB/s"), std::string::npos) << line;
}

TEST(SessionFigures, AnswersThatAreNoneAreSilence) {
  SessionFigures figures;
  EXPECT_EQ(figures.update(nlohmann::json::object(), 1), "");
  EXPECT_EQ(figures.update({{"processes", nlohmann::json::array()}}, 2), "");
}

}  // namespace
}  // namespace telesplat::launcher
