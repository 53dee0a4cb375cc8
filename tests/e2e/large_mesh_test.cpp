// A mesh that is so large that it is shown before its chunk store is made.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <vector>

#include "tests/support/pipeline_run.h"

namespace telesplat::test {
namespace {

// A binary PLY of 2 n^2 triangles: hills over [0, n]^2.
void write_hills(const std::string& path, int n) {
  std::ofstream out(path, std::ios::binary);
  out << "ply\nformat binary_little_endian 1.0\nelement vertex " << (n + 1) * (n + 1)
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 2 * n * n
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  std::vector<char> row;
  const auto add = [&row](auto value) {
    row.resize(row.size() + sizeof value);
    std::memcpy(row.data() + row.size() - sizeof value, &value, sizeof value);
  };
  const auto flush = [&] {
    out.write(row.data(), static_cast<std::streamsize>(row.size()));
    row.clear();
  };
  for (int j = 0; j <= n; ++j, flush())
    for (int i = 0; i <= n; ++i)
      for (const float p : {float(i), float(j), float(0.04 * n * std::sin(9.0 * i / n) * std::cos(7.0 * j / n))})
        add(p);
  for (int j = 0; j < n; ++j, flush())
    for (int i = 0; i < n; ++i) {
      const int32_t a = j * (n + 1) + i, b = a + 1, c = a + n + 1, d = c + 1;
      for (const auto& corners : {std::array{a, b, d}, std::array{a, d, c}}) {
        add(uint8_t{3});
        for (const int32_t corner : corners) add(corner);
      }
    }
}

TEST(LargeMesh, IsShownCoarselyUntilItsStoreIsMade) {
  const TemporaryFolder folder;
  write_hills(folder / "hills.ply", 1700);
  ASSERT_GT(std::filesystem::file_size(folder / "hills.ply"), 100u << 20);
  const std::vector<std::string> flags{"--duration", "0",        "--trajectory", "still",   "--up",
                                       "z",          "--verify", "60",           "--cache", folder / "cache"};
  {
    PipelineRun run(flags, folder / "hills.ply");
    ASSERT_TRUE(run.wait_showing()) << run.program().err();
    EXPECT_TRUE(run.wait_status([](const auto& s) { return value(s, "viewer-1", "epoch") == 2; }, 120))
        << run.status().dump(1);
    // The whole mesh is there: a still head comes to see all of it.
    const double updates = value(run.status(), "viewer-1", "updates");
    EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "updates") >= updates + 3; }));
    const double frames = value(run.status(), "viewer-1", "frames");
    EXPECT_TRUE(run.wait_status([&](const auto& s) { return value(s, "viewer-1", "frames") > frames + 121; }));
    ASSERT_EQ(run.stop(), 0) << run.program().err();
    EXPECT_NE(run.program().err().find("hills.ply: is shown coarsely"), std::string::npos) << run.program().err();
    EXPECT_EQ(run.column("epochs.csv", "epoch").size(), 2u);
    EXPECT_GT(run.summary()["quality"]["last_view"]["psnr_db"], 28);
  }
  PipelineRun again(flags, folder / "hills.ply");
  ASSERT_TRUE(again.wait_showing()) << again.program().err();
  ASSERT_EQ(again.stop(), 0);
  EXPECT_EQ(again.program().err().find("is shown coarsely"), std::string::npos) << "its store is there";
  EXPECT_EQ(again.column("epochs.csv", "epoch").size(), 1u);
}

}  // namespace
}  // namespace telesplat::test
