// A run in figures.
#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/unit/metrics/record_fixture.h"

namespace telesplat::metrics {
namespace {

// A master that stands still loses rows: the frames were displayed all the same.
TEST_F(Record, RowsThatNeverCameAreCountedByTheNumbersOfFrames) {
  const std::vector<std::string> columns{"frame", "t_s"};
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 1, 0.1, 2, 0.2, 6, 0.6}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {7, 0.7, 10, 1.0}}));
  // The viewer was restarted.
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 1, 0.1, 3, 0.3}}));
  const auto s = record->summary({}, {});
  EXPECT_EQ(s["errors"]["record_lost"]["frames.csv"], 3 + 2 + 1);
  EXPECT_EQ(s["frames"], 11 + 4);
  EXPECT_EQ(s["by_viewer"][viewer.name]["frames"], 11 + 4);
}

// Updates have no consecutive numbers: viewers report how many rows they have sent.
TEST_F(Record, RowsOfUpdatesThatNeverCameAreCountedByWhatViewersTell) {
  const auto tells = [&](double updates, double stages) {
    viewer.values = {{kUpdateRows, updates}, {kStageRows, stages}};
    record->add_status(viewer);
  };
  const auto came = [&](const char* table, size_t rows) {
    ASSERT_TRUE(record->add_rows(viewer, {{5}, table, {"latency_ms"}, std::vector<double>(rows, 9)}));
  };
  const auto lost = [&] { return record->summary({}, {})["errors"]["record_lost"]; };
  tells(100, 90);  // rows of the record before
  came("updates", 4), came("stages", 4);
  tells(104, 94);
  EXPECT_TRUE(lost().is_null());
  came("updates", 1);
  tells(111, 94);
  tells(111, 94);
  EXPECT_EQ(lost(), nlohmann::json({{"updates.csv", 6}}));
  came("updates", 2), came("stages", 1);
  tells(114, 99);
  EXPECT_EQ(lost(), nlohmann::json({{"stages.csv", 4}, {"updates.csv", 7}}));
  viewer.pid = 6;  // the viewer was restarted
  tells(0, 0);
  came("updates", 2);
  tells(3, 0);
  tells(1e300, -1);
  EXPECT_EQ(lost(), nlohmann::json({{"stages.csv", 4}, {"updates.csv", 8}}));
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
               {{"peak_rss_mb", 10}, {"messages_rejected", 2}, {"connections_refused", 4}, {"queue_refused", 1}}};
  Process old_packer{"packer",
                     "packer",
                     2,
                     {},
                     {{"points", 900},
                      {"model_bytes", 9000},
                      {"messages_rejected", 3},
                      {"connections_refused", 6},
                      {"messages_refused", 8}},
                     true};
  Process packer{"packer", "packer", 3, {}, {{"points", 1000}, {"model_bytes", 20000}, {"peak_rss_mb", 30}}};
  Process sampler{"sampler", "sampler-1", 4, {}, {{"peak_rss_mb", 40}}};
  Process killed{"viewer", "viewer-1", 5, {}, {}, true, true};
  ASSERT_TRUE(record->finish({data, killed, old_packer, packer, sampler, viewer},
                             {{"leases_expired", 4}, {"tiles_released", 6}}));
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
                          "renderer_ms",
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
                          "views_overtaken",
                          "packing_ms",
                          "data_generating_rate_mb_s",
                          "data_transfer_rate_mb_s",
                          "data_consuming_rate_mb_s",
                          "bytes_raw",
                          "bytes_sent",
                          "compression_ratio",
                          "redundancy_eliminated",
                          "errors_allowed",
                          "rays_cast",
                          "rays_full",
                          "rays_saved",
                          "plans",
                          "plans_late",
                          "plan_ms",
                          "plan_answer_ms",
                          "points_cached",
                          "points_drawn",
                          "tiles_released",
                          "quality",
                          "peak_rss_mb",
                          "errors"})
    EXPECT_TRUE(s.contains(key)) << key;
  EXPECT_EQ(s["primitives"], 1234);
  EXPECT_TRUE(s["label"].is_null());
  EXPECT_EQ(record->summary({}, {}, {.label = "before"})["label"], "before");
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
  EXPECT_EQ(s["limits"]["connections_refused"], 10);
  EXPECT_EQ(s["limits"]["messages_refused"], 8);
  EXPECT_EQ(s["limits"]["queue_refused"], 1);
  EXPECT_EQ(s["errors"]["leases_expired"], 4);
  EXPECT_EQ(s["errors"]["viewers_lost"], 1);
  EXPECT_EQ(s["peak_rss_mb"]["sampler"], nlohmann::json::array({40.0}));
  const std::string tiles = text("tiles.csv");
  EXPECT_EQ(std::count(tiles.begin(), tiles.end(), '\n'), 4);
}

