// What `telesplat top` shows, as text.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "tools/common/text_table.h"
#include "tools/telesplat/top/layout.h"

namespace telesplat::launcher {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Json status() {
  const auto process = [](const char* role, const char* name, Json values, Json rates, Json facts = Json::object()) {
    return Json{{"role", role},     {"name", name},   {"alive", true}, {"silent_s", 0.4},
                {"values", values}, {"rates", rates}, {"facts", facts}};
  };
  Json out{
      {"session",
       {{"scene", "colorado.ply"}, {"kind", "mesh"}, {"started_by", "run"}, {"started_at", "2026-11-22T10:00:00Z"}}},
      {"epoch", 3},
      {"frames_completed", 812},
      {"frames_in_flight", 1},
      {"leases_expired", 0}};
  Json viewer = process("viewer", "viewer-1",
                        {{"inter_frame_ms", 16.7},
                         {"inter_frame_p95_ms", 20.1},
                         {"update_latency_ms", 137},
                         {"update_latency_p95_ms", 186},
                         {"update_age_ms", 210},
                         {"coupling", 2},
                         {"buffers", 3},
                         {"waits_s", 0},
                         {"points", 1.2e6},
                         {"rss_mb", 220}},
                        {{"frames", 59.9}, {"updates", 11}, {"bytes_received", 1.5e6}}, {{"renderer", "cpu"}});
  Json idle =
      process("sampler", "sampler-1", {{"tiles_sampled", 100}, {"clock_offset_ms", -0.2}, {"clock_error_ms", 0.05}},
              {{"tiles_sampled", 30}, {"busy_s", 0.25}}, {{"sampler", "ray"}, {"threads", "1"}});
  Json busy = process("sampler", "sampler-2", {{"tiles_sampled", 300}, {"rtt_ms", 40}},
                      {{"tiles_sampled", 90}, {"busy_s", 0.97}}, {{"sampler", "ray"}, {"threads", "1"}});
  idle["leases"] = 1;
  busy["leases"] = 4;
  out["processes"] = {viewer, idle, busy,
                      process("packer", "packer", {{"points", 1.2e6}, {"bytes_sent", 7e6}}, {{"tiles", 120}}),
                      process("data", "data", {{"requests", 9}}, {{"bytes_sent", 0}}, {{"format", "ply"}})};
  return out;
}

std::vector<std::string> shown(const Json& json, int width, TopSort sort = TopSort::kName, int seconds = 1,
                               bool unicode = false) {
  const TopState state = read_top_state(json);
  TopHistory history;
  for (int i = 0; i < seconds; ++i) history.add(state, i);
  std::vector<std::string> out;
  for (const TopLine& line :
       top_lines(state, history,
                 {.width = width, .sort = sort, .unicode = unicode, .wall_s = 1.795e9, .now_s = double(seconds)}))
    out.push_back(plain_text(line));
  return out;
}

bool holds(const std::vector<std::string>& lines, const std::string& text) {
  return std::any_of(lines.begin(), lines.end(), [&](const auto& l) { return l.find(text) != std::string::npos; });
}
std::string joined(const std::vector<std::string>& lines) {
  std::string out;
  for (const auto& l : lines) out += l + "\n";
  return out;
}

TEST(TopLines, ShowTheSessionItsProcessesAndLinks) {
  const auto lines = shown(status(), 140);
  for (const char* text : {"colorado.ply (mesh)",
                           "since ",
                           "epoch 3",
                           "views 812 complete, 1 in flight",
                           "coupling loose(3)",
                           "errors  none",
                           "viewer-1",
                           "59.9",
                           "16.7/20.1",
                           "137/186",
                           "210",
                           "1.50",
                           "1.20",
                           "sampler-1",
                           "25 %",
                           "97 %",
                           "30.0",
                           "packer",
                           "120.0",
                           "data",
                           "link of",
                           "40.00",
                           "-0.20 +-0.05"})
    EXPECT_TRUE(holds(lines, text)) << text << " in\n" << joined(lines);
}

TEST(TopLines, AreNoWiderThanTheTerminal) {
  Json json = status();
  json["session"]["scene"] = std::string(300, 'x');
  json["processes"][1]["name"] = "a sampler of a very long name " + std::string(200, 'y');
  for (int width : {40, 60, 80, 100, 200})
    for (const auto& line : shown(json, width, TopSort::kName, 60))
      EXPECT_LE(tools::width_of(line), size_t(width)) << line;
  // What matters most stays.
  const auto narrow = shown(status(), 60);
  for (const char* text : {"fps", "delay ms", "latency ms", "tiles/s", "busy"})
    EXPECT_TRUE(holds(narrow, text)) << text << " in\n" << joined(narrow);
  EXPECT_FALSE(holds(narrow, "renderer"));
  EXPECT_TRUE(holds(shown(status(), 140), "renderer"));
}

TEST(TopLines, SamplersAreSorted) {
  const auto row = [](const std::vector<std::string>& lines, const std::string& name) {
    return std::find_if(lines.begin(), lines.end(), [&](const auto& l) { return l.starts_with(name); }) - lines.begin();
  };
  for (const TopSort sort : {TopSort::kName, TopSort::kBusy, TopSort::kRate}) {
    const auto lines = shown(status(), 100, sort);
    EXPECT_EQ(row(lines, "sampler-1") < row(lines, "sampler-2"), sort == TopSort::kName) << name_of(sort);
  }
  EXPECT_EQ(next(next(next(TopSort::kName))), TopSort::kName);
}

TEST(TopLines, WhatIsWrongStandsOut) {
  Json json = status();
  json["leases_expired"] = 2;
  json["processes"][0]["values"]["waits_s"] = 3.25;
  json["processes"][2]["silent_s"] = 7.5;
  json["processes"][3]["alive"] = false;
  const TopState before = read_top_state(status()), after = read_top_state(json);
  TopHistory history;
  history.add(before, 0);
  history.add(after, 1);
  const auto errors = [&](double now_s, double unanswered_s = 0) {
    std::map<std::string, TopStyle> out;
    for (const TopLine& line : top_lines(after, history, {.width = 200, .now_s = now_s, .unanswered_s = unanswered_s}))
      if (!line.empty() && line.front().text == "errors  ")
        for (const TopSpan& span : line) out[span.text] = span.style;
    return out;
  };
  auto told = errors(2, 4);
  for (const char* text : {"2 leases expired", "no packer is here", "viewer-1 waits for a view update, 3.2 s",
                           "sampler-2 is silent for 7.5 s", "the master has not answered for 4 s"}) {
    ASSERT_TRUE(told.contains(text)) << text;
    EXPECT_EQ(told[text], TopStyle::kAlarm) << text;
  }
  EXPECT_EQ(errors(70)["2 leases expired"], TopStyle::kPlain) << "that was long ago";
}

TEST(TopCurves, ShowTheLastMinute) {
  const std::vector<double> values{0, 50, 100, 200, kNaN, 25};
  EXPECT_EQ(curve(values, 6, 100, false), "_-## .");
  EXPECT_EQ(curve(values, 2, 100, false), " .");
  EXPECT_EQ(curve(values, 8, 100, false), "  _-## .");
  EXPECT_EQ(curve(values, 6, 100, true), "▁▄██ ▂");
  const auto lines = shown(status(), 80, TopSort::kName, 60);
  const auto curves = std::find_if(lines.begin(), lines.end(), [](const auto& l) { return l.starts_with("    fps "); });
  ASSERT_NE(curves, lines.end()) << joined(lines);
  EXPECT_NE(curves->find("latency"), std::string::npos);
  EXPECT_NE(curves->find(" ms"), std::string::npos);
  EXPECT_EQ(std::prev(curves)->find("viewer-1"), 0u) << "under its viewer";
  EXPECT_FALSE(holds(shown(status(), 80), "    fps ")) << "one second is no curve";
}

TEST(TopHistory, RemembersAMinuteOfThoseThatAreHere) {
  const TopState state = read_top_state(status());
  TopHistory history;
  for (int i = 0; i < 200; ++i) history.add(state, i);
  ASSERT_NE(history.viewer("viewer-1"), nullptr);
  EXPECT_EQ(history.viewer("viewer-1")->fps.size(), TopHistory::kSeconds);
  Json gone = status();
  gone["processes"][0]["alive"] = false;
  history.add(read_top_state(gone), 200);
  EXPECT_EQ(history.viewer("viewer-1"), nullptr);
}

TEST(TopState, WhatOthersSayDoesNoHarm) {
  Json json = status();
  json["processes"][0]["name"] = "evil\033[2J\n";
  json["processes"].push_back(5);
  json["processes"].push_back({{"name", 7}, {"values", "none"}});
  json["session"]["scene"] = Json::array();
  const auto lines = shown(json, 100);
  EXPECT_TRUE(holds(lines, "evil?[2J?"));
  for (const auto& line : lines) EXPECT_EQ(line.find('\033'), std::string::npos);
  for (const Json& strange : {Json(), Json(3), Json::array(), Json{{"processes", 1}}})
    EXPECT_FALSE(shown(strange, 80).empty());
}

}  // namespace
}  // namespace telesplat::launcher
