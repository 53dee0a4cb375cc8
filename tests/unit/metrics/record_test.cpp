// Distributions, recorders and the files of a run.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "common/metrics/recorder.h"
#include "common/metrics/run_record.h"

namespace telesplat::metrics {
namespace {

namespace fs = std::filesystem;

TEST(Distribution, PercentilesInterpolateBetweenRanks) {
  std::vector<double> values;
  for (int i = 100; i >= 0; --i) values.push_back(i);
  const auto d = distribution(values);
  EXPECT_DOUBLE_EQ(d.mean, 50);
  EXPECT_DOUBLE_EQ(d.median, 50);
  EXPECT_DOUBLE_EQ(d.p95, 95);
  EXPECT_DOUBLE_EQ(d.p99, 99);
  EXPECT_DOUBLE_EQ(d.max, 100);
  EXPECT_DOUBLE_EQ(distribution({1, 2}).median, 1.5);
  EXPECT_DOUBLE_EQ(distribution({1, 2}).p95, 1.95);
  EXPECT_DOUBLE_EQ(distribution({7}).p99, 7);
  EXPECT_DOUBLE_EQ(distribution({}).max, 0);
  const double nan = std::numeric_limits<double>::quiet_NaN(), infinity = std::numeric_limits<double>::infinity();
  EXPECT_DOUBLE_EQ(distribution({nan, 3, infinity, -infinity}).mean, 3);
}

TEST(Recorders, GiveWhatCameSinceTheLastTime) {
  TableRecorder table("frames", {"a", "b"});
  EXPECT_FALSE(table.flush({1}));
  table.add({1, 2});
  table.add({3, 4});
  const auto rows = table.flush({9});
  ASSERT_TRUE(rows);
  EXPECT_EQ(rows->values, (std::vector<double>{1, 2, 3, 4}));
  EXPECT_EQ(rows->columns, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(rows->instance.value, 9u);
  EXPECT_FALSE(table.flush({9}));
  SpanRecorder spans;
  spans.add("one", 1, 2);
  spans.add("two", 2, 3, 5);
  spans.add("one", 3, 4);
  const auto s = spans.flush({9});
  ASSERT_TRUE(s);
  EXPECT_EQ(s->columns, (std::vector<std::string>{"one", "two"}));
  EXPECT_EQ(s->values, (std::vector<double>{0, 1, 2, 0, 1, 2, 3, 5, 0, 3, 4, 0}));
}

TEST(Recorders, AreBoundedWhileTheMasterIsAway) {
  TableRecorder table("frames", {"a"});
  for (int i = 0; i < (1 << 20) + 1000; ++i) table.add({double(i)});
  EXPECT_EQ(table.flush({1})->values.size(), size_t{1} << 20);
}

class Record : public ::testing::Test {
 protected:
  Record() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-record-XXXXXX").string();
    folder = mkdtemp(pattern.data());
    record = std::move(RunRecord::open(folder + "/run")).value();
  }
  ~Record() override { fs::remove_all(folder); }
  std::string text(const std::string& name) const {
    std::ifstream in(folder + "/run/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static wire::TileDone tile(uint64_t frame, uint64_t number, double begin_s) {
    wire::TileDone t;
    t.frame = {frame};
    t.tile = number;
    t.samples = 1000;
    t.kept = 100;
    t.bytes_sampled = 4000;
    t.bytes_sent = 500;
    t.sample_begin_s = begin_s;
    t.sample_end_s = begin_s + 0.010;
    t.encode_end_s = begin_s + 0.012;
    t.receive_s = begin_s + 0.013;
    t.packed_s = begin_s + 0.018;
    return t;
  }

  std::string folder;
  std::unique_ptr<RunRecord> record;
  Process viewer{"viewer", "viewer-1", 5, {{"coupling", "async"}, {"width", "640"}}, {{"peak_rss_mb", 20}}};
};

TEST_F(Record, TablesBecomeCsv) {
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"frame", "t_s"}, {0, 0.25, 1, 1e-7}}));
  viewer.name = "viewer-2";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"frame", "t_s"}, {0, 123456.789}}));
  EXPECT_EQ(text("frames.csv"), "viewer,frame,t_s\nviewer-1,0,0.25\nviewer-1,1,1e-07\nviewer-2,0,123456.789\n");
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
  ASSERT_TRUE(
      record->add_rows(viewer, {{5}, "spans", {"sample", "a \"quoted\"\nname"}, {0, 1, 1.5, 0, 1, 2, 2.25, 3}}));
  ASSERT_TRUE(
      record->add_rows(viewer, {{5}, "spans", {"sample"}, {7, 1, 1.5, 0, -1, 1, 2, 0}}));  // names that are not there
  record.reset();
  const auto trace = nlohmann::json::parse(text("trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array());
  ASSERT_EQ(trace.size(), 3u);
  EXPECT_EQ(trace[0]["ph"], "M");
  EXPECT_EQ(trace[0]["args"]["name"], "viewer-1");
  EXPECT_EQ(trace[1]["name"], "sample");
  EXPECT_EQ(trace[1]["ts"], 1e6);
  EXPECT_EQ(trace[1]["dur"], 5e5);
  EXPECT_EQ(trace[1]["pid"], 5);
  EXPECT_EQ(trace[2]["tid"], 3);
}

TEST_F(Record, ATraceWithoutSpansIsValidToo) {
  record.reset();
  EXPECT_EQ(nlohmann::json::parse(text("trace.json"), nullptr, false), nlohmann::json::array());
}

TEST_F(Record, TheSummaryIsCompleteAndTrue) {
  ASSERT_TRUE(record->add_rows(viewer, {{5},
                                        "frames",
                                        {"t_s", "inter_frame_ms", "construction_ms", "points_drawn", "update_age_ms"},
                                        {0, 0, 5, 100, 50, 1, 20, 6, 200, 60, 2, 30, 7, 300, 70}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "updates", {"latency_ms", "start_up_ms"}, {200, 50, 300, 60}}));
  record->add_tile("sampler-1", tile(1, 0, 1.0));
  record->add_tile("sampler-2", tile(1, 1, 1.005));
  record->add_tile("sampler-1", tile(2, 0, 2.0));
  Process data{"data",
               "data",
               1,
               {{"scene", "hill.ply"}, {"kind", "mesh"}, {"triangles", "1234"}},
               {{"peak_rss_mb", 10}, {"messages_rejected", 2}}};
  Process old_packer{"packer", "packer", 2, {}, {{"points", 900}, {"model_bytes", 9000}, {"messages_rejected", 3}},
                     true};
  Process packer{"packer", "packer", 3, {}, {{"points", 1000}, {"model_bytes", 20000}, {"peak_rss_mb", 30}}};
  Process sampler{"sampler", "sampler-1", 4, {}, {{"peak_rss_mb", 40}}};
  ASSERT_TRUE(
      record->finish({data, old_packer, packer, sampler, viewer}, {{"leases_expired", 4}, {"tiles_released", 6}}));
  const auto s = nlohmann::json::parse(text("summary.json"), nullptr, false);
  ASSERT_TRUE(s.is_object());
  for (const char* key : {"schema",
                          "scene",
                          "kind",
                          "primitives",
                          "samplers",
                          "viewers",
                          "coupling",
                          "buffers",
                          "renderer",
                          "splat",
                          "size",
                          "sampling_size",
                          "frames",
                          "updates",
                          "fps",
                          "inter_frame_delay_ms",
                          "view_construction_ms",
                          "view_update_latency_ms",
                          "start_up_latency_ms",
                          "sampling_ms",
                          "lease_to_sampled_ms",
                          "samplers_busy",
                          "epochs",
                          "leases_backup",
                          "packing_ms",
                          "data_generating_rate_mb_s",
                          "data_transfer_rate_mb_s",
                          "data_consuming_rate_mb_s",
                          "bytes_raw",
                          "bytes_sent",
                          "compression_ratio",
                          "redundancy_eliminated",
                          "points_cached",
                          "points_drawn",
                          "tiles_released",
                          "quality",
                          "peak_rss_mb",
                          "errors"})
    EXPECT_TRUE(s.contains(key)) << key;
  EXPECT_EQ(s["primitives"], 1234);
  EXPECT_EQ(s["samplers"], 1);
  EXPECT_EQ(s["frames"], 3);
  EXPECT_EQ(s["fps"], 1.5);
  EXPECT_EQ(s["inter_frame_delay_ms"]["mean"], 25) << "the first frame has no delay";
  EXPECT_EQ(s["view_update_latency_ms"]["max"], 300);
  EXPECT_EQ(s["sampling_ms"]["max"], 17) << "from the frame's first tile to its last";
  EXPECT_EQ(s["packing_ms"]["max"], 10);
  EXPECT_NEAR(double(s["redundancy_eliminated"]), 0.9, 1e-12);
  EXPECT_EQ(s["bytes_sent"], 1500);
  EXPECT_EQ(s["points_cached"], 1000) << "what the packer's former life held is gone";
  EXPECT_EQ(s["bytes_per_cached_point"], 20);
  EXPECT_EQ(s["tiles_released"], 6);
  EXPECT_EQ(s["errors"]["messages_rejected"], 5) << "what it counted stays counted";
  EXPECT_EQ(s["errors"]["leases_expired"], 4);
  EXPECT_EQ(s["peak_rss_mb"]["sampler"], nlohmann::json::array({40.0}));
  const std::string tiles = text("tiles.csv");
  EXPECT_EQ(std::count(tiles.begin(), tiles.end(), '\n'), 4);
}

TEST_F(Record, TilesTellWhereTheyLieAndCoarseFramesAreNotTimed) {
  auto coarse = tile(1, 0, 0.5), fine = tile(2, 3, 1.0);
  coarse.step = 4;
  fine.rect = {0, 128, 640, 3};
  fine.leased_s = 0.99;
  record->add_tile("a", coarse);
  record->add_tile("a", fine);
  const auto s = record->summary({}, {});
  EXPECT_EQ(s["sampling_ms"]["max"], 12);
  EXPECT_EQ(s["lease_to_sampled_ms"]["max"], 22);
  EXPECT_EQ(s["packing_ms"]["max"], 5);
  EXPECT_EQ(s["bytes_sent"], 1000) << "what coarse frames sent counts";
  ASSERT_TRUE(record->finish({}, {}));
  const std::string tiles = text("tiles.csv");
  EXPECT_TRUE(tiles.starts_with("frame,tile,lease,sampler,samples,")) << tiles;
  EXPECT_NE(tiles.find("packed_s,x,y,width,height,step\n"), std::string::npos);
  EXPECT_NE(tiles.find(",0,128,640,3,1\n"), std::string::npos) << tiles;
  EXPECT_NE(tiles.find(",0,0,0,0,4\n"), std::string::npos) << tiles;
}

TEST_F(Record, SaysHowEvenlySamplersWereBusy) {
  for (int i = 0; i < 10; ++i) record->add_tile("a", tile(1, uint64_t(i), i));
  for (int i = 0; i < 5; ++i) record->add_tile("b", tile(1, uint64_t(10 + i), i));
  auto backwards = tile(1, 15, 1);
  backwards.encode_end_s = 0;
  record->add_tile("b", backwards);  // clocks that disagree
  const auto busy = record->summary({}, {})["samplers_busy"];
  EXPECT_NEAR(double(busy["busy_s"]["a"]), 0.12, 1e-9);
  EXPECT_NEAR(double(busy["busy_s"]["b"]), 0.06, 1e-9);
  EXPECT_NEAR(double(busy["spread"]), 0.06 / 0.09, 1e-4);
}

TEST_F(Record, EpochsCanBeMadeAgain) {
  const double third = 1.0 / 3;
  record->add_epoch({1}, 0.5, {{"c.x", third}, {"iterations", 64}});
  record->add_epoch({2}, 1.25, {{"c.x", -1e-9}, {"iterations", 65}, {"new", 1}});
  record->add_epoch({4}, 2, {{"iterations", 66}});
  const std::string epochs = text("epochs.csv");
  EXPECT_EQ(epochs,
            "epoch,t_s,c.x,iterations\n1,0.500000,0.3333333333333333,64\n2,1.250000,-1e-09,65\n4,2.000000,,66\n");
  EXPECT_EQ(std::strtod(epochs.c_str() + epochs.find("0.333"), nullptr), third);
  EXPECT_EQ(record->summary({}, {})["epochs"], 3);
}

TEST_F(Record, EpochsHaveTextsInQuotes) {
  record->add_epoch({1}, 0, {{"volume.step", 0}}, {{"transfer", "0:#000000:0, 1:#ffffff:1"}});
  record->add_epoch({2}, 1, {{"volume.step", 1}}, {{"transfer", "a \"b\"\nc"}});
  record->add_epoch({3}, 2, {{"volume.step", 2}});
  EXPECT_EQ(text("epochs.csv"),
            "epoch,t_s,volume.step,transfer\n1,0.000000,0,\"0:#000000:0, 1:#ffffff:1\"\n"
            "2,1.000000,1,\"a \"\"b\"\" c\"\n3,2.000000,2,\n");
}

TEST_F(Record, AssignmentSheetsAreKept) {
  EXPECT_FALSE(fs::exists(folder + "/run/assignment.csv")) << "meshes have none";
  record->add_assignment({{1, 0, "data-1", "sampler, \"the first\"", 0, 13, 4000}});
  record->add_assignment({{2, 3, "data-2", "sampler-2", 12, 24, 5}});
  EXPECT_EQ(text("assignment.csv"),
            "partition,round,data_server,sampler,begin,end,bytes\n"
            "1,0,\"data-1\",\"sampler, \"\"the first\"\"\",0,13,4000\n2,3,\"data-2\",\"sampler-2\",12,24,5\n");
}

TEST_F(Record, ViewersAreCountedEachByItself) {
  Process second = viewer;
  second.name = "viewer-2";
  // The first shows 5 frames in 1 s, the second, which begins later and is started again, 3 frames in 0.25 s and 3 in 0.25 s.
  const std::vector<std::string> columns{"t_s", "inter_frame_ms"};
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 0.25, 250, 0.5, 250, 0.75, 250, 1, 250}}));
  ASSERT_TRUE(record->add_rows(second, {{6}, "frames", columns, {0, 0, 0.125, 125, 0.25, 125}}));
  ASSERT_TRUE(record->add_rows(second, {{7}, "frames", columns, {0, 0, 0.125, 125, 0.25, 125}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "updates", {"latency_ms", "points"}, {100, 1000, 200, 3000}}));
  ASSERT_TRUE(record->add_rows(second, {{6}, "updates", {"latency_ms", "points"}, {50, 6000}}));
  const auto s = record->summary({viewer, second}, {{"frames_completed", 3}});
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["fps"], 5);
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["updates_per_s"], 2);
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["view_update_latency_ms"]["mean"], 150);
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["inter_frame_delay_ms"]["max"], 250);
  EXPECT_EQ(s["by_viewer"]["viewer-2"]["frames"], 6);
  EXPECT_EQ(s["by_viewer"]["viewer-2"]["duration_s"], 0.5) << "of both its lives";
  EXPECT_EQ(s["by_viewer"]["viewer-2"]["fps"], 12);
  EXPECT_EQ(s["by_viewer"]["viewer-2"]["inter_frame_delay_ms"]["max"], 125);
  EXPECT_EQ(s["fps"], 8.5) << "the mean over viewers";
  EXPECT_EQ(s["updates_per_s"], 2);
  EXPECT_EQ(s["frames"], 11);
  EXPECT_EQ(s["updates"], 3);
  EXPECT_EQ(s["duration_s"], 1);
  EXPECT_EQ(s["frames_sampled"], 3);
}

