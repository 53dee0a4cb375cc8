// Descriptions of depth images and run folders by `telesplat inspect`, and the depth that it writes.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/image/normal.h"
#include "services/packer/points/depth_recorder.h"
#include "tools/telesplat/inspect/pictures.h"
#include "tools/telesplat/run/run_report.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;

class InspectFiles : public testing::Test {
 protected:
  InspectFiles() {
    folder_ = (fs::temp_directory_path() /
               (std::string("telesplat-inspect-") + testing::UnitTest::GetInstance()->current_test_info()->name()))
                  .string();
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~InspectFiles() override { fs::remove_all(folder_); }
  std::string file(const std::string& name) const { return folder_ + "/" + name; }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories(fs::path(file(name)).parent_path());
    std::ofstream(file(name), std::ios::binary) << text;
  }
  static std::string read(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  // A recorded depth image: row y is y + 1 metres away, the first column is empty. near: 0.5 m.
  std::string record() const {
    geometry::Camera camera = geometry::make_camera({{1, 2, 3}, {1, 0, 0, 0}}, 90, kWidth, kHeight, 0.5);
    image::DepthImage image(kWidth, kHeight);
    for (int y = 0; y < kHeight; ++y)
      for (int x = 1; x < kWidth; ++x) {
        const size_t i = size_t(y) * kWidth + size_t(x);
        image.depth[i] = image::encode_depth(y + 1, 0.5);
        image.colour[i] = 0xff0000;
        image.normal[i] = image::encode_normal16({0, 0, 1});
      }
    auto recorder = packer::DepthRecorder::open(file("depth"), 1);
    EXPECT_TRUE(recorder.ok());
    EXPECT_TRUE(recorder->add({12}, camera, {0, 0, kWidth, kHeight}, 1, image).ok());
    return file("depth/frame-000012.depth");
  }
  // Checks the rows of a float32 file.
  static void expect_depth(const float* values) {
    for (int y = 0; y < kHeight; ++y) {
      EXPECT_TRUE(std::isinf(values[y * kWidth])) << "nothing is there";
      for (int x = 1; x < kWidth; ++x) EXPECT_NEAR(values[y * kWidth + x], y + 1, 1e-3 * (y + 1));
    }
  }

  static constexpr int kWidth = 8, kHeight = 5;
  std::string folder_;
};

TEST_F(InspectFiles, ADepthImageIsInMetres) {
  const auto picture = inspect_depth_image(record(), std::nullopt);
  ASSERT_TRUE(picture.ok()) << picture.error().text;
  const auto& json = picture->description.json;
  EXPECT_EQ(json["covered_pixels"], 35);
  EXPECT_NEAR(double(json["coverage"]), 35.0 / 40, 1e-9);
  EXPECT_NEAR(double(json["depth_m"]["min"]), 1, 1e-3);
  EXPECT_NEAR(double(json["depth_m"]["median"]), 3, 1e-3);
  EXPECT_NEAR(double(json["depth_m"]["max"]), 5, 1e-3);
  EXPECT_EQ(json["camera"]["position"], (nlohmann::ordered_json{1.0, 2.0, 3.0}));
  EXPECT_EQ(json["camera"]["near_m"], 0.5);
  const std::string table = picture->description.table();
  for (const char* part : {"8 x 5 pixels", "87.50 %", "1.0000 .. 5.0000 m, median 3.0000 m", "near plane 0.5 m"})
    EXPECT_NE(table.find(part), std::string::npos) << part << " is not in\n" << table;
  expect_depth(picture->view.depth_m.data());
}

TEST_F(InspectFiles, WithoutACameraMetresNeedTheNearPlane) {
  const std::string path = record();
  fs::remove(file("depth/cameras.csv"));
  const auto codes = inspect_depth_image(path, std::nullopt);
  ASSERT_TRUE(codes.ok()) << codes.error().text;
  EXPECT_NE(codes->description.table().find("--near"), std::string::npos);
  const Status refused = write_depth(file("a.npy"), *codes, path);
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().text.find("--near"), std::string::npos) << refused.error().text;
  const auto metres = inspect_depth_image(path, 0.5);
  ASSERT_TRUE(metres.ok());
  expect_depth(metres->view.depth_m.data());
}

