// The files of a run.
#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "common/core/utf8.h"
#include "common/metrics/recorder.h"
#include "tests/unit/metrics/record_fixture.h"

namespace telesplat::metrics {
namespace {

namespace fs = std::filesystem;

std::vector<nlohmann::json> of_phase(const nlohmann::json& trace, const std::string& phase) {
  std::vector<nlohmann::json> out;
  for (const auto& event : trace)
    if (event["ph"] == phase) out.push_back(event);
  return out;
}

TEST_F(Record, TablesBecomeCsv) {
  // Times have digits down to nanoseconds, other numbers all of their digits.
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"frame", "t_s", "px"}, {0, 0.25, 0, 1, 1e-7, 1e-7}}));
  viewer.name = "viewer-2";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"frame", "t_s", "px"}, {0, 123456.789, 1.0 / 3}}));
  EXPECT_EQ(text("frames.csv"),
            "viewer,frame,t_s,px\nviewer-1,0,0.250000000,0\nviewer-1,1,0.000000100,1e-07\n"
            "viewer-2,0,123456.789000000,0.3333333333333333\n");
}

TEST_F(Record, BadTablesAreRefusedAndLeaveNothing) {
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "secrets", {"a"}, {1}}));
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "../frames", {"a"}, {1}}));
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "frames", {}, {1}}));
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "frames", {"a", "b"}, {1, 2, 3}}));
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "spans", {"a"}, {0, 1, 2}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"a", "b"}, {1, 2}}));
  EXPECT_FALSE(record->add_rows(viewer, {{5}, "frames", {"a", "c"}, {1, 2}}));
  EXPECT_EQ(text("frames.csv"), "viewer,a,b\nviewer-1,1,2\n");
}