TEST_F(Record, PredictionsOfViewersAreMeansOverAllThatWereMade) {
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "lead_ms", "missed"}, {0, 3, 0, 1, -2, 1, 2, 4, 2}}));
  Process first = viewer, second = viewer;
  first.facts["prediction"] = "kalman";
  first.values = {{"predictions", 10},        {"prediction_horizon_ms", 50}, {"prediction_error_mm", 2},
                  {"prediction_none_mm", 10}, {"prediction_error_deg", 0.5}, {"prediction_none_deg", 1}};
  second.values = {{"predictions", 30},        {"prediction_horizon_ms", 70}, {"prediction_error_mm", 4},
                   {"prediction_none_mm", 10}, {"prediction_error_deg", 0.5}, {"prediction_none_deg", 1}};
  const auto s = record->summary({first, second}, {});
  EXPECT_EQ(s["predicted_by"], "kalman");
  EXPECT_EQ(s["prediction"]["count"], 40);
  EXPECT_EQ(s["prediction"]["horizon_ms"], 65);
  EXPECT_EQ(s["prediction"]["error_mm"], 3.5);
  EXPECT_EQ(s["prediction"]["over_none_mm"], 0.35);
  EXPECT_EQ(s["prediction"]["over_none_deg"], 0.5);
  EXPECT_TRUE(s["pose_prediction"].is_null()) << "no tracker told poses";
  EXPECT_EQ(s["frames_late"], 1);
  EXPECT_EQ(s["refreshes_missed"], 3);
}

TEST_F(Record, TilesTellWhereTheyLieAndCoarseFramesAreNotTimed) {
  auto coarse = tile(1, 0, 0.5), fine = tile(2, 3, 1.0);
  coarse.step = 4;
  fine.rect = {0, 128, 640, 3};
  fine.moments.leased_s = 0.99;
  fine.rays = 700;
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
  EXPECT_NE(tiles.find("packed_s,published_s,x,y,width,height,step,rays,extra,"), std::string::npos);
  EXPECT_NE(tiles.find(",0,128,640,3,1,700,0,"), std::string::npos) << tiles;
  EXPECT_NE(tiles.find(",0,0,0,0,4,0,0,"), std::string::npos) << tiles;
}

