// `telesplat inspect` as a person types it: what run takes is told as run takes it, what run refuses is refused alike.
#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/integration/commands/here.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

std::string big_endian(uint32_t value) { return {char(value >> 24), char(value >> 16), char(value >> 8), char(value)}; }

std::string png_chunk(const std::string& type, const std::string& data) {
  const std::string checked = type + data;
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(checked.data()), uInt(checked.size()));
  return big_endian(uint32_t(data.size())) + checked + big_endian(uint32_t(sum));
}

// A ramp of grey, `bits` a sample.
void write_png(const std::string& path, int bits, int width = 24, int height = 16) {
  std::string rows;
  for (int y = 0; y < height; ++y) {
    rows += '\0';
    for (int x = 0; x < width; ++x) {
      if (bits == 16) rows += char(x * y >> 8);
      rows += char(x * y);
    }
  }
  uLongf bytes = compressBound(uLong(rows.size()));
  std::string packed(bytes, '\0');
  compress(reinterpret_cast<Bytef*>(packed.data()), &bytes, reinterpret_cast<const Bytef*>(rows.data()),
           uLong(rows.size()));
  packed.resize(bytes);
  std::ofstream(path, std::ios::binary) << "\x89PNG\r\n\x1a\n"
                                        << png_chunk("IHDR", big_endian(uint32_t(width)) +
                                                                 big_endian(uint32_t(height)) + char(bits) +
                                                                 std::string(4, '\0'))
                                        << png_chunk("IDAT", packed) << png_chunk("IEND", "");
}

class Inspect : public testing::Test {
 protected:
  // Exit code; what it said is in out_ and err_.
  int inspect(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "inspect");
    const Said said = telesplat(arguments);
    out_ = said.out, err_ = said.err;
    return said.code;
  }
  bool tells(const std::string& part) const { return out_.find(part) != std::string::npos; }
  // Code 2, one line that names it.
  void expect_refused(const std::vector<std::string>& arguments, const std::string& named) {
    EXPECT_EQ(inspect(arguments), 2) << named;
    EXPECT_EQ(std::count(err_.begin(), err_.end(), '\n'), 1) << err_;
    EXPECT_NE(err_.find(named), std::string::npos) << err_;
  }
  TemporaryFolder folder_;
  std::string out_, err_;
};

TEST_F(Inspect, ARasterThatRunTakesIsNoPicture) {
  write_png(folder_ / "dem.png", 16), write_png(folder_ / "photo.png", 8);
  ASSERT_EQ(inspect({folder_ / "dem.png", "--no-cache"}), 0) << err_;
  for (const char* part : {"dem.png: an elevation raster", "24 x 16 of UInt16", "tinted by height", "z (an elevation"})
    EXPECT_TRUE(tells(part)) << part << " is not in\n" << out_;
  ASSERT_EQ(inspect({folder_ / "photo.png"}), 0) << err_;
  EXPECT_TRUE(tells("photo.png: a picture") && tells("8-bit grey: a picture, not elevation")) << out_;
  std::ofstream(folder_ / "my.toml") << "scene = \"dem.png\"\n";
  EXPECT_EQ(inspect({folder_ / "my.toml"}), 2);
  EXPECT_NE(err_.find("my.toml: is a scene file, not data: telesplat run"), std::string::npos) << err_;
  ASSERT_EQ(inspect({folder_ / "dem.png", "--no-cache", "--json", "--z-scale", "2", "--up", "-y"}), 0) << err_;
  const auto json = nlohmann::json::parse(out_, nullptr, false);
  ASSERT_TRUE(json.is_object()) << out_;
  EXPECT_EQ(json["what"], "raster");
  EXPECT_NEAR(double(json["raster"]["z_scale"]), 2, 1e-6);
  EXPECT_EQ(json["room"]["up"], "-y");
}

// A loop over files of all kinds needs no exception.
TEST_F(Inspect, EveryKindTakesTheCachesFlagsAndIsCalledAsItWasTyped) {
  write_terrain(folder_ / "hill.ply", 4), write_volume(folder_ / "balls.mha"), write_png(folder_ / "dem.png", 16);
  for (const auto& [file, what] :
       {std::pair{"hill.ply", ": a mesh\n"}, {"balls.mha", ": a volume\n"}, {"dem.png", ": an elevation raster\n"}}) {
    ASSERT_EQ(inspect({folder_ / file, "--no-cache"}), 0) << err_;
    EXPECT_TRUE(tells(folder_ / file + what)) << out_;
    ASSERT_EQ(inspect({folder_ / file, "--cache", folder_ / "cache"}), 0) << err_;
    EXPECT_FALSE(tells("the cache holds")) << "some kilobytes are not worth a word: " << out_;
  }
  EXPECT_EQ(inspect({"julia", "--no-cache"}), 0) << err_;
}

// As small GeoTIFFs are: 8 bits a sample, one strip; with a place by its corner and the size of a sample in degrees.
void write_tiff(const std::string& path, bool placed) {
  const auto put = [](std::string& to, uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) to += char(value >> (8 * i));
  };
  constexpr uint32_t kSide = 16, kPixels = 8, kTable = kPixels + kSide * kSide;
  const uint16_t entries = placed ? 11 : 9;
  const uint32_t doubles = kTable + 2 + entries * 12u + 4;
  std::string out = "II*";
  out += '\0';
  put(out, kTable, 4);
  for (uint32_t i = 0; i < kSide * kSide; ++i) out += char(i % 251);
  put(out, entries, 2);
  const auto entry = [&](uint16_t tag, uint16_t type, uint32_t count, uint32_t value) {
    put(out, tag, 2), put(out, type, 2), put(out, count, 4), put(out, value, 4);
  };
  entry(256, 4, 1, kSide), entry(257, 4, 1, kSide), entry(258, 3, 1, 8), entry(259, 3, 1, 1), entry(262, 3, 1, 1);
  entry(273, 4, 1, kPixels), entry(277, 3, 1, 1), entry(278, 4, 1, kSide), entry(279, 4, 1, kSide * kSide);
  if (placed) entry(33550, 12, 3, doubles), entry(33922, 12, 6, doubles + 24);
  put(out, 0, 4);
  for (const double d : {0.001, 0.001, 0.0, 0.0, 0.0, 0.0, 12.0, 50.0, 0.0}) {
    uint64_t bits = 0;
    std::memcpy(&bits, &d, sizeof bits);
    put(out, bits, 8);
  }
  std::ofstream(path, std::ios::binary) << out;
}

