// A record on a full disk, a record that grows for hours, and hostile names.
#include <malloc.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <nlohmann/json.hpp>
#include <random>

#include "services/master/record/text_file.h"
#include "tests/unit/metrics/record_fixture.h"

namespace telesplat::metrics {
namespace {

using nlohmann::json;

/// No file of this process can grow beyond `bytes`, as on a full disk.
class SmallDisk {
 public:
  explicit SmallDisk(rlim_t bytes) {
    std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit small{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &small);
  }
  ~SmallDisk() { setrlimit(RLIMIT_FSIZE, &before_); }

 private:
  rlimit before_{};
};

size_t lines(const std::string& text) { return size_t(std::count(text.begin(), text.end(), '\n')); }

TEST_F(Record, AFullDiskIsSaidOnceAndFailsTheRun) {
  constexpr int kTiles = 5000;
  testing::internal::CaptureStdout();
  Status finished = ok_status();
  {
    const SmallDisk disk(100'000);
    for (int i = 0; i < kTiles; ++i) record->add_tile("sampler-1", tile(uint64_t(i), 0, i));
    ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "px"}, {0, 1, 2, 3}})) << "the run goes on";
    finished = record->finish({viewer}, {});
  }
  const std::string said = testing::internal::GetCapturedStdout();
  ASSERT_FALSE(finished);
  EXPECT_NE(finished.error().text.find("tiles.csv"), std::string::npos) << finished.error().text;
  for (const char* file : {"tiles.csv: cannot be written", "trace.json: cannot be written"}) {
    const size_t first = said.find(file);
    EXPECT_NE(first, std::string::npos) << said;
    EXPECT_EQ(said.find(file, first + 1), std::string::npos) << "once: " << said;
  }
  const json errors = json::parse(text("summary.json"))["errors"];
  EXPECT_EQ(errors["record_failed"], 2);
  const std::string tiles = text("tiles.csv");
  EXPECT_TRUE(tiles.ends_with('\n')) << "whole rows alone";
  EXPECT_LE(tiles.size(), 100'000u);
  EXPECT_EQ(lines(tiles) - 1 + size_t(errors["record_lost"]["tiles.csv"]), size_t(kTiles))
      << "each is there or counted";
  EXPECT_EQ(text("frames.csv"), "viewer,t_s,px\nviewer-1,0.000000000,1\nviewer-1,2.000000000,3\n");
}

TEST_F(Record, WhatOthersCouldNotWriteIsToldToo) {
  viewer.values["record_failed"] = 2;
  EXPECT_EQ(record->summary({viewer}, {})["errors"]["record_failed"], 2);
  EXPECT_EQ(record->summary({}, {})["errors"]["record_failed"], 0);
  EXPECT_TRUE(record->summary({}, {})["errors"]["record_lost"].is_null());
}

TEST(TextFile, ADeviceThatIsFullTakesNothingAndTheRowsAreCounted) {
  TextFile file;
  ASSERT_TRUE(file.open("/dev/full"));
  for (int i = 0; i < 10; ++i) file.write("row\n");
  file.flush();
  EXPECT_FALSE(file.status());
  EXPECT_EQ(file.rows_lost(), 10u);
  file.write("row\n");
  file.close();
  EXPECT_EQ(file.rows_lost(), 11u);
}