TEST_F(Record, TheTraceIsValidWhateverSpansCome) {
  ASSERT_TRUE(record->add_rows(
      viewer, {{5}, "spans", {"sample", "a \"quoted\"\nname"}, {0, 1, 1.5, 0, 7, 3, 9, 1, 2, 2.25, 3, -1, -1, -1}}));
  ASSERT_TRUE(record->add_rows(
      viewer, {{5}, "spans", {"sample"}, {7, 1, 1.5, 0, 0, 0, 0, -1, 1, 2, 0, 0, 0, 0}}));  // no such names
  record.reset();
  const auto trace = nlohmann::json::parse(text("trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array());
  const auto spans = of_phase(trace, "X");
  ASSERT_EQ(spans.size(), 2u);
  EXPECT_EQ(spans[0]["name"], "sample");
  EXPECT_EQ(spans[0]["ts"], 1e6);
  EXPECT_EQ(spans[0]["dur"], 5e5);
  EXPECT_EQ(spans[0]["args"], (nlohmann::json{{"frame", 7}, {"tile", 3}, {"request", 9}}));
  EXPECT_EQ(spans[1]["tid"], 3);
  EXPECT_EQ(spans[1]["args"], nlohmann::json::object()) << "it is about nothing that is known";
  std::map<std::string, std::string> names;
  for (const auto& e : of_phase(trace, "M"))
    if (e["name"] != "process_labels") names[std::string(e["name"]) + e["tid"].dump()] = e["args"]["name"];
  EXPECT_EQ(names["process_name0"], "viewer-1");
  EXPECT_EQ(names["thread_name0"], "display");
  EXPECT_EQ(names["thread_name3"], "epochs");
}

// Spans of a lane that may overlap are distinguished by their ids.
TEST_F(Record, TheTraceHasLeasesPlansAndViewUpdates) {
  wire::TileDone done = tile(4, 2, 10);
  done.lease = {77};
  done.request = {5};
  done.moments.leased_s = 9;
  record->add_tile("sampler-1", done);
  PlanRow plan;
  plan.asked.frame = {4}, plan.asked.request = {5};
  plan.asked_s = 8.5, plan.planned_s = 8.75;
  record->add_plan("viewer-1", plan);
  ASSERT_TRUE(record->add_rows(
      viewer, {{5}, "spans", {"view update"}, {0, 8, 11, kOverlapping, 4, -1, 5, 0, 8.5, 12, kOverlapping, 5, -1, 6}}));
  record.reset();
  const auto trace = nlohmann::json::parse(text("trace.json"));
  const auto begins = of_phase(trace, "b"), ends = of_phase(trace, "e");
  ASSERT_EQ(begins.size(), 4u);
  ASSERT_EQ(ends.size(), 4u);
  std::set<uint64_t> ids;
  for (size_t i = 0; i < begins.size(); ++i) {
    ids.insert(uint64_t(begins[i]["id"]));
    for (const char* key : {"id", "name", "cat", "pid"}) EXPECT_EQ(begins[i][key], ends[i][key]) << key;
    EXPECT_LT(begins[i]["ts"], ends[i]["ts"]);
  }
  EXPECT_EQ(ids.size(), 4u);
  EXPECT_EQ(begins[0]["name"], "lease");
  EXPECT_EQ(begins[0]["ts"], 9e6);
  EXPECT_EQ(ends[0]["ts"], 10.018e6) << "until the packer had it";
  EXPECT_EQ(begins[0]["args"],
            (nlohmann::json{{"frame", 4}, {"tile", 2}, {"request", 5}, {"lease", 77}, {"sampler", "sampler-1"}}));
  EXPECT_EQ(begins[1]["name"], "plan");
  EXPECT_EQ(begins[1]["pid"], begins[0]["pid"]) << "the master's";
  EXPECT_NE(begins[2]["pid"], begins[0]["pid"]);
  EXPECT_EQ(begins[3]["args"]["request"], 6);
}

// After any uptime: twelve days are 10^6 seconds.
TEST_F(Record, TimesCountFromTheRunsBeginning) {
  record = std::move(RunRecord::open(folder + "/run", {1'000'000, 1})).value();
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "begin_s"}, {0.5, 1'000'002.000000001}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "updates", {"requested_s", "latency_ms"}, {1'000'001.25, 200}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "spans", {"sample"}, {0, 1'000'001, 1'000'001.000000123, 0, -1, -1, -1}}));
  wire::TileDone done = tile(1, 0, 1'000'003);
  done.moments.leased_s = 1'000'002;
  record->add_tile("sampler-1", done);
  done.moments.published_s = 1'000'003.5;
  record->add_tile("sampler-1", done);
  record->add_epoch({1}, 1'000'000.5, {});
  ASSERT_TRUE(record->finish({}, {}));
  record.reset();
  EXPECT_EQ(text("frames.csv"), "viewer,t_s,begin_s\nviewer-1,0.500000000,2.000000001\n");
  EXPECT_EQ(text("updates.csv"), "viewer,requested_s,latency_ms\nviewer-1,1.250000000,200\n");
  EXPECT_EQ(text("epochs.csv"), "epoch,t_s\n1,0.500000000\n");
  EXPECT_NE(text("tiles.csv").find(",2.000000000,3.000000000,3.010000000,3.012000000,3.013000000,3.018000000,,0,"),
            std::string::npos)
      << "not published with this tile: " << text("tiles.csv");
  EXPECT_NE(text("tiles.csv").find(",3.018000000,3.500000000,0,"), std::string::npos);
  const auto spans = of_phase(nlohmann::json::parse(text("trace.json")), "X");
  ASSERT_EQ(spans.size(), 1u);
  EXPECT_EQ(spans[0]["ts"], 1e6);
  EXPECT_NEAR(double(spans[0]["dur"]), 0.123, 1e-9) << "microseconds, to the nanosecond";
}

TEST_F(Record, ATraceWithoutSpansIsValidToo) {
  record.reset();
  EXPECT_EQ(nlohmann::json::parse(text("trace.json"), nullptr, false), nlohmann::json::array());
}

