// Figures for monitoring programs: histograms, and the text format of Prometheus.
#include "services/master/live/exposition.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <regex>
#include <set>
#include <sstream>

namespace telesplat::master {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Histogram, CountsUpToEachBound) {
  Histogram h;
  for (const double seconds : {0.001, 0.0168, 0.0169, 0.2, 100.0, -1.0}) h.add(seconds);
  h.add(std::numeric_limits<double>::quiet_NaN());
  h.add(kInfinity);
  EXPECT_EQ(h.count(), 6u) << "what is no number does not count";
  EXPECT_NEAR(h.sum_s(), 0.001 + 0.0168 + 0.0169 + 0.2 + 100, 1e-9);
  EXPECT_EQ(h.up_to(0), 2u);
  const auto at = [&](double bound) {
    return h.up_to(
        size_t(std::find(Histogram::kBounds.begin(), Histogram::kBounds.end(), bound) - Histogram::kBounds.begin()));
  };
  EXPECT_EQ(at(0.0168), 3u);
  EXPECT_EQ(at(0.025), 4u);
  EXPECT_EQ(at(10), 5u);
}

TEST(LiveFigures, LeaveOutFramesOfAPictureThatStands) {
  LiveFigures f;
  f.add_rows("v", {{5},
                   "frames",
                   {"inter_frame_ms", "motion_to_photon_ms", "missed", "still"},
                   {0, 12, 0, 0, 16, -1, 0, 1, 50, 30, 2, 0, 16, 10, -5, 0}});
  const auto& v = f.viewers().at("v");
  EXPECT_EQ(v.inter_frame.count(), 2u);
  EXPECT_EQ(v.motion_to_photon.count(), 3u);
  EXPECT_NEAR(v.motion_to_photon.sum_s(), 0.052, 1e-12);
  EXPECT_EQ(v.refreshes_missed, 2u);
}

TEST(LiveFigures, FollowRowsAndTiles) {
  LiveFigures f;
  f.add_rows("v", {{5}, "frames", {"frame", "inter_frame_ms"}, {0, 0, 1, 16, 2, 40}});
  f.add_rows("v", {{5}, "updates", {"latency_ms", "start_up_ms"}, {150, 90}});
  f.add_rows("v", {{5}, "updates", {"something"}, {150}});
  f.add_rows("v", {{5}, "spans", {"a"}, {1, 2, 3, 4}});
  const auto& v = f.viewers().at("v");
  EXPECT_EQ(v.inter_frame.count(), 2u) << "the first frame has no delay";
  EXPECT_NEAR(v.inter_frame.sum_s(), 0.056, 1e-12);
  EXPECT_EQ(v.update_latency.count(), 1u);
  EXPECT_NEAR(v.start_up.sum_s(), 0.09, 1e-12);
  wire::TileDone tile;
  tile.moments.sample_begin_s = 1, tile.moments.encode_end_s = 1.5, tile.bytes_sampled = 100, tile.rays = 7;
  f.add_tile("s", tile);
  f.add_tile("s", tile);
  EXPECT_EQ(f.samplers().at("s").tiles, 2u);
  EXPECT_EQ(f.samplers().at("s").bytes, 200u);
  EXPECT_EQ(f.samplers().at("s").busy_s, 1);
  for (size_t i = 0; i < 2 * LiveFigures::kMostNames; ++i) f.add_tile(fmt::format("s{}", i), tile);
  EXPECT_EQ(f.samplers().size(), LiveFigures::kMostNames);
}

// Samplers come and go all day: those that left make room, present ones stay.
TEST(LiveFigures, WhoLeftLongAgoMakesRoom) {
  LiveFigures f;
  const wire::TileDone tile;
  const wire::MetricRows rows{{5}, "updates", {"latency_ms"}, {150}};
  const auto name = [](size_t i) { return fmt::format("p{}", i); };
  for (size_t i = 0; i < LiveFigures::kMostNames; ++i) f.add_tile(name(i), tile), f.add_rows(name(i), rows);
  f.add_tile("new", tile), f.add_rows("new", rows);
  EXPECT_FALSE(f.samplers().contains("new") || f.viewers().contains("new")) << "all are here";
  for (const size_t i : {7, 3, 9}) f.set_here("sampler", name(i), false);
  f.set_here("viewer", name(5), false);
  f.set_here("packer", name(6), false);
  f.add_tile(name(3), tile, false);  // its last tile comes after it left
  f.set_here("sampler", name(9), true);
  f.add_tile("new", tile), f.add_rows("new", rows);
  EXPECT_TRUE(f.samplers().contains("new") && f.viewers().contains("new"));
  EXPECT_FALSE(f.samplers().contains(name(7))) << "of those that left, measured longest ago";
  EXPECT_FALSE(f.viewers().contains(name(5)));
  f.add_tile("newer", tile);
  EXPECT_FALSE(f.samplers().contains(name(3)));
  f.add_tile("newest", tile);
  EXPECT_FALSE(f.samplers().contains("newest")) << "the one that came back is here";
  EXPECT_EQ(f.samplers().at(name(9)).tiles, 1u);
  EXPECT_EQ(f.samplers().size(), LiveFigures::kMostNames);
  EXPECT_EQ(f.viewers().size(), LiveFigures::kMostNames);
}