TEST_F(Record, FilesEndAtTheirLimitAndSaySo) {
  record.reset();
  record = std::move(RunRecord::open(folder + "/run", {}, {.table_bytes = 20'000, .trace_bytes = 30'000})).value();
  constexpr int kTiles = 1000;
  for (int i = 0; i < kTiles; ++i) record->add_tile("sampler-1", tile(uint64_t(i), 0, i));
  ASSERT_TRUE(record->finish({}, {})) << "that is no failure";
  const json summary = json::parse(text("summary.json"));
  EXPECT_EQ(summary["errors"]["record_failed"], 0);
  const std::string tiles = text("tiles.csv"), trace = text("trace.json");
  EXPECT_LE(tiles.size(), 20'000u);
  EXPECT_LE(trace.size(), 30'000u + 8);
  EXPECT_EQ(lines(tiles) - 1 + size_t(summary["errors"]["record_cut"]["tiles.csv"]), size_t(kTiles));
  EXPECT_GT(summary["errors"]["record_cut"]["trace.json"], 0);
  EXPECT_TRUE(json::accept(trace)) << "it ends as it should";
  EXPECT_EQ(summary["bytes_sent"], 500 * kTiles) << "the figures are of all";
}

TEST(RecordInMemory, StaysSmallHoweverManyTilesRowsAndNamesCome) {
  auto record = std::move(RunRecord::open("")).value();
  wire::TileDone t;
  t.samples = 1000, t.bytes_sent = 500, t.step = 1;
  Process viewer{"viewer", "viewer-1", 5, {}, {}};
  const auto add = [&](uint64_t from, uint64_t to) {
    for (uint64_t i = from; i < to; ++i) {
      t.frame = {i / 20};
      t.moments.sample_begin_s = double(i) * 1e-3;
      t.moments.encode_end_s = t.moments.sample_begin_s + 1e-3 * double(1 + i % 7);
      record->add_tile("sampler-" + std::to_string(i % 5000), t);
    }
    for (uint64_t i = from / 10; i < to / 10; ++i) {
      viewer.name = "viewer-" + std::to_string(i % 3000);
      const double s = double(i) / 60;
      ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "inter_frame_ms"}, {s, 16 + double(i % 100)}}));
    }
  };
  add(0, 200'000);
  const size_t before = mallinfo2().uordblks;
  add(200'000, 1'200'000);
  const size_t after = mallinfo2().uordblks;
  EXPECT_LT(after, before + (1u << 20)) << "a million tiles and 100,000 frames later";
  const auto s = record->summary({}, {});
  EXPECT_EQ(s["bytes_sent"], 500 * 1'200'000);
  EXPECT_EQ(s["frames"], 120'000);
  EXPECT_NEAR(double(s["inter_frame_delay_ms"]["median"]), 65.5, 0.7);
}

TEST(Quantiles, AreWithinAPercentOfTheTruth) {
  std::mt19937 random(7);
  std::lognormal_distribution<double> often(2, 1);
  Quantiles sketch;
  std::vector<double> all;
  for (int i = 0; i < 200'000; ++i) {
    const double v = i % 10 ? often(random) : i % 20 ? -often(random) : 0;
    sketch.add(v);
    all.push_back(v);
  }
  const Distribution is = sketch.distribution(), truth = distribution(all);
  EXPECT_NEAR(is.mean, truth.mean, 1e-9 * truth.mean);
  EXPECT_EQ(is.max, truth.max);
  EXPECT_NEAR(is.sd, truth.sd, 1e-9 * truth.sd);
  EXPECT_NEAR(is.median, truth.median, 0.01 * truth.median);
  EXPECT_NEAR(is.p95, truth.p95, 0.01 * truth.p95);
  EXPECT_NEAR(is.p99, truth.p99, 0.01 * truth.p99);
  sketch.add(std::nan(""));
  EXPECT_EQ(sketch.count(), 200'000u);
}

TEST_F(Record, ANameWithACommaIsOneCell) {
  viewer.name = "a,\"b\"";
  ASSERT_TRUE(record->add_rows(viewer, {{5}, "frames", {"t_s", "x,y"}, {0, 1}}));
  record->add_tile("c,d", tile(1, 0, 1));
  ASSERT_TRUE(record->finish({}, {}));
  EXPECT_EQ(text("frames.csv"), "viewer,t_s,\"x,y\"\n\"a,\"\"b\"\"\",0.000000000,1\n");
  std::string tiles = text("tiles.csv");
  const auto header = csv_cells(tiles.substr(0, tiles.find('\n')));
  const auto row = csv_cells(tiles.substr(tiles.find('\n') + 1, tiles.rfind('\n') - tiles.find('\n') - 1));
  ASSERT_EQ(row.size(), header.size());
  EXPECT_EQ(row[3], "c,d");
}

TEST_F(Record, NumbersThatNoIntegerHoldsAreHarmless) {
  viewer.facts["width"] = "1e300", viewer.facts["height"] = "-1e300", viewer.facts["duration_s"] = "inf";
  viewer.facts["host"] = "h", viewer.facts["cores"] = "1e300", viewer.facts["frames"] = "nan";
  viewer.values["messages_rejected"] = 1e300;
  const auto s = record->summary({viewer}, {{"leases_expired", -1e300}});
  EXPECT_EQ(s["errors"]["messages_rejected"], uint64_t{1} << 53);
  EXPECT_EQ(s["errors"]["leases_expired"], 0);
  EXPECT_TRUE(s["asked"]["duration_s"].is_null());
}

}  // namespace
}  // namespace telesplat::metrics