TEST_F(Record, PlansSpareRays) {
  wire::PlanRequest asked{.frame = {1}, .epoch = {1}, .viewer = {5}, .request = {7}};
  asked.camera.width = 100, asked.camera.height = 50;
  wire::Plan plan{.frame = {1}, .epoch = {1}, .camera = asked.camera, .figures = {{"plan_ms", 8}, {"rays.edge", 40}}};
  const auto add = [&](double asked_s, double planned_s) {
    record->add_plan("v", metrics::row_of(asked, asked_s, plan, planned_s));
  };
  plan.tiles = {0, 0, 64, 32, 40, 1, 64, 0, 32, 32, 60, 2};
  plan.masks = {1, 2, 3};
  add(1, 1.010);  // frame 1: 100 rays
  asked.frame = {2}, plan.tiles = {}, plan.masks = {};
  add(2, 2.012);  // frame 2: none
  asked.frame = {3}, plan.full = true;
  add(3, 3.014);  // frame 3: all
  asked.frame = {4};
  record->add_plan("v", {.asked = asked, .asked_s = 4, .planned_s = 4.3});  // frame 4: all
  asked.frame = {5}, asked.extra = true, plan.full = false, plan.tiles = {0, 0, 64, 32, 700, 1}, plan.masks = {4};
  add(5, 5.1);  // 700 beyond
  const auto cast = [&](uint64_t frame, uint64_t rays, bool extra = false) {
    auto t = tile(frame, 0, 1.0);
    t.rays = rays, t.extra = extra;
    record->add_tile("a", t);
  };
  cast(1, 40), cast(1, 60), cast(3, 5000), cast(4, 5000), cast(5, 700, true);
  const auto s = record->summary({}, {});
  EXPECT_EQ(s["rays_cast"], 10800);
  EXPECT_EQ(s["rays_full"], 20000);
  EXPECT_DOUBLE_EQ(s["rays_saved"], 0.46);
  EXPECT_EQ(s["plans"], 5);
  EXPECT_EQ(s["plans_late"], 1);
  EXPECT_DOUBLE_EQ(s["plan_ms"]["median"], 8);
  EXPECT_NEAR(double(s["plan_answer_ms"]["median"]), 12, 1e-9) << "of views that were answered";
  ASSERT_TRUE(record->finish({}, {}));
  const std::string plans = text("plans.csv");
  EXPECT_TRUE(plans.starts_with("viewer,request,frame,epoch,extra,round,still,outcome,asked_s,planned_s,plan_ms,"))
      << plans;
  EXPECT_NE(plans.find("\"v\",7,1,1,0,0,0,tiles,1.000000000,1.010000000,8,2.000000,2,12,100,5000,,,40,"),
            std::string::npos)
      << plans;
  EXPECT_NE(plans.find(",2,1,0,0,0,empty,"), std::string::npos) << plans;
  EXPECT_NE(plans.find(",3,1,0,0,0,full,"), std::string::npos) << plans;
  EXPECT_NE(plans.find(",4,1,0,0,0,late,4.000000000,4.300000000,,,0,0,5000,5000,"), std::string::npos) << plans;
  EXPECT_NE(plans.find(",5,1,1,0,0,tiles,"), std::string::npos) << plans;
}

// Six frames; the third and fourth stand still. Figures by hand (Python's statistics module for the deviation).
TEST_F(Record, FramesOfAPictureThatStandsAreToldApart) {
  const std::vector<std::string> columns{
      "t_s", "inter_frame_ms", "construction_ms", "motion_to_photon_ms", "missed", "refresh_ms", "still"};
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0.00, 0,  8, 12, 0, 10, 0,  //
                                                                 0.01, 10, 6, 9,  0, 10, 0,  //
                                                                 0.02, 10, 0, -1, 0, 10, 1,  //
                                                                 0.03, 10, 0, -1, 0, 10, 1,  //
                                                                 0.05, 20, 9, 21, 1, 10, 0,  //
                                                                 0.08, 34, 9, 30, 2, 10, 0}}));
  const auto s = record->summary({viewer}, {});
  EXPECT_EQ(s["frames"], 6);
  EXPECT_EQ(s["frames_still"], 2);
  EXPECT_EQ(s["fps"], 66.67) << "4 frames in 80 - 20 ms";
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["frames_still"], 2);
  EXPECT_EQ(s["by_viewer"]["viewer-1"]["fps"], 66.67);
  EXPECT_EQ(s["inter_frame_delay_ms"]["mean"], 21.333) << "10, 20, 34";
  EXPECT_EQ(s["inter_frame_delay_ms"]["sd"], 12.055);
  EXPECT_EQ(s["inter_frame_jitter_ms"], 14) << "20 and 34 alone follow each other";
  EXPECT_EQ(s["view_construction_ms"]["mean"], 8);
  EXPECT_EQ(s["motion_to_photon_ms"]["mean"], 18);
  EXPECT_EQ(s["motion_to_photon_ms"]["median"], 16.5);
  EXPECT_EQ(s["refreshes_missed"], 3);
  EXPECT_TRUE(s["frames_late"].is_null()) << "there is no headset";
}