LiveSnapshot snapshot() {
  LiveSnapshot s{.version = "1.2", .scene = "hill \"A\"\\\n.ply", .kind = "mesh", .started_at_s = 1.7e9, .epoch = 3};
  s.processes.push_back(
      {"viewer", "v\"1", true, {}, {{"frames", 10}, {"rss_mb", 2}, {"update_age_ms", 150}}, {{"frames", 59.5}}});
  s.processes.push_back({"viewer", "v\"1", false, {}, {{"frames", 99}}, {}});  // an earlier life
  s.processes.push_back({"sampler", "s", true, 2.0, {{"messages_rejected", 4}, {"leases_held", 1}}, {}});
  s.processes.push_back({"packer", "gone\xff", false, {}, {{"points", 1e6}}, {}});
  return s;
}

TEST(Exposition, HasTheFormatThatPrometheusReads) {
  LiveFigures f;
  f.add_rows("v\"1", {{5}, "frames", {"inter_frame_ms"}, {0, 16, 40}});
  wire::TileDone tile;
  tile.moments.encode_end_s = 0.25;
  f.add_tile("s", tile);
  const std::string text = exposition(snapshot(), f);
  for (const char* line :
       {"telesplat_session_info{version=\"1.2\",scene=\"hill \\\"A\\\"\\\\\\n.ply\",kind=\"mesh\"} 1\n",
        "telesplat_session_epoch 3\n", "telesplat_process_up{role=\"viewer\",name=\"v\\\"1\"} 1\n",
        "telesplat_process_up{role=\"packer\",name=\"gone\xEF\xBF\xBD\"} 0\n",
        "telesplat_viewer_frames_total{name=\"v\\\"1\"} 10\n",
        "telesplat_viewer_frames_per_second{name=\"v\\\"1\"} 59.5\n",
        "telesplat_viewer_update_age_seconds{name=\"v\\\"1\"} 0.15\n",
        "telesplat_process_resident_memory_bytes{role=\"viewer\",name=\"v\\\"1\"} 2000000\n",
        "telesplat_sampler_leases{name=\"s\"} 2\n", "telesplat_sampler_busy_seconds_total{name=\"s\"} 0.25\n",
        "telesplat_process_messages_rejected_total{role=\"sampler\",name=\"s\"} 4\n",
        "telesplat_viewer_inter_frame_delay_seconds_bucket{name=\"v\\\"1\",le=\"0.0168\"} 1\n",
        "telesplat_viewer_inter_frame_delay_seconds_bucket{name=\"v\\\"1\",le=\"+Inf\"} 2\n",
        "telesplat_viewer_inter_frame_delay_seconds_count{name=\"v\\\"1\"} 2\n"})
    EXPECT_NE(text.find(line), std::string::npos) << line << " in\n" << text;
  EXPECT_EQ(text.find("packer_points"), std::string::npos) << "of a process that is gone";

  // Each line is a comment or a sample; each family has its comments before its samples, once.
  const std::regex help("# HELP ([a-z_]+) .+"), type("# TYPE ([a-z_]+) (counter|gauge|histogram)"),
      sample(R"(([a-z_]+)(\{([a-z]+="([^"\\]|\\.)*",?)+\})? [-+0-9.eInfNa]+)");
  std::istringstream in(text);
  std::set<std::string> families, series;
  std::smatch match;
  for (std::string line; std::getline(in, line);) {
    if (std::regex_match(line, match, help)) {
      EXPECT_TRUE(families.insert(match[1]).second) << line;
    } else if (std::regex_match(line, match, type)) {
      EXPECT_TRUE(families.contains(match[1])) << line;
      EXPECT_EQ(match[2] == "counter", std::string(match[1]).ends_with("_total")) << line;
    } else {
      ASSERT_TRUE(std::regex_match(line, match, sample)) << line;
      EXPECT_TRUE(series.insert(line.substr(0, line.rfind(' '))).second) << "twice: " << line;
    }
  }
  EXPECT_GT(families.size(), 20u);
}

TEST(Exposition, IsBounded) {
  LiveSnapshot s;
  for (int i = 0; i < 3000; ++i)
    s.processes.push_back({"sampler", fmt::format("s{}", i), i >= 2900, {}, {{"rss_mb", 1}}, {}});
  const std::string text = exposition(s, {});
  size_t up = 0;
  for (size_t at = 0; (at = text.find("process_up{", at)) != std::string::npos; ++at) ++up;
  EXPECT_EQ(up, kMostTold);
  EXPECT_NE(text.find("name=\"s2999\"} 1\n"), std::string::npos) << "those that are here come first";
}

TEST(Exposition, StrangeNumbersHaveTheirNames) {
  LiveSnapshot s;
  s.processes.push_back(
      {"viewer", "v", true, {}, {{"waits_s", std::numeric_limits<double>::quiet_NaN()}, {"points", kInfinity}}, {}});
  const std::string text = exposition(s, {});
  EXPECT_NE(text.find("viewer_waiting_seconds{name=\"v\"} NaN\n"), std::string::npos);
  EXPECT_NE(text.find("viewer_points{name=\"v\"} +Inf\n"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::master
