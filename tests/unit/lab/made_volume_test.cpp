#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tools/lab/make_volume/tree.h"

namespace telesplat::made_volume {
namespace {

TEST(MadeVolume, IsTheSameForTheSameSeed) {
  const Scan a = make_tree(48, 5, {}), b = make_tree(48, 5, {}), c = make_tree(48, 6, {});
  EXPECT_EQ(a.values, b.values);
  EXPECT_NE(a.values, c.values);
}

TEST(MadeVolume, HoldsAirWoodEarthenwareAndMetal) {
  const Scan scan = make_tree(160, 1, {});
  size_t air = 0, wood = 0, pot = 0, metal = 0;
  for (const uint16_t v : scan.values) {
    air += v < 1000;
    wood += v > 13000 && v < 15000;
    pot += v > 29000 && v < 31000;
    metal += v > 55000;
  }
  EXPECT_GT(air, scan.values.size() * 9 / 10);
  EXPECT_GT(wood, 300u);
  EXPECT_GT(pot, 1000u);
  EXPECT_GT(metal, 30u);
}

TEST(MadeVolume, IsWrittenWholeOrNotAtAll) {
  const Scan scan = make_tree(16, 1, {});
  const auto folder = std::filesystem::temp_directory_path() / "telesplat-made-volume";
  std::filesystem::create_directories(folder);
  for (const auto& [name, bits, bytes] : {std::tuple{"a.raw", 16, 8192u}, {"a.raw", 8, 4096u}}) {
    const std::string path = folder / name;
    ASSERT_TRUE(write_scan(scan, bits, path));
    EXPECT_EQ(std::filesystem::file_size(path), bytes);
  }
  for (const char* name : {"a.nrrd", "a.mha"}) {
    const std::string path = folder / name;
    ASSERT_TRUE(write_scan(scan, 16, path));
    std::ifstream in(path, std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    EXPECT_EQ(bytes.substr(bytes.size() - 8192), std::string(reinterpret_cast<const char*>(scan.values.data()), 8192));
  }
  EXPECT_FALSE(write_scan(scan, 16, folder / "a.tif"));
  EXPECT_FALSE(write_scan(scan, 12, folder / "a.raw"));
  EXPECT_FALSE(write_scan(scan, 16, folder / "nowhere" / "a.raw"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace telesplat::made_volume
