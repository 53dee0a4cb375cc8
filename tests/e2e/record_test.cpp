// A whole run, and what it leaves behind.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "client/viewer/points/base_replica.h"
#include "client/viewer/record/record_file.h"
#include "common/core/file_hash.h"
#include "common/wire/serial.h"
#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

void expect_distribution(const nlohmann::json& d, const std::string& name) {
  for (const char* key : {"mean", "median", "p95", "p99", "max", "sd"})
    ASSERT_TRUE(d.contains(key) && d[key].is_number()) << name << "." << key;
  EXPECT_LE(d["median"], d["p95"]) << name;
  EXPECT_LE(d["p95"], d["p99"]) << name;
  EXPECT_LE(d["p99"], d["max"]) << name;
}

// The base came to the viewer down to the mesh itself, as its record of events has it.
void expect_whole_base(const PipelineRun& run) {
  auto file = viewer::RecordReader::open(run.out() + "/points.events", {"TSEVENT5"}, "a record of point-model events");
  viewer::BaseReplica base([](const wire::BaseRequest&) {});
  while (file->next()) {
    const auto body = std::as_bytes(std::span(file->body()));
    if (file->type() == wire::BaseTree::kName) base.take(*wire::decode<wire::BaseTree>(body), 0);
    if (file->type() != wire::BasePart::kName) continue;
    EXPECT_TRUE(base.take(*wire::decode<wire::BasePart>(body), 0).ok());
  }
  const auto mesh = base.mesh();
  ASSERT_TRUE(mesh);
  EXPECT_EQ(mesh->roots, 1u);
  EXPECT_TRUE(std::ranges::any_of(mesh->nodes, [](const auto& node) { return node.error_m == 0; }));
}

