// A whole run, and what it leaves behind.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

void expect_distribution(const nlohmann::json& d, const std::string& name) {
  for (const char* key : {"mean", "median", "p95", "p99", "max"})
    ASSERT_TRUE(d.contains(key) && d[key].is_number()) << name << "." << key;
  EXPECT_LE(d["median"], d["p95"]) << name;
  EXPECT_LE(d["p95"], d["p99"]) << name;
  EXPECT_LE(d["p99"], d["max"]) << name;
}

TEST(Record, EveryFileIsThereAndTrue) {
  PipelineRun run({"--duration", "2", "--hold", "1", "--verify", "15", "--record-every", "60"});
  ASSERT_EQ(run.program().wait(90), 0) << run.program().err();
  EXPECT_TRUE(run.all_gone());
  for (const char* name : {"session.toml", "frames.csv", "updates.csv", "tiles.csv", "trace.json", "summary.json",
                           "quality.csv", "images/frame-000000.png", "logs/viewer-1.log"})
    EXPECT_TRUE(fs::exists(run.out() + "/" + name)) << name;
  EXPECT_FALSE(fs::exists(run.out() + "/spool"));

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
  for (const char* key : {"inter_frame_delay_ms", "view_construction_ms", "view_update_latency_ms",
                          "start_up_latency_ms", "sampling_ms", "packing_ms", "points_drawn"}) {
    ASSERT_TRUE(s.contains(key)) << key;
    expect_distribution(s[key], key);
    EXPECT_GT(s[key]["max"], 0) << key;
  }
  EXPECT_EQ(s["schema"], 1);
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

  const auto& q = s["quality"];
  ASSERT_TRUE(q.is_object());
  EXPECT_GE(q["views"], 2);
  for (const char* key : {"psnr_db", "ssim", "hole_fraction"}) expect_distribution(q[key], key);
  EXPECT_GT(q["psnr_db"]["median"], 20);
  EXPECT_LT(q["last_view"]["hole_fraction"], 0.02);
  EXPECT_GT(q["last_view"]["psnr_db"], 22);

  // Every span of every process, on one clock.
  const auto trace = nlohmann::json::parse(read_text(run.out() + "/trace.json"), nullptr, false);
  ASSERT_TRUE(trace.is_array());
  std::map<std::string, int> spans;
  for (const auto& e : trace)
    if (e["ph"] == "X") {
      ++spans[e["name"]];
      EXPECT_GE(e["dur"], 0);
    }
  for (const char* name : {"sample", "encode", "pack", "decode", "insert", "display frame", "view update"})
    EXPECT_GT(spans[name], 0) << name;

  // Its picture and itself can be inspected.
  Program inspect("telesplat", {"inspect", run.out()}, run.folder() / "inspect");
  EXPECT_EQ(inspect.wait(), 0) << inspect.err();
  EXPECT_NE(inspect.out().find("summary.json"), std::string::npos);
}

TEST(Record, ARealMesh) {
  const char* set = std::getenv("TELESPLAT_DATA");
  const char* home = std::getenv("HOME");
  const std::string data = set ? set : std::string(home ? home : "") + "/.cache/telesplat-data",
                    mesh = data + "/meshes/alderson-bone-718k.ply";
  if (!fs::exists(mesh)) GTEST_SKIP() << mesh << " is not there; TELESPLAT_DATA names the folder of real data sets";
  PipelineRun run({"--duration", "2", "--hold", "1", "--verify", "20"}, mesh);
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  const auto s = run.summary();
  EXPECT_GT(s["primitives"], 700000);
  EXPECT_GT(s["updates"], 0);
  EXPECT_GT(s["quality"]["last_view"]["psnr_db"], 9);  // ribs and scan lines are thinner than these pixels
  EXPECT_LT(s["quality"]["last_view"]["hole_fraction"], 0.02);
  EXPECT_TRUE(run.all_gone());
}

}  // namespace
}  // namespace telesplat::test
