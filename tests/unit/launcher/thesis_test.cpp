// The thesis's tables and figures beside ours: its numbers, what stands for its data, timelines of traces, the report.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <set>

#include "tools/telesplat/bench/thesis/report.h"
#include "tools/telesplat/bench/thesis/timeline.h"
#include "tools/telesplat/bench/volume_report.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class ThesisFolder : public ::testing::Test {
 protected:
  ThesisFolder() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-thesis-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~ThesisFolder() override { fs::remove_all(folder); }
  void write(const std::string& file, const std::string& text) const {
    fs::create_directories(fs::path(folder + "/" + file).parent_path());
    std::ofstream(folder + "/" + file) << text;
  }
  std::string folder;
};

TEST(ThesisNumbers, AreThoseOfItsTables) {
  EXPECT_EQ(thesis_fps(VolumeTable::kFoot, 1, 1), 27);
  EXPECT_EQ(thesis_fps(VolumeTable::kFoot, 4, 4), 15);
  EXPECT_FALSE(thesis_fps(VolumeTable::kFoot, 5, 1));
  EXPECT_EQ(thesis_fps(VolumeTable::kTree, 4, 2), 12.3);
  EXPECT_EQ(thesis_fps(VolumeTable::kTree, 6, 1), 5.4);
  EXPECT_EQ(thesis_fps(VolumeTable::kTree, 6, 4), 5.3);
  EXPECT_FALSE(thesis_fps(VolumeTable::kTree, 6, 5));
  EXPECT_FALSE(thesis_fps(VolumeTable::kTree, 0, 1));
}

TEST(ThesisSteps, AreOfThePartsThatAreAskedFor) {
  const auto parts = parse_parts("7.3,6");
  ASSERT_TRUE(parts);
  size_t figures = 0, tables = 0;
  for (const Step& step : steps({"/data", false, *parts})) {
    figures += step.part == "6", tables += step.part == "7.3";
    EXPECT_TRUE(step.part == "6" || step.part == "7.3") << step.title;
  }
  EXPECT_EQ(figures, 3u);
  EXPECT_EQ(tables, 1u);
  EXPECT_EQ(parse_parts("7.5").error().text, "\"7.5\" is none of 6, 7.1, 7.2, 7.3, 7.4");
  EXPECT_FALSE(parse_parts(""));
}

TEST(ThesisSteps, ShortOnesTakeLessTimeAndNoTwoShareAFolder) {
  const auto all = steps({"/data", false, thesis_parts()}), quick = steps({"/data", true, thesis_parts()});
  ASSERT_EQ(all.size(), quick.size());
  std::set<std::string> folders, titles;
  for (size_t i = 0; i < all.size(); ++i) {
    EXPECT_EQ(all[i].title, quick[i].title);
    EXPECT_LE(quick[i].expected_s, all[i].expected_s);
    EXPECT_TRUE(folders.insert(all[i].folder).second) << all[i].folder;
    EXPECT_TRUE(titles.insert(all[i].title).second) << all[i].title;
    EXPECT_NE(all[i].arguments.empty(), all[i].direct.empty());
  }
}

constexpr const char* kTrace = R"([
  {"ph": "M", "pid": 1, "name": "process_name", "args": {"name": "viewer-1"}},
  {"ph": "M", "pid": 1, "tid": 2, "name": "thread_name", "args": {"name": "updates"}},
  {"ph": "M", "pid": 7, "name": "process_name", "args": {"name": "sampler-<1>"}},
  {"ph": "X", "pid": 7, "tid": 0, "name": "sample", "ts": 1000000, "dur": 50000},
  {"ph": "X", "pid": 7, "tid": 0, "name": "encode", "ts": 1050000, "dur": 10000},
  {"ph": "X", "pid": 1, "tid": 2, "name": "view update", "ts": 1000000, "dur": 100000},
  {"ph": "X", "pid": 1, "tid": 2, "name": "view update", "ts": 1050000, "dur": 100000},
  {"ph": "X", "pid": 1, "tid": 0, "name": "display frame", "ts": 3000000, "dur": 16000},
  {"ph": "i", "pid": 1, "name": "instant", "ts": 5}, 3, null])";

TEST_F(ThesisFolder, TracesAreReadByTheirNames) {
  write("list.json", kTrace);
  write("object.json", std::string("{\"traceEvents\": ") + kTrace + "}");
  for (const char* file : {"/list.json", "/object.json"}) {
    const auto lanes = read_timeline(folder + file);
    ASSERT_TRUE(lanes) << lanes.error().text;
    ASSERT_EQ(lanes->size(), 3u);
    EXPECT_EQ((*lanes)[0].process, "sampler-<1>");
    EXPECT_EQ((*lanes)[0].lane, "encode, sample") << "a lane without a name is called by what is in it";
    EXPECT_EQ((*lanes)[1].process, "viewer-1");
    EXPECT_EQ((*lanes)[1].lane, "updates");
    ASSERT_EQ((*lanes)[1].spans.size(), 2u);
    EXPECT_DOUBLE_EQ((*lanes)[1].spans[1].begin_s, 1.05);
    EXPECT_DOUBLE_EQ((*lanes)[1].spans[1].end_s, 1.15);
  }
  write("bad.json", "{\"a\": 1");
  EXPECT_FALSE(read_timeline(folder + "/bad.json"));
  EXPECT_FALSE(read_timeline(folder + "/none.json"));
}