TEST_F(Record, EpochsCanBeMadeAgain) {
  const double third = 1.0 / 3;
  record->add_epoch({1}, 0.5, {{"c.x", third}, {"iterations", 64}});
  record->add_epoch({2}, 1.25, {{"c.x", -1e-9}, {"iterations", 65}, {"new", 1}});
  record->add_epoch({4}, 2, {{"iterations", 66}});
  const std::string epochs = text("epochs.csv");
  EXPECT_EQ(
      epochs,
      "epoch,t_s,c.x,iterations\n1,0.500000000,0.3333333333333333,64\n2,1.250000000,-1e-09,65\n4,2.000000000,,66\n");
  EXPECT_EQ(std::strtod(epochs.c_str() + epochs.find("0.333"), nullptr), third);
  EXPECT_EQ(record->summary({}, {})["epochs"], 3);
}

TEST_F(Record, EpochsHaveTextsInQuotes) {
  record->add_epoch({1}, 0, {{"volume.step", 0}}, {{"transfer", "0:#000000:0, 1:#ffffff:1"}});
  record->add_epoch({2}, 1, {{"volume.step", 1}}, {{"transfer", "a \"b\"\nc"}});
  record->add_epoch({3}, 2, {{"volume.step", 2}});
  EXPECT_EQ(text("epochs.csv"),
            "epoch,t_s,volume.step,transfer\n1,0.000000000,0,\"0:#000000:0, 1:#ffffff:1\"\n"
            "2,1.000000000,1,\"a \"\"b\"\" c\"\n3,2.000000000,2,\n");
}

TEST_F(Record, AssignmentSheetsAreKept) {
  EXPECT_FALSE(fs::exists(folder + "/run/assignment.csv")) << "meshes have none";
  record->add_assignment({{1, 0, "data-1", "sampler, \"the first\"", 0, 13, 4000}});
  record->add_assignment({{2, 3, "data-2", "sampler-2", 12, 24, 5}});
  EXPECT_EQ(text("assignment.csv"),
            "partition,round,data_server,sampler,begin,end,bytes\n"
            "1,0,\"data-1\",\"sampler, \"\"the first\"\"\",0,13,4000\n2,3,\"data-2\",\"sampler-2\",12,24,5\n");
}

TEST_F(Record, AFolderThatCannotBeMadeIsNamed) {
  std::ofstream(folder + "/file") << "x";
  const auto bad = RunRecord::open(folder + "/file/run");
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().text.find("/file/run"), std::string::npos);
}

// Messages are UTF-8, but names of files and flags may be anything.
TEST_F(Record, FilesAreUtf8WhateverNamesAre) {
  viewer.name = "viewer \xff";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "spans", {"caf\xe9"}, {0, 1, 1.5, 0, -1, -1, -1}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "caf\xe9"}, {0, 1}}));
  record->add_tile("sampler \xff", tile(1, 0, 1.0));
  record->add_epoch({1}, 0, {{"caf\xe9", 1}}, {{"transfer", "\xff"}});
  record->add_assignment({{1, 0, "data \xff", "sampler \xff", 0, 13, 4000}});
  ASSERT_TRUE(record->finish({viewer}, {}));
  record.reset();
  for (const auto& file : fs::directory_iterator(folder + "/run"))
    EXPECT_TRUE(valid_utf8(text(file.path().filename()))) << file.path();
  EXPECT_EQ(of_phase(nlohmann::json::parse(text("trace.json")), "X").at(0)["name"], "caf\xef\xbf\xbd");
  EXPECT_EQ(text("frames.csv"), "viewer,t_s,caf\xef\xbf\xbd\nviewer \xef\xbf\xbd,0.000000000,1\n");
}

TEST_F(Record, RefusalsAreUtf8) {
  const auto refused = record->add_rows(viewer, {{5}, "\xff", {"a"}, {1}});
  ASSERT_FALSE(refused);
  EXPECT_TRUE(valid_utf8(refused.error().text));
  // The name is cut short, within a character.
  const auto cut = record->add_rows(viewer, {{5}, std::string(31, 'x') + "\xc3\xa9", {"a"}, {1}});
  ASSERT_FALSE(cut);
  EXPECT_TRUE(valid_utf8(cut.error().text)) << cut.error().text;
}

}  // namespace
}  // namespace telesplat::metrics
