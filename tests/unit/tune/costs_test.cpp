// Costs of `telesplat tune`: from made tables back to the costs that they were made with.
#include "tools/telesplat/tune/costs.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

namespace telesplat::launcher {
namespace {

TEST(TuneCostsFit, ALineIsFoundWhateverSingleValuesDo) {
  std::vector<double> xs, ys;
  for (int i = 0; i < 240; ++i) {
    xs.push_back(i * 10);
    ys.push_back(3 + 0.5 * i * 10 + (i % 20 == 7 ? 1000 : 0));  // a hiccup now and then
  }
  const Line line = fit_line(xs, ys);
  EXPECT_NEAR(line.fixed, 3, 10);  // of 1200
  EXPECT_NEAR(line.slope, 0.5, 0.005);
}

TEST(TuneCostsFit, ALineIsExactOnALine) {
  std::vector<double> xs, ys;
  for (int i = 0; i < 100; ++i) xs.push_back(7 * ((i * 37) % 100)), ys.push_back(2 + 0.25 * xs.back());
  const Line line = fit_line(xs, ys);
  EXPECT_NEAR(line.fixed, 2, 1e-9);
  EXPECT_NEAR(line.slope, 0.25, 1e-12);
}

TEST(TuneCostsFit, NoPartIsNegative) {
  EXPECT_EQ(fit_line({}, {}).slope, 0);
  EXPECT_EQ(fit_line({5, 5, 5}, {10, 10, 10}).slope, 2);
  EXPECT_EQ(fit_line({0, 0}, {4, 4}).fixed, 4);
  const Line falling = fit_line({1, 2, 3}, {3, 2, 1});
  EXPECT_GT(falling.slope, 0) << "work costs time, whatever three values say";
  EXPECT_EQ(falling.fixed, 0);
  const Line below = fit_line({1, 2, 3}, {0, 2, 4});
  EXPECT_EQ(below.fixed, 0);
  EXPECT_GT(below.slope, 0);
}

// A run of `samplers` whose tiles took what the model says.
CostSamples made_run(const TuneCosts& c, int samplers) {
  CostSamples out;
  out.samplers = samplers, out.updates_per_s = 10;
  const double crowd = crowding(c, {.samplers = samplers});
  for (int i = 1; i <= 60; ++i) {
    const double rays = 1000.0 * i, samples = rays * c.covered, kept = samples * c.kept;
    out.tiles.work.push_back(rays), out.tiles.samples.push_back(samples), out.tiles.kept.push_back(kept);
    out.tiles.bytes_sampled.push_back(rays * c.tile_bytes);
    out.tiles.bytes_sent.push_back(c.patch_bytes.at(kept));
    out.tiles.sampling_s.push_back(crowd * (c.tile_s + rays * c.sample_s / threads_of(c, samplers)));
    out.tiles.encoding_s.push_back(crowd * rays * c.encode_s);
    out.tiles.packing_s.push_back(c.pack.at(samples));
    out.stages.lease_network_s.push_back(c.connect_s);
    out.stages.patch_bytes.push_back(c.patch_bytes.at(kept));
    out.stages.patch_network_s.push_back(c.viewer.rtt_s / 2 + c.patch_bytes.at(kept) * c.viewer.byte_s);
    out.stages.patch_points.push_back(kept), out.stages.decode_s.push_back(kept * c.decode_s);
    const double pixels = 1e6 + 1e4 * i;
    out.plans.pixels.push_back(pixels), out.plans.seconds.push_back(c.plan.at(pixels));
    out.plans.checked.push_back(pixels * c.checked);
    out.plans.tiles.push_back(pixels / 65536 / 4);
    out.plans.cast.push_back(pixels * (c.checked + c.novelty_hz / out.updates_per_s));
  }
  return out;
}

TEST(TuneCostsFit, CostsAreFoundAgain) {
  TuneCosts c;
  c.cores = 4;
  c.sample_s = 2e-7, c.encode_s = 3e-8, c.tile_s = 5e-4, c.connect_s = 1e-4;
  c.plan = {1e-3, 2e-9}, c.pack = {1e-4, 4e-8}, c.decode_s = 1e-8, c.patch_bytes = {300, 3}, c.tile_bytes = 2;
  c.viewer = {0.04, 1e-7}, c.covered = 0.75, c.kept = 0.5, c.checked = 1 / 32.0, c.novelty_hz = 2;
  TuneCosts base;
  base.cores = 4;
  const auto found = fit_costs(base, false, {made_run(c, 1), made_run(c, 8)});
  EXPECT_NEAR(found.sample_s, c.sample_s, 1e-12);
  EXPECT_NEAR(found.encode_s, c.encode_s, 1e-12);
  EXPECT_NEAR(found.tile_s, c.tile_s, 1e-9);
  EXPECT_NEAR(found.connect_s, c.connect_s, 1e-12);
  EXPECT_NEAR(found.plan.fixed, c.plan.fixed, 1e-9);
  EXPECT_NEAR(found.pack.slope, c.pack.slope, 1e-13);
  EXPECT_NEAR(found.decode_s, c.decode_s, 1e-13);
  EXPECT_NEAR(found.patch_bytes.fixed, 300, 1e-3);
  EXPECT_NEAR(found.patch_bytes.slope, 3, 1e-6);
  EXPECT_NEAR(found.tile_bytes, 2, 1e-9);
  EXPECT_NEAR(found.viewer.rtt_s, 0.04, 1e-6);
  EXPECT_NEAR(found.viewer.byte_s, 1e-7, 1e-12);
  EXPECT_NEAR(found.covered, 0.75, 1e-9);
  EXPECT_NEAR(found.kept, 0.5, 1e-9);
  EXPECT_NEAR(found.novelty_hz, 2, 1e-6);
  EXPECT_NEAR(found.tile_share, 0.25, 1e-9);

  // What a link states counts.
  base.viewer = {0.1, 5e-7};
  const auto stated = fit_costs(base, true, {made_run(c, 1)});
  EXPECT_EQ(stated.viewer.rtt_s, 0.1);
  EXPECT_EQ(stated.viewer.byte_s, 5e-7);
}

class TuneCostsRead : public ::testing::Test {
 protected:
  TuneCostsRead() {
    std::string pattern = (std::filesystem::temp_directory_path() / "telesplat-tune-XXXXXX").string();
    folder = mkdtemp(pattern.data());
  }
  ~TuneCostsRead() override { std::filesystem::remove_all(folder); }
  void write(const std::string& name, const std::string& text) { std::ofstream(folder + "/" + name) << text; }
  std::string folder;
};

TEST_F(TuneCostsRead, TablesOfARun) {
  write("summary.json", R"({"samplers": 2, "updates_per_s": 12.5, "size": [200, 100]})");
  write("tiles.csv",
        "frame,tile,samples,kept,rays,bytes_sampled,bytes_sent,step,extra,sample_begin_s,sample_end_s,encode_end_s,"
        "receive_s,packed_s\n"
        "1,0,90,45,100,300,150,1,0,1.0,1.5,1.75,2.0,2.25\n"
        "1,1,9,4,10,30,15,4,0,1.0,1.5,1.75,2.0,2.25\n"
        "1,2,9,4,10,30,15,1,1,1.0,1.5,1.75,2.0,2.25\n");
  write("stages.csv",
        "frame,tile,lease_network_ms,patch_network_ms,decoding_ms,insertion_ms\n1,0,2,20,3,1\n7,0,4,20,3,1\n");
  write("plans.csv",
        "extra,plan_ms,rays_cast,rays_full,rays_validation,tiles\n0,4,100,1000,30,2\n0,4,1000,1000,,\n1,4,50,0,0,1\n");
  write("updates.csv", "samples,points,sampling_width\n90,45,100\n");
  const auto read = read_costs(folder, false);
  ASSERT_TRUE(read) << read.error().text;
  EXPECT_EQ(read->samplers, 2);
  EXPECT_EQ(read->updates_per_s, 12.5);
  ASSERT_EQ(read->tiles.work.size(), 1u) << "neither coarse nor extra ones";
  EXPECT_EQ(read->tiles.work[0], 100);
  EXPECT_EQ(read->tiles.sampling_s[0], 0.5);
  EXPECT_EQ(read->tiles.encoding_s[0], 0.25);
  EXPECT_EQ(read->tiles.packing_s[0], 0.25);
  ASSERT_EQ(read->stages.patch_bytes.size(), 1u) << "of a patch that is known";
  EXPECT_EQ(read->stages.patch_bytes[0], 150);
  EXPECT_EQ(read->stages.lease_network_s.size(), 2u);
  ASSERT_EQ(read->plans.cast.size(), 1u) << "neither an extra one nor one that sampled all";
  EXPECT_EQ(read->plans.checked[0], 30);
  EXPECT_EQ(adaptive_scale(*read), 0.5);
}

TEST_F(TuneCostsRead, AFolderWithoutARunIsRefused) {
  EXPECT_FALSE(read_costs(folder, false));
  write("summary.json", "{}");
  EXPECT_FALSE(read_costs(folder, false));
}

}  // namespace
}  // namespace telesplat::launcher