TEST_F(Record, WhatNoFrameHadIsNotMeasured) {
  const std::vector<std::string> columns{"t_s",    "inter_frame_ms", "motion_to_photon_ms",
                                         "missed", "refresh_ms",     "still"};
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 5, 0, 0, 0, 1, 9, -1, 0, 0, 1}}));
  const auto s = record->summary({viewer}, {});
  EXPECT_TRUE(s["fps"].is_null()) << "one frame was drawn";
  for (const char* key : {"inter_frame_delay_ms", "inter_frame_jitter_ms", "refreshes_missed"})
    EXPECT_TRUE(s[key].is_null()) << key;
  ASSERT_TRUE(record->finish({viewer}, {}));
  const std::string rows = text("frames.csv");
  EXPECT_NE(rows.find(",9,,0,0,1\n"), rows.npos) << "no motion in a picture that stands: " << rows;
}

TEST_F(Record, SaysHowEvenlySamplersWereBusy) {
  for (int i = 0; i < 10; ++i) record->add_tile("a", tile(1, uint64_t(i), i));
  for (int i = 0; i < 5; ++i) record->add_tile("b", tile(1, uint64_t(10 + i), i));
  auto backwards = tile(1, 15, 1);
  backwards.moments.encode_end_s = 0;
  record->add_tile("b", backwards);  // clocks that disagree
  const auto busy = record->summary({}, {})["samplers_busy"];
  EXPECT_NEAR(double(busy["busy_s"]["a"]), 0.12, 1e-9);
  EXPECT_NEAR(double(busy["busy_s"]["b"]), 0.06, 1e-9);
  EXPECT_NEAR(double(busy["spread"]), 0.06 / 0.09, 1e-4);
}

