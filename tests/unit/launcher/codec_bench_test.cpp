// `telesplat bench codec`: what its baselines count, how it measures errors, what it takes for a set of images.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <random>

#include "common/codec/depth_codec.h"
#include "common/image/normal.h"
#include "tests/support/depth_images.h"
#include "tools/telesplat/bench/codec/lzw.h"
#include "tools/telesplat/bench/codec/report.h"
#include "tools/telesplat/bench/codec/rvl.h"

namespace telesplat::launcher {
namespace {

using Bytes = std::vector<uint8_t>;

// A folder that goes when the object does.
struct Folder {
  Folder() { EXPECT_NE(mkdtemp(pattern.data()), nullptr); }
  ~Folder() { std::filesystem::remove_all(pattern); }
  const std::string& path() const { return pattern; }
  std::string operator/(const std::string& name) const { return pattern + "/" + name; }
  std::string pattern = ::testing::TempDir() + "codec-bench-XXXXXX";
};

TEST(CodecBenchLzw, CountsAsTheSpecificationDoes) {
  // Its example: 7 7 7 8 8 7 7 6 6 becomes clear 7 258 8 8 258 6 6 end.
  EXPECT_EQ(lzw_bits(Bytes{7, 7, 7, 8, 8, 7, 7, 6, 6}), 9u * 9);
  EXPECT_EQ(lzw_bits(Bytes{}), 9u * 2);
  EXPECT_EQ(lzw_bits(Bytes{1}), 9u * 3);
}

TEST(CodecBenchLzw, EqualBytesBecomeEverLongerStrings) {
  // 1 + 2 + ... + n bytes are n codes.
  EXPECT_EQ(lzw_bits(Bytes(5 * 6 / 2, 3)), 9u * (5 + 2));
  // The 254th code is the last one of 9 bits: entry 511 is added after it.
  EXPECT_EQ(lzw_bits(Bytes(253 * 254 / 2, 3)), 9u * (1 + 253) + 9);
  EXPECT_EQ(lzw_bits(Bytes(254 * 255 / 2, 3)), 9u * (1 + 254) + 10);
  EXPECT_EQ(lzw_bits(Bytes(256 * 257 / 2, 3)), 9u * (1 + 254) + 10 * 2 + 10);
}

TEST(CodecBenchLzw, ClearsATableThatIsFull) {
  std::mt19937 random(1);
  Bytes noise(100'000);
  for (uint8_t& b : noise) b = uint8_t(random());
  const double bits = double(lzw_bits(noise)) / double(noise.size());
  EXPECT_GT(bits, 10);  // two bytes in a row are seldom seen twice before the table is cleared
  EXPECT_LT(bits, 12);
}

TEST(CodecBenchLzw, IsAsLongAsTheStripsOfATiffFile) {
  const auto image = test::crop(test::render({.width = 256, .height = 256}), 0, 0, 256, 256);
  const auto own = lzw_bits(image);
  const auto tiff = baselines()[1].bits(image);
  ASSERT_TRUE(tiff.ok());
  ASSERT_EQ(baselines()[1].name, "tiff");
  // A TIFF file is cut into strips, each with a table of its own, and has a table of contents.
  for (const auto& [mine, file] :
       {std::pair{own.depth, tiff->depth}, {own.colour, tiff->colour}, {own.normal, tiff->normal}}) {
    EXPECT_LT(mine, file);
    EXPECT_GT(double(mine), 0.85 * double(file));
  }
}

TEST(CodecBenchRvl, ComesBack) {
  std::mt19937 random(2);
  for (int round = 0; round < 200; ++round) {
    std::vector<uint32_t> values(random() % 300);
    for (uint32_t& v : values) v = random() % 3 == 0 ? 0 : random() & image::kMaxDepthCode;
    const auto bytes = rvl_encode(values);
    const auto back = rvl_decode(bytes, values.size());
    ASSERT_TRUE(back.ok()) << back.error().text;
    ASSERT_EQ(*back, values);
    for (size_t n = 0; n < bytes.size(); ++n) ASSERT_FALSE(rvl_decode({bytes.data(), n}, values.size()).ok());
  }
}

TEST(CodecBenchRvl, CountsHalfBytes) {
  EXPECT_EQ(rvl_encode({}).size(), 0u);
  // No zeros, one value, its difference 1 is code 2: three half bytes.
  EXPECT_EQ(rvl_encode(std::vector<uint32_t>{1}), (Bytes{0x01, 0x20}));
  // 8 zeros take two half bytes, 0 others one.
  EXPECT_EQ(rvl_encode(std::vector<uint32_t>(8)), (Bytes{0x81, 0x00}));
}

TEST(CodecBenchErrors, DepthIsInPixels) {
  EXPECT_EQ(depth_error_px(1000, 1000, 640), 0);
  // z = K / c: the error |K / c' - K / c| over z / focal.
  const double z = 1.0 / 5000, z_decoded = 1.0 / 5003;
  EXPECT_NEAR(depth_error_px(5000, 5003, 640), std::abs(z_decoded - z) / (z / 640), 1e-9);
}

TEST(CodecBenchErrors, NormalsAreNextToEachOtherAcrossTheSeam) {
  const auto code = [](int x, int y) { return uint16_t((x + 127) | (y + 127) << 8); };
  EXPECT_EQ(normal_distance(code(3, 4), code(5, 5)), 2);
  EXPECT_EQ(normal_distance(code(127, 10), code(127, -10)), 0) << "two codes of one direction";
  EXPECT_EQ(normal_distance(code(126, 10), code(127, -10)), 1);
  EXPECT_EQ(normal_distance(code(126, 10), code(126, -11)), 2);
  EXPECT_EQ(normal_distance(code(127, 127), code(-127, -127)), 0) << "the pole behind";
  EXPECT_EQ(normal_distance(code(126, 127), code(-127, -126)), 1);
  for (int i = 0; i < 65536; i += 37)
    for (int j = 0; j < 65536; j += 4099) {
      const int d = normal_distance(uint16_t(i), uint16_t(j));
      ASSERT_EQ(d, normal_distance(uint16_t(j), uint16_t(i)));
      // A step of both coordinates turns the vector by two degrees at most.
      ASSERT_LE(normal_angle_deg(uint16_t(i), uint16_t(j)), 2 * d + 1e-6) << i << " " << j;
    }
}

TEST(CodecBenchErrors, AreFoundAndDrawn) {
  const auto original = test::plane(32, 16, 3, 5);
  auto decoded = original;
  CodecErrors none;
  add_errors(original, decoded, 640, none);
  EXPECT_TRUE(none.none());
  EXPECT_EQ(none.pixels, original.pixels());

  decoded.depth[5] += 100;
  decoded.colour[6] ^= 0x000300;
  decoded.normal[7] = uint16_t(decoded.normal[7] ^ 1);
  decoded.depth[8] = decoded.colour[8] = decoded.normal[8] = 0;
  CodecErrors errors;
  add_errors(original, decoded, 640, errors);
  EXPECT_FALSE(errors.none());
  EXPECT_EQ(errors.uncovered, 1u);
  EXPECT_DOUBLE_EQ(errors.depth_px.largest, depth_error_px(original.depth[5], decoded.depth[5], 640));
  EXPECT_EQ(errors.normal_codes.largest, 1);
  EXPECT_GT(errors.normal_deg.largest, 0);
  EXPECT_GE(errors.colour_codes.largest, 1);
  EXPECT_LE(errors.colour_codes.largest, 3);

  const auto maps = error_maps(original, decoded, 640);
  EXPECT_EQ(maps.height, 16);
  EXPECT_NE(maps.colour[5], 0u);
  EXPECT_EQ(maps.colour[4], 0u);
  EXPECT_EQ(maps.colour[8], 0xff00ffu);
  const auto sheet = stacked({maps, maps});
  ASSERT_TRUE(sheet.ok());
  EXPECT_GT(sheet->height, 32);
  EXPECT_FALSE(stacked(std::vector<image::View>(2000, maps)).ok());
}

TEST(CodecBenchSets, FilesThatDifferInANumberAreOne) {
  const Folder folder;
  for (const char* name : {"a-01.depth", "a-02.depth", "b-1.depth"}) std::ofstream(folder / name) << "x";
  const auto subject = codec_subject(folder.path());
  ASSERT_TRUE(subject.ok());
  ASSERT_EQ(subject->sets.size(), 2u);
  EXPECT_EQ(subject->sets[0].name, "a");
  EXPECT_EQ(subject->sets[0].files.size(), 2u);
  const auto again = codec_subject(folder / "a-02.depth");
  EXPECT_EQ(joined_sets({*subject, *again})[0].files.size(), 3u);
  EXPECT_EQ(codec_subject("julia")->scene, "julia");

  std::filesystem::create_directories(folder / "walk/depth");
  std::ofstream(folder / "walk/session.toml") << "";
  EXPECT_NE(codec_subject(folder / "walk").error().text.find("--record-depth"), std::string::npos);
  std::ofstream(folder / "walk/depth/frame-000001.depth") << "x";
  EXPECT_EQ(codec_subject(folder / "walk")->sets.at(0).name, "walk");
  EXPECT_NE(read_frame(folder / "a-01.depth", 90).error().text.find("a-01.depth"), std::string::npos);
}

TEST(CodecBenchMeasure, AddsUpToTheStreams) {
  const DepthFrame frame{test::render({.width = 600, .height = 300}), 640};
  MeasureOptions options;
  for (const Baseline& b : baselines())
    if (b.name == "lzw" || b.name == "rvl") options.coders.push_back(&b);
  options.seconds = 1e-3;
  options.error_maps = true;
  CodecMeasure measure(options);
  ASSERT_TRUE(measure.add(frame));
  const CodecReport report = measure.finish("made");
  size_t bits = 0, covered = 0;
  for (const DepthFrame& tile : tiles_of(frame)) {
    bits += 8 * codec::encode(tile.image).size();
    covered += tile.image.pixels();
  }
  EXPECT_EQ(report.bits.all(), bits);
  EXPECT_EQ(report.covered, covered);
  EXPECT_EQ(report.tiles, 6u);
  EXPECT_EQ(report.full_tiles, 2u);
  EXPECT_TRUE(report.errors.none());
  ASSERT_FALSE(report.speeds.empty());
  EXPECT_GT(report.speeds[0].encode, 0);
  EXPECT_GT(report.speeds[0].decode, 0);
  EXPECT_TRUE(measure.worst_maps());
  const auto json = to_json(report);
  EXPECT_NEAR(json["bits_per_pixel"]["telesplat"]["all"].get<double>(), double(bits) / double(covered), 1e-9);
  EXPECT_LT(json["bits_per_pixel"]["lzw"]["ratio"].get<double>(), 1);
  const std::string text = to_markdown(report);
  EXPECT_NE(text.find("| telesplat |"), std::string::npos);
  EXPECT_NE(text.find("| RVL |"), std::string::npos);
  EXPECT_NE(text.find("lossless"), std::string::npos);
}

TEST(CodecBenchMeasure, WithinBoundsErrorsReachAndKeepThem) {
  const DepthFrame frame{test::render({.width = 300, .height = 280}), 640};
  CodecMeasure measure({.coders = {}, .seconds = 1e-3, .error_maps = true, .wish = {1 / 32.0, 1, 1}});
  ASSERT_TRUE(measure.add(frame));
  const CodecReport report = measure.finish("made");
  EXPECT_LT(report.bounded.all(), report.bits.all());
  EXPECT_GT(report.refinement, 0u);
  EXPECT_LT(report.refinement, report.bits.all());
  EXPECT_LE(report.errors.depth_px.largest, 1 / 32.0);
  EXPECT_GT(report.errors.depth_px.largest, 0.8 / 32);
  EXPECT_LE(report.errors.normal_deg.largest, codec::normal_error_degrees(1));
  EXPECT_GT(report.errors.normal_codes.largest, 0);
  EXPECT_EQ(report.errors.colour_codes.largest, 1);
  EXPECT_EQ(report.errors.uncovered, 0u);
  ASSERT_FALSE(report.bounded_speeds.empty());
  EXPECT_GT(report.bounded_speeds[0].encode, 0);
  EXPECT_GT(report.refinement_speeds[0].decode, 0);
  const std::string text = to_markdown(report);
  EXPECT_NE(text.find("| within bounds |"), std::string::npos);
  EXPECT_NE(text.find("| refinement |"), std::string::npos);
  EXPECT_NE(text.find("bounds: depth 0.0312 px; normals 1 codes, 1.91 degrees"), std::string::npos);
  EXPECT_EQ(to_json(report)["bits_per_pixel"]["refinement"]["bytes"], report.refinement / 8);
}

}  // namespace
}  // namespace telesplat::launcher
