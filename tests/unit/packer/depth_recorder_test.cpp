#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/codec/depth_codec.h"
#include "services/packer/points/depth_recorder.h"

namespace telesplat::packer {
namespace {

TEST(DepthRecorder, ComposesTilesInAnyOrderAndKeepsAsManyFramesAsAsked) {
  const auto directory = (std::filesystem::temp_directory_path() / "telesplat-depth-recorder-test").string();
  std::filesystem::remove_all(directory);
  auto recorder = DepthRecorder::open(directory, 1);
  ASSERT_TRUE(recorder.ok());
  const geometry::Camera camera = geometry::make_camera({}, 90, 48, 32);
  image::DepthImage whole(48, 32);
  for (size_t i = 0; i < whole.pixels(); i += 3)
    whole.depth[i] = uint32_t(1 + i), whole.colour[i] = uint32_t(i), whole.normal[i] = uint16_t(7 * i);
  const auto cut = [&](const geometry::Rect& r) {
    image::DepthImage out(r.width, r.height);
    for (int y = 0; y < r.height; ++y)
      for (int x = 0; x < r.width; ++x) {
        const size_t from = size_t(r.y + y) * 48 + size_t(r.x + x), to = size_t(y) * r.width + x;
        out.depth[to] = whole.depth[from], out.colour[to] = whole.colour[from], out.normal[to] = whole.normal[from];
      }
    return out;
  };
  for (const uint64_t frame : {5, 6})
    for (const geometry::Rect& r : {geometry::Rect{32, 0, 16, 32}, {0, 0, 32, 32}})
      ASSERT_TRUE(recorder->add({frame}, camera, r, 2, cut(r)).ok());

  EXPECT_FALSE(std::filesystem::exists(directory + "/frame-000006.depth"));
  std::ifstream in(directory + "/frame-000005.depth", std::ios::binary);
  const std::vector<uint8_t> bytes((std::istreambuf_iterator<char>(in)), {});
  const auto decoded = codec::decode(bytes);
  ASSERT_TRUE(decoded.ok()) << decoded.error().text;
  EXPECT_TRUE(*decoded == whole);
  // The camera, with all digits.
  std::ifstream cameras(directory + "/cameras.csv");
  std::string columns, row, more;
  std::getline(cameras, columns), std::getline(cameras, row);
  EXPECT_EQ(columns, "frame,width,height,px,py,pz,qw,qx,qy,qz,left,right,bottom,top,near_m");
  EXPECT_EQ(
      row, fmt::format("5,48,32,0,0,0,1,0,0,0,{},{},{},{},0.02", camera.left, camera.right, camera.bottom, camera.top));
  EXPECT_FALSE(std::getline(cameras, more)) << more;
  std::filesystem::remove_all(directory);
}

}  // namespace
}  // namespace telesplat::packer