TEST_F(Record, ViewersAreCountedEachByItself) {
  Process second = viewer;
  second.name = "viewer-2";
  // The first shows 5 frames in 1 s. The second begins later and is restarted: 3 frames in 0.25 s, twice.
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

TEST_F(Record, TheViewerThatRecordsIntoTheFolderSaysWhatWasAsked) {
  Process guest = viewer, owner = viewer;
  guest.name = "a guest", guest.facts["records_in"] = "/elsewhere", guest.facts["width"] = "320";
  owner.name = "viewer", owner.facts["records_in"] = ".", owner.facts["width"] = "640";
  EXPECT_EQ(record->summary({guest, owner}, {})["size"][0], 640);
  EXPECT_EQ(record->summary({owner, guest}, {})["size"][0], 640);
  EXPECT_EQ(record->summary({guest}, {})["size"][0], 320);
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
  EXPECT_EQ(s["redundancy_eliminated"], nullptr) << "of slices nothing is eliminated";
  EXPECT_EQ(s["points_cached"], nullptr);
  EXPECT_EQ(s["data_generating_rate_mb_s"], 0.5);
  EXPECT_EQ(s["data_transfer_rate_mb_s"], 0.05);
  EXPECT_EQ(s["data_consuming_rate_mb_s"], 1);
  EXPECT_EQ(s["bytes_per_voxel"], 3);
  EXPECT_EQ(s["voxels_fetched"], 2000);
  EXPECT_EQ(s["partitions"], 2);
}

TEST_F(Record, OfARunWithoutAnythingHoldsNoResults) {
  const auto s = record->summary({}, {});
  for (const char* count : {"frames", "updates", "samplers", "viewers", "epochs"}) EXPECT_EQ(s[count], 0) << count;
  for (const char* key : {"id",
                          "version",
                          "begin",
                          "begin_monotonic_s",
                          "end",
                          "command",
                          "data",
                          "trajectory",
                          "scene",
                          "kind",
                          "primitives",
                          "coupling",
                          "buffers",
                          "renderer",
                          "renderer_ms",
                          "splat",
                          "finish",
                          "shading",
                          "size",
                          "sampling_size",
                          "sampling",
                          "coupling_changes",
                          "frames_by_coupling",
                          "swap_skew_ms",
                          "swaps",
                          "swaps_incomplete",
                          "duration_s",
                          "fps",
                          "updates_per_s",
                          "inter_frame_delay_ms",
                          "view_construction_ms",
                          "view_update_latency_ms",
                          "start_up_latency_ms",
                          "sampling_ms",
                          "lease_to_sampled_ms",
                          "packing_ms",
                          "data_generating_rate_mb_s",
                          "data_transfer_rate_mb_s",
                          "data_consuming_rate_mb_s",
                          "bytes_raw",
                          "bytes_sent",
                          "compression_ratio",
                          "redundancy_eliminated",
                          "rays_cast",
                          "rays_saved",
                          "plans",
                          "plan_ms",
                          "points_cached",
                          "bytes_per_cached_point",
                          "points_drawn",
                          "update_age_ms",
                          "voxels_fetched",
                          "bytes_per_voxel",
                          "partitions",
                          "first_points_s",
                          "quality"}) {
    ASSERT_TRUE(s.contains(key)) << key;
    EXPECT_TRUE(s[key].is_null()) << key << ": " << s[key];
  }
  EXPECT_TRUE(s["samplers_busy"]["spread"].is_null());
}

TEST_F(Record, CouplingsAreCountedForEachViewer) {
  const std::vector<std::string> columns{"t_s", "inter_frame_ms", "coupling", "buffers"};
  Process other = viewer;
  other.name = "viewer-2";
  // The first goes to sync and to loose; the second, with rows in between, stays asynchronous.
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 0, 0, 1, 9, 0, 0}}));
  ASSERT_TRUE(record->add_rows(other, {{6}, "frames", columns, {0, 0, 0, 0}}));
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {2, 9, 1, 1, 3, 9, 2, 3, 4, 9, 2, 4}}));
  const auto s = record->summary({viewer, other}, {}, {});
  EXPECT_EQ(s["coupling_changes"], 3);
  EXPECT_EQ(s["frames_by_coupling"],
            (nlohmann::ordered_json{{"async", 3}, {"sync", 1}, {"loose(3)", 1}, {"loose(4)", 1}}));
}

TEST_F(Record, AWallsFramesCountOnceForTheirSkew) {
  const std::vector<std::string> columns{"t_s", "inter_frame_ms", "wall_frame", "swap_skew_ms"};
  Process other = viewer;
  other.name = "viewer-2";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", columns, {0, 0, 1, 2, 1, 9, 2, 4, 2, 9, 3, -1}}));
  ASSERT_TRUE(record->add_rows(other, {{6}, "frames", columns, {0, 0, 1, 2, 1, 9, 2, 4, 2, 9, 0, 9}}));
  const auto s = record->summary({viewer, other}, {{"swaps_incomplete", 1}}, {});
  EXPECT_EQ(s["swaps"], 2);
  EXPECT_EQ(s["swap_skew_ms"]["median"], 3);
  EXPECT_EQ(s["swap_skew_ms"]["max"], 4);
  EXPECT_EQ(s["swaps_incomplete"], 1);
}