TEST_F(Record, OfAVolumeCountsVoxelsAndPixels) {
  Process data{
      "data", "data-1", 1, {{"kind", "volume"}, {"voxels", "16777216"}}, {{"bytes_sent", 3000}, {"voxels_sent", 1000}}};
  Process more{
      "data", "data-2", 2, {{"kind", "volume"}, {"voxels", "16777216"}}, {{"bytes_sent", 3000}, {"voxels_sent", 1000}}};
  viewer.facts["coupling"] = "loose";
  viewer.facts["buffers"] = "3";
  auto slab = tile(1, 0, 1.0);
  slab.samples = 50000;  // voxels
  slab.kept = 250'000;   // pixels
  slab.bytes_sent = 100'000;
  record->add_tile("sampler-1", slab);
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s"}, {0, 2}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "updates", {"latency_ms", "points"}, {100, 100'000, 200, 400'000}}));
  const auto s = record->summary({data, more, viewer}, {{"partitions", 2}});
  EXPECT_EQ(s["kind"], "volume");
  EXPECT_EQ(s["primitives"], 16777216);
  EXPECT_EQ(s["coupling"], "loose");
  EXPECT_EQ(s["buffers"], 3);
  EXPECT_EQ(s["bytes_raw"], 1'000'000) << "four bytes a pixel";
  EXPECT_EQ(s["compression_ratio"], 10);
  EXPECT_EQ(s["redundancy_eliminated"], 0);
  EXPECT_EQ(s["data_generating_rate_mb_s"], 0.5);
  EXPECT_EQ(s["data_transfer_rate_mb_s"], 0.05);
  EXPECT_EQ(s["data_consuming_rate_mb_s"], 1);
  EXPECT_EQ(s["bytes_per_voxel"], 3);
  EXPECT_EQ(s["voxels_fetched"], 2000);
  EXPECT_EQ(s["partitions"], 2);
}

TEST_F(Record, OfARunWithoutAnythingHoldsZeros) {
  const auto s = record->summary({}, {});
  EXPECT_EQ(s["frames"], 0);
  EXPECT_EQ(s["fps"], 0);
  EXPECT_EQ(s["redundancy_eliminated"], 0);
  EXPECT_EQ(s.dump().find("null,\"peak"), s.dump().find("null")) << "only quality is null: " << s.dump();
}

TEST_F(Record, AFolderThatCannotBeMadeIsNamed) {
  std::ofstream(folder + "/file") << "x";
  const auto bad = RunRecord::open(folder + "/file/run");
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().text.find("/file/run"), std::string::npos);
}

}  // namespace
}  // namespace telesplat::metrics