TEST(Record, EveryFileIsThereAndTrue) {
  auto flags = kComesToRest;
  flags.insert(flags.end(), {"--verify", "60", "--record-every", "60"});
  PipelineRun run(flags);
  ASSERT_TRUE(run.wait_at_rest()) << run.program().err();
  ASSERT_EQ(run.stop(), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  for (const char* name : {"session.toml", "frames.csv", "updates.csv", "tiles.csv", "trace.json", "summary.json",
                           "quality.csv", "images/frame-000000.png", "logs/viewer-1.log"})
    EXPECT_TRUE(fs::exists(run.out() + "/" + name)) << name;
  EXPECT_FALSE(fs::exists(run.out() + "/spool"));
  expect_whole_base(run);

  const auto s = run.summary();
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
                          "data_generating_rate_mb_s",
                          "data_transfer_rate_mb_s",
                          "data_consuming_rate_mb_s",
                          "bytes_raw",
                          "bytes_sent",
                          "compression_ratio",
                          "redundancy_eliminated",
                          "points_cached",
                          "tiles_released",
                          "quality",
                          "peak_rss_mb",
                          "errors"})
    EXPECT_TRUE(s.contains(key)) << key;
  for (const char* key :
       {"motion_to_photon_ms", "inter_frame_delay_ms", "view_construction_ms", "view_update_latency_ms",
        "start_up_latency_ms", "sampling_ms", "packing_ms", "points_drawn"}) {
    ASSERT_TRUE(s.contains(key)) << key;
    expect_distribution(s[key], key);
    EXPECT_GT(s[key]["max"], 0) << key;
  }
  EXPECT_EQ(s["schema"], 2);
  for (const char* key : {"id", "version", "begin", "begin_monotonic_s", "end", "command", "trajectory"})
    EXPECT_FALSE(s[key].is_null()) << key;
  EXPECT_NE(s["command"].get<std::string>().find("--verify 60"), std::string::npos) << s["command"];
  ASSERT_EQ(s["machines"].size(), 1u);
  EXPECT_GT(s["machines"][0]["cores"], 0);
  EXPECT_EQ(s["machines"][0]["processes"].size(), 5u);
  EXPECT_EQ(s["data"]["file"], run.folder() / "terrain.ply");
  EXPECT_EQ(s["data"]["bytes"], fs::file_size(run.folder() / "terrain.ply"));
  EXPECT_EQ(s["data"]["hash"], hash_text(hash_of_files({run.folder() / "terrain.ply"})->hash));
  EXPECT_EQ(s["asked"]["duration_s"], 60);
  EXPECT_EQ(s["asked"]["hold_s"], 58);
  EXPECT_EQ(s["asked"]["verify_every"], 60);
  EXPECT_EQ(s["kind"], "mesh");
  EXPECT_EQ(s["scene"], "terrain.ply");
  EXPECT_EQ(s["primitives"], 20000);
  EXPECT_EQ(s["samplers"], 1);
  EXPECT_EQ(s["viewers"], 1);
  EXPECT_EQ(s["coupling"], "async");
  EXPECT_EQ(s["size"], nlohmann::json({480, 300}));
  EXPECT_EQ(s["sampling_size"], nlohmann::json({320, 200}));
  EXPECT_GT(s["points_cached"], 1000);
  EXPECT_GT(s["redundancy_eliminated"], 0.1);
  EXPECT_LE(s["redundancy_eliminated"], 1.0);
  EXPECT_GT(s["compression_ratio"], 2);
  EXPECT_LT(s["bytes_sent"], s["bytes_raw"]);
  EXPECT_EQ(s["errors"]["messages_rejected"], 0);
  for (const char* role : {"master", "data", "packer"}) EXPECT_GT(s["peak_rss_mb"][role], 1) << role;
  EXPECT_EQ(s["peak_rss_mb"]["sampler"].size(), 1u);
  EXPECT_EQ(s["peak_rss_mb"]["viewer"].size(), 1u);

  // The tables agree with the summary.
  EXPECT_GT(s["frames"], 5);
  EXPECT_GT(s["updates"], 0);
  EXPECT_EQ(run.column("frames.csv", "t_s").size(), s["frames"]);
  EXPECT_EQ(run.column("updates.csv", "latency_ms").size(), s["updates"]);
  const auto samples = run.column("tiles.csv", "samples"), kept = run.column("tiles.csv", "kept");
  ASSERT_FALSE(samples.empty());
  double sampled = 0, packed = 0;
  for (size_t i = 0; i < samples.size(); ++i) sampled += samples[i], packed += kept[i];
  EXPECT_NEAR(double(s["redundancy_eliminated"]), 1 - packed / sampled, 1e-9);
  for (const double t : run.column("updates.csv", "latency_ms")) EXPECT_GT(t, 0);
  // Poses of a trajectory are those of the moment at which a frame begins.
  const auto still = run.column("frames.csv", "still"), seen = run.column("frames.csv", "motion_to_photon_ms"),
             drawn = run.column("frames.csv", "construction_ms"), presented = run.column("frames.csv", "present_ms");
  EXPECT_EQ(std::count(still.begin(), still.end(), 1.0), s["frames_still"]);
  for (size_t i = 0; i < still.size(); ++i) {
    EXPECT_GE(seen[i], still[i] != 0 ? 0 : drawn[i]) << "frame " << i;
    EXPECT_LE(seen[i], still[i] != 0 ? 0 : drawn[i] + presented[i] + 1e-3) << "frame " << i;
  }
  // The runs of these tests have 30 frames a second.
  for (const double ms : run.column("frames.csv", "refresh_ms")) EXPECT_NEAR(ms, 1000.0 / 30, 1e-9);

  const auto& q = s["quality"];
  ASSERT_TRUE(q.is_object());
  EXPECT_GE(q["views"], 2);
  for (const char* key : {"psnr_db", "ssim", "flip", "hole_fraction", "flicker", "popping"})
    expect_distribution(q[key], key);
  EXPECT_EQ(q["samples"], 16);
  EXPECT_GT(q["flicker"]["max"], 0) << "every verified frame is compared with the next one";
  EXPECT_GT(q["psnr_db"]["median"], 20);
  EXPECT_LT(q["last_view"]["hole_fraction"], 0.02);
  EXPECT_GT(q["last_view"]["psnr_db"], 22);

  // Every span of every process, on one clock.
  const auto trace = nlohmann::json::parse(read_text(run.out() + "/trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array());
  std::map<std::string, int> spans;
  for (const auto& e : trace)
    if (e["ph"] == "X" || e["ph"] == "b") {
      ++spans[e["name"]];
      if (e["ph"] == "X") EXPECT_GE(e["dur"], 0);
    }
  for (const char* name : {"sample", "encode", "pack", "decode", "insert", "display frame", "view update"})
    EXPECT_GT(spans[name], 0) << name;
}

// Where the time of each view update went: the stages of its last published tile, which add up to its latency.
void expect_stages(PipelineRun& run) {
  const char* moments[] = {"leased_s",  "sample_begin_s", "sample_end_s", "encode_end_s",
                           "receive_s", "packed_s",       "published_s"};
  std::map<std::string, std::vector<double>> tiles;
  for (const char* column : moments) tiles[column] = run.column("tiles.csv", column);
  const auto frame_of_tile = run.column("tiles.csv", "frame");
  const auto frames = run.column("updates.csv", "frame"), requested = run.column("updates.csv", "requested_s"),
             complete = run.column("updates.csv", "complete_s"), latency = run.column("updates.csv", "latency_ms");
  ASSERT_FALSE(frames.empty());
  for (size_t u = 0; u < frames.size(); ++u) {
    size_t last = frame_of_tile.size();
    for (size_t t = 0; t < frame_of_tile.size(); ++t)
      if (frame_of_tile[t] == frames[u] && tiles["published_s"][t] > 0 &&
          (last == frame_of_tile.size() || tiles["published_s"][t] > tiles["published_s"][last]))
        last = t;
    ASSERT_LT(last, frame_of_tile.size()) << "no tile of frame " << frames[u] << " was published";
    double before = requested[u], sum_ms = 0;
    for (const char* moment : moments) {
      const double stage_ms = (tiles[moment][last] - before) * 1e3;
      EXPECT_GE(stage_ms, 0) << moment << " of frame " << frames[u];
      sum_ms += stage_ms;
      before = tiles[moment][last];
    }
    EXPECT_GE(complete[u], before) << "displayed before it was published: frame " << frames[u];
    sum_ms += (complete[u] - before) * 1e3;
    EXPECT_NEAR(sum_ms, latency[u], 1e-5) << "frame " << frames[u];
  }
}

// `telesplat inspect` describes a run by its latest link, and a depth image that it recorded.
void expect_inspected(const PipelineRun& run) {
  const auto inspect = [&](std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "inspect");
    Program program("telesplat", arguments, run.folder() / "inspect");
    EXPECT_EQ(program.wait(60), 0) << program.err();
    return program.out();
  };
  const auto expect_told = [](const std::string& out, std::initializer_list<const char*> parts) {
    for (const char* part : parts) EXPECT_NE(out.find(part), std::string::npos) << part << " is not in\n" << out;
  };
  const std::string latest = run.folder() / "latest", picture = run.folder() / "a.exr", values = run.folder() / "a.npy";
  fs::create_directory_symlink(run.out(), latest);
  expect_told(inspect({latest}), {": a run", "20000 triangles", "inter-frame delay", "frames.csv", "bytes"});
  const auto json = nlohmann::json::parse(inspect({latest, "--json"}), nullptr, false);
  ASSERT_TRUE(json.is_object());
  EXPECT_EQ(json["summary"]["kind"], "mesh");
  EXPECT_TRUE(json["files"].is_array());

  std::string depth;  // the first frame's: later ones hold what was lacking
  for (const auto& entry : fs::directory_iterator(run.out() + "/depth"))
    if (const std::string path = entry.path().string(); entry.path().extension() == ".depth")
      depth = depth.empty() ? path : std::min(depth, path);
  ASSERT_FALSE(depth.empty());
  const auto image = nlohmann::json::parse(inspect({depth, "--json", "--out", values}), nullptr, false);
  ASSERT_TRUE(image.is_object());
  // The head is some tens of centimetres from a terrain of 0.8 m.
  EXPECT_GT(image["coverage"], 0.05);
  EXPECT_GT(image["depth_m"]["min"], 0.1);
  EXPECT_LT(image["depth_m"]["max"], 3);
  EXPECT_LE(image["depth_m"]["min"], image["depth_m"]["median"]);
  EXPECT_EQ(fs::file_size(values), 128 + 4 * uint64_t(image["size"][0]) * uint64_t(image["size"][1]));
  expect_told(inspect({depth, "--out", picture}), {"a sampled depth image", "camera", "near plane"});
  expect_told(inspect({picture}), {"a picture with depth"});
}