TEST_F(Record, TheSummarySaysWhatWasDone) {
  const Process master{"master",
                       "master",
                       1,
                       {{"host", "north"},
                        {"processor", "Some CPU"},
                        {"cores", "2"},
                        {"memory_mb", "8000"},
                        {"launched_by", "telesplat run 'a b.ply'"},
                        {"command", "telesplat-master"}},
                       {}};
  const Process data{"data",
                     "data",
                     2,
                     {{"host", "north"},
                      {"data_file", "/x/a b.ply"},
                      {"data_bytes", "123"},
                      {"data_hash", "xxh3:0f"},
                      {"remarks", "one\ntwo\n"}},
                     {}};
  const Process sampler{
      "sampler", "sampler-1", 3, {{"host", "south"}, {"gpu", "Some GPU"}, {"command", "s 'x y'"}}, {}};
  viewer.facts.insert({{"trajectory", "walk.csv"},
                       {"trajectory_file", "/x/walk.csv"},
                       {"trajectory_hash", "xxh3:1"},
                       {"duration_s", "2.5"},
                       {"frames", "0"},
                       {"hold_s", "1"},
                       {"verify_every", "30"}});
  const About about{"abc", "1.2.3", {}, 0, {{"packing.epsilon", 0.004}}};
  record = std::move(RunRecord::open(folder + "/run", {12.5, 1'700'000'000'123'456'789})).value();
  const auto s = record->summary({data, master, sampler, viewer}, {}, about);
  EXPECT_EQ(s["schema"], 2);
  EXPECT_EQ(s["id"], "abc");
  EXPECT_EQ(s["version"], "1.2.3");
  EXPECT_EQ(s["begin_monotonic_s"], 12.5);
  EXPECT_EQ(s["begin"], iso_time(1'700'000'000'123'456'789));
  EXPECT_NE(s["begin"].get<std::string>().find(":20.123456789"), std::string::npos) << s["begin"];
  EXPECT_EQ(s["command"], "telesplat run 'a b.ply'");
  ASSERT_EQ(s["machines"].size(), 2u);
  EXPECT_EQ(s["machines"][0]["host"], "north");
  EXPECT_EQ(s["machines"][0]["processor"], "Some CPU") << "whoever tells it: " << s["machines"];
  EXPECT_EQ(s["machines"][1]["gpu"], "Some GPU");
  EXPECT_EQ(s["data"]["file"], "/x/a b.ply");
  EXPECT_EQ(s["data"]["bytes"], 123);
  EXPECT_EQ(s["data"]["hash"], "xxh3:0f");
  EXPECT_EQ(s["data"]["remarks"], nlohmann::ordered_json({"one", "two"}));
  EXPECT_EQ(s["trajectory"]["hash"], "xxh3:1");
  EXPECT_EQ(s["asked"]["duration_s"], 2.5);
  EXPECT_EQ(s["asked"]["verify_every"], 30);
  EXPECT_EQ(s["settings"]["packing.epsilon"], 0.004);
  // Started by hand: each process has its own command line.
  EXPECT_EQ(record->summary({sampler}, {})["command"], nlohmann::ordered_json({{"sampler-1", "s 'x y'"}}));
}

TEST_F(Record, TheSummaryIsUtf8WhateverNamesAre) {
  const Process data{"data", "data", 1, {{"scene", "caf\xe9.ply"}, {"kind", "\xff"}}, {}};
  viewer.name = "viewer \xff";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s"}, {0, 1}}));
  record->add_tile("sampler \xff", tile(1, 0, 1.0));
  ASSERT_TRUE(record->finish({data, viewer}, {}));
  const auto s = nlohmann::json::parse(text("summary.json"));  // refuses invalid UTF-8
  EXPECT_EQ(s["scene"], "caf\xef\xbf\xbd.ply");
  EXPECT_EQ(s["by_viewer"]["viewer \xef\xbf\xbd"]["frames"], 2);
  EXPECT_TRUE(s["samplers_busy"]["busy_s"].contains("sampler \xef\xbf\xbd"));
}

}  // namespace
}  // namespace telesplat::metrics