TEST_F(ThesisFolder, SpansThatOverlapMayComeAsBeginAndEnd) {
  write("trace.json", R"([{"ph": "b", "pid": 1, "tid": 2, "cat": "u", "id": 1, "name": "view update", "ts": 1000000},
                          {"ph": "b", "pid": 1, "tid": 2, "cat": "u", "id": 2, "name": "view update", "ts": 1100000},
                          {"ph": "e", "pid": 1, "tid": 2, "cat": "u", "id": 2, "name": "view update", "ts": 1200000},
                          {"ph": "e", "pid": 1, "tid": 2, "cat": "u", "id": 1, "name": "view update", "ts": 1300000},
                          {"ph": "e", "pid": 1, "tid": 2, "cat": "u", "id": 3, "name": "view update", "ts": 1400000}])");
  const auto lanes = read_timeline(folder + "/trace.json");
  ASSERT_TRUE(lanes);
  ASSERT_EQ(lanes->size(), 1u);
  ASSERT_EQ((*lanes)[0].spans.size(), 2u) << "an end without a begin is none";
  EXPECT_DOUBLE_EQ((*lanes)[0].spans[0].begin_s, 1.0);
  EXPECT_DOUBLE_EQ((*lanes)[0].spans[0].end_s, 1.3);
}

TEST_F(ThesisFolder, ATimelineShowsWhatHappenedInItsPart) {
  write("trace.json", kTrace);
  const auto lanes = read_timeline(folder + "/trace.json");
  ASSERT_TRUE(lanes);
  const auto count = [](const std::string& text, const std::string& what) {
    size_t out = 0;
    for (size_t at = text.find(what); at != text.npos; at = text.find(what, at + 1)) ++out;
    return out;
  };
  const std::string svg = timeline_svg(*lanes, {1, 1.2}, "a & b");
  EXPECT_EQ(count(svg, "class=\"bar "), 4u) << "two updates, sample, encode; the frame is later";
  EXPECT_NE(svg.find("sampler-&lt;1&gt;: encode, sample"), std::string::npos);
  EXPECT_NE(svg.find("a &amp; b"), std::string::npos);
  EXPECT_EQ(count(svg, ">view update</text>"), 1u) << "the legend";
  EXPECT_EQ(count(svg, "viewer-1"), 1u) << "updates that overlap have one name, and rows of their own";
  const TimeSpan part = steady_part(*lanes);
  EXPECT_NEAR(part.begin_s, 1 + 0.6 * 2.016, 1e-9);
  EXPECT_NEAR(part.end_s - part.begin_s, 0.4, 1e-9) << "four view updates";
}

TEST_F(ThesisFolder, TheReportHasTheThesissNumbersBesideOurs) {
  write("table-7.1/bone/summary.json", R"({"primitives": 717558, "fps": 42.25, "updates_per_s": 3.5})");
  write("table-7.1/bone-direct/direct.json", R"({"fps": 1.75})");
  write("table-7.2/scaling.csv",
        "series,simulated,row_seconds,nodes,frames,time_s,speed_up,efficiency,thesis_s,thesis_efficiency\n"
        "thesis rows,1,69.3,1,1,69.4,1,1,69.3,1\nthesis rows,1,69.3,40,1,1.77,39.2,0.98,1.76,0.98\n");
  write("table-7.3/volume.csv",
        "simulated,samplers,viewers,fps,least_fps,sampling_ms,packing_ms,construction_ms,bytes_per_frame\n"
        "1,2,3,33.25,33,1,1,1,1\n0,2,3,7.75,7,1,1,1,1\n");
  const ThesisReport report = read_results(folder, thesis_parts(), false, 2);
  ASSERT_EQ(report.tables.size(), 4u);
  ASSERT_EQ(report.figures.size(), 3u);
  const std::string text = to_markdown(report);
  EXPECT_NE(text.find("| Bone, skin, head together | 1.2 M | 4 | 18 | bone | 0.72 M | 1.75 | 42.2 | 3.50 |"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("| Skull | 0.45 M | 12 | 20 | cranium | - | - | - | - | another skull |"), std::string::npos);
  EXPECT_NE(text.find("| 40 | 1.76 | 98.4 % | 1.770 | 98.0 % |"), std::string::npos) << text;
  EXPECT_NE(text.find("| 3 | thesis | 27 | 24 | 20 | 17 |"), std::string::npos);
  EXPECT_NE(text.find("|  | ours, SIMULATED | - | 33.2 | - | - |"), std::string::npos) << text;
  EXPECT_NE(text.find("|  | ours, computed | - | 7.8 | - | - |"), std::string::npos) << text;
  EXPECT_NE(text.find("| 4 | thesis | 3.2 | 5.6 | 8.7 | 11.8 | 8.4 | 5.3 |"), std::string::npos);
  EXPECT_EQ(report.tables[2].rows.size(), 12u) << "4 clients, three rows each";
  EXPECT_EQ(report.tables[3].head.size(), 8u) << "6 servers";
  // Every table says what is not real.
  for (size_t i = 1; i < 4; ++i) EXPECT_NE(to_text({{}, {report.tables[i]}, {}}).find("SIMULATED"), std::string::npos);
  EXPECT_NE(to_html(report).find("<td>33.2</td>"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::launcher