TEST(Record, TheStagesOfAnUpdateAddUpAndNoneIsNegative) {
  PipelineRun run({"--duration", "3", "--record-depth", "--report"});
  ASSERT_EQ(run.program().wait(90), 0) << run.program().err();
  EXPECT_NE(run.program().out().find("The report is " + run.out() + "/report.html"), std::string::npos);
  EXPECT_TRUE(read_text(run.out() + "/report.html").starts_with("<!DOCTYPE html>"));
  expect_stages(run);
  // A frame and the update that it shows, on one clock.
  const auto begin = run.column("frames.csv", "begin_s"), construction = run.column("frames.csv", "construction_ms"),
             age = run.column("frames.csv", "update_age_ms"), shown = run.column("frames.csv", "request"),
             t = run.column("frames.csv", "t_s");
  const auto request = run.column("updates.csv", "request"), requested = run.column("updates.csv", "requested_s");
  size_t joined = 0;
  for (size_t f = 0; f < begin.size(); ++f)
    for (size_t u = 0; u < request.size(); ++u) {
      if (shown[f] != request[u]) continue;
      EXPECT_NEAR((begin[f] - requested[u]) * 1e3 + construction[f], age[f], 1e-5) << "frame " << f;
      ++joined;
    }
  EXPECT_GT(joined, begin.size() / 2);
  for (size_t f = 1; f < begin.size(); ++f) EXPECT_NEAR(begin[f] - begin[0], t[f] - t[0], 1e-8);
  expect_inspected(run);
}

}  // namespace
}  // namespace telesplat::test