TEST_F(InspectFiles, DepthIsWrittenAsNpy) {
  const auto picture = inspect_depth_image(record(), std::nullopt);
  ASSERT_TRUE(picture.ok());
  ASSERT_TRUE(write_depth(file("a.npy"), *picture, "x").ok());
  const std::string bytes = read(file("a.npy"));
  ASSERT_EQ(bytes.size(), 128u + 4 * kWidth * kHeight);
  EXPECT_EQ(bytes.substr(0, 8), std::string("\x93NUMPY\1\0", 8));
  EXPECT_EQ(bytes.substr(10, 59), "{'descr': '<f4', 'fortran_order': False, 'shape': (5, 8), }");
  EXPECT_EQ(uint8_t(bytes[8]) + 256 * uint8_t(bytes[9]), 128 - 10);
  EXPECT_EQ(bytes[127], '\n');
  std::vector<float> values(kWidth * kHeight);
  std::memcpy(values.data(), bytes.data() + 128, bytes.size() - 128);
  expect_depth(values.data());
  if (std::system("python3 -c 'import numpy' 2>/dev/null") != 0) GTEST_SKIP() << "numpy is not there to read it, too";
  const std::string check = "python3 -c \"import numpy; a = numpy.load('" + file("a.npy") +
                            "'); assert a.shape == (5, 8) and a.dtype == numpy.float32; "
                            "assert abs(a[4, 7] - 5) < 0.01 and numpy.isinf(a[2, 0])\"";
  EXPECT_EQ(std::system(check.c_str()), 0);
}

TEST_F(InspectFiles, DepthIsWrittenAsExr) {
  const auto picture = inspect_depth_image(record(), std::nullopt);
  ASSERT_TRUE(picture.ok());
  ASSERT_TRUE(write_depth(file("a.exr"), *picture, "x").ok());
  const auto again = inspect_picture(file("a.exr"));
  ASSERT_TRUE(again.ok()) << again.error().text;
  expect_depth(again->view.depth_m.data());
  EXPECT_EQ(again->view.colour[1] & 0xffffff, 0xff0000u);
  EXPECT_NE(read(file("a.exr")).find("N.X"), std::string::npos);
  const Status odd = write_depth(file("a.tif"), *picture, "x");
  ASSERT_FALSE(odd.ok());
  EXPECT_NE(odd.error().text.find(".npy or .exr"), std::string::npos);
}

TEST_F(InspectFiles, DamagedDepthImagesAndCamerasAreRefused) {
  const std::string path = record();
  write("depth/cameras.csv",
        "frame,width,height,px,py,pz,qw,qx,qy,qz,left,right,bottom,top,near_m\n12,8,5,0,0,0,1,0,0,0,"
        "-1,1,-1,1,0\n");
  const auto camera = inspect_depth_image(path, std::nullopt);
  ASSERT_FALSE(camera.ok()) << "a near plane of 0";
  EXPECT_NE(camera.error().text.find("cameras.csv:2"), std::string::npos) << camera.error().text;
  fs::resize_file(path, fs::file_size(path) / 2);
  const auto cut = inspect_depth_image(path, 0.5);
  ASSERT_FALSE(cut.ok());
  EXPECT_TRUE(cut.error().text.starts_with(path)) << cut.error().text;
}

TEST_F(InspectFiles, ARunFolderIsATableItsFilesSortedWhateverItsSummarySays) {
  write("run/summary.json", "{\"scene\": 3}");
  write("run/images/b.png", "12");
  write("run/images/a.png", "1");
  write("run/frames.csv", "123");
  fs::create_directory_symlink(file("run"), file("latest"));
  for (const char* name : {"run", "latest"}) {
    const auto told = inspect_run(file(name));
    ASSERT_TRUE(told.ok()) << told.error().text;
    EXPECT_EQ(told->json["summary"]["scene"], 3);
    std::vector<std::string> files;
    for (const auto& f : told->json["files"]) files.push_back(f["name"]);
    EXPECT_EQ(files, (std::vector<std::string>{"frames.csv", "summary.json", "images/a.png", "images/b.png"}));
    EXPECT_NE(told->table().find("figures"), std::string::npos) << told->table();
    EXPECT_NE(told->table().find("3 bytes in 2 files"), std::string::npos) << told->table();
  }
  for (const char* text : {"", "[]", "{", "null"}) {
    write("bad/summary.json", text);
    const auto refused = inspect_run(file("bad"));
    ASSERT_FALSE(refused.ok()) << text;
    EXPECT_NE(refused.error().text.find("summary.json"), std::string::npos);
  }
}

TEST_F(InspectFiles, AJuliaRunWithoutItsPlacementIsToldAllTheSame) {
  write("run/summary.json", "{}");
  write("run/session.toml", "[scene]\nkind = \"julia\"\n[julia]\n");
  const auto told = inspect_run(file("run"));
  ASSERT_TRUE(told.ok()) << told.error().text;
  EXPECT_NE(told->table().find("cannot be told"), std::string::npos) << told->table();
}

}  // namespace
}  // namespace telesplat::launcher