TEST_F(Inspect, ARasterOf8BitsHasHeightsIfItHasAPlace) {
  write_tiff(folder_ / "photo.tif", false), write_tiff(folder_ / "dem.tif", true);
  expect_refused({folder_ / "photo.tif", "--no-cache"}, "photo.tif: has samples of 8 bits and no place on earth");
  ASSERT_EQ(inspect({folder_ / "dem.tif", "--no-cache"}), 0) << err_;
  EXPECT_TRUE(tells("an elevation raster") && tells("of Byte") && tells("west 12")) << out_;
}

TEST_F(Inspect, WarningsDoNotGetIntoTheJson) {
  write_terrain(folder_ / "hill.ply", 4);
  const std::vector<std::string> arguments{folder_ / "hill.ply", "--cache", folder_ / "cache", "--json"};
  ASSERT_EQ(inspect(arguments), 0) << err_;
  for (const auto& entry : fs::directory_iterator(folder_ / "cache"))
    if (entry.path().extension() == ".mesh") std::ofstream(entry.path()) << "an older version's";
  ASSERT_EQ(inspect(arguments), 0) << err_;
  EXPECT_NE(err_.find("making it anew"), std::string::npos) << err_;
  EXPECT_TRUE(nlohmann::json::parse(out_, nullptr, false).is_object()) << out_;
}

TEST_F(Inspect, WhatRunRefusesIsRefusedAlike) {
  write_png(folder_ / "dem.png", 16);
  std::ofstream(folder_ / "cube.raw", std::ios::binary) << std::string(64 * 64 * 64, 'x');
  fs::create_directory(folder_ / "empty"), fs::create_directory(folder_ / "run");
  std::ofstream(folder_ / "run/summary.json") << "{}";
  expect_refused({folder_ / "dem.png", "--tf", "bone"}, "--tf: ");
  expect_refused({folder_ / "cube.raw"}, "raw voxels need --raw");
  expect_refused({folder_ / "cube.raw"}, "--raw 64x64x64:u8");
  expect_refused({folder_ / "cube.raw", "--raw", "64x64x64:u9"}, "\"u9\" is no type");
  expect_refused({"julia", "--up", "z"}, "--up: julia is a Julia set");
  for (const std::vector<std::string>& flags : {std::vector<std::string>{}, {"--no-cache"}, {"--tf", "bone"}}) {
    std::vector<std::string> arguments{folder_ / "empty"};
    arguments.insert(arguments.end(), flags.begin(), flags.end());
    expect_refused(arguments, "empty: is a folder that holds neither a finished run, which has a summary.json, nor a");
  }
  expect_refused({folder_ / "run", "--tf", "bone"}, "is a run folder, which has no --tf");
  expect_refused({folder_ / "none.ply"}, "none.ply: no such file");
  expect_refused({folder_ / "dem.png", "--out", "a.npy"}, "--out: ");
  expect_refused({folder_ / "dem.png", "--near", "nan"}, "--near");
  write_png(folder_ / "photo.png", 8), write_volume(folder_ / "balls.mha");
  expect_refused({folder_ / "balls.mha", "--series", "1"}, "--series: ");
  expect_refused({folder_ / "photo.png", "--tf", "bone"}, "is a picture, which has no --tf");
  expect_refused({folder_ / "photo.png", "--out", folder_ / "a.npy"}, "has no depth");
}

TEST_F(Inspect, AVolumeAndItsSurfaceStandAtOnePlace) {
  write_volume(folder_ / "balls.mha");
  ASSERT_EQ(inspect({folder_ / "balls.mha", "--json", "--room-size", "2"}), 0) << err_;
  const auto volume = nlohmann::json::parse(out_, nullptr, false);
  ASSERT_EQ(inspect({folder_ / "balls.mha", "--json", "--room-size", "2", "--iso", "100", "--no-cache"}), 0) << err_;
  const auto surface = nlohmann::json::parse(out_, nullptr, false);
  ASSERT_TRUE(volume.is_object() && surface.is_object());
  EXPECT_EQ(volume["what"], "volume");
  EXPECT_EQ(surface["what"], "mesh");
  EXPECT_EQ(volume["room"]["up"], surface["room"]["up"]);
  // Metres a unit of the file are the same, and so is where they begin.
  for (size_t a = 0; a < 3; ++a) {
    const size_t in_room = a == 0 ? 0 : a == 1 ? 2 : 1;  // z is up, y goes away
    const double units = double(surface["box"]["hi"][a]) - double(surface["box"]["lo"][a]);
    const double metres = double(surface["room"]["hi"][in_room]) - double(surface["room"]["lo"][in_room]);
    EXPECT_NEAR(metres / units, 2.0 / 40, 1e-5) << a;
  }
  EXPECT_EQ(volume["voxels"], (nlohmann::json{40, 40, 40}));
}

}  // namespace
}  // namespace telesplat::test
