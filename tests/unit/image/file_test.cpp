// Writes pictures to files and reads them back.
#include "common/image/file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>

namespace telesplat::image {
namespace {

class ImageFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = std::filesystem::temp_directory_path() / ("image_file_test." + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }
  std::string path(const char* name) const { return (folder_ / name).string(); }
  size_t files() const {
    return size_t(std::distance(std::filesystem::directory_iterator(folder_), std::filesystem::directory_iterator{}));
  }

  std::filesystem::path folder_;
};

// Every value of every channel; an odd size.
View all_values() {
  View v{37, 29, {}, {}};
  for (uint32_t i = 0; i < 37 * 29; ++i) {
    v.colour.push_back((i & 255) << 16 | (i * 7 & 255) << 8 | (i * 31 & 255));
    v.depth_m.push_back(i % 5 == 0 ? std::numeric_limits<float>::infinity() : 0.02f + 0.001234567f * float(i));
  }
  return v;
}

TEST_F(ImageFile, PngKeepsEveryColour) {
  const View v = all_values();
  ASSERT_TRUE(write_png(path("a.png"), v).ok());
  const auto read = read_view(path("a.png"));
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(read->width, v.width);
  EXPECT_EQ(read->height, v.height);
  EXPECT_EQ(read->colour, v.colour);
  EXPECT_TRUE(read->depth_m.empty());
  EXPECT_EQ(files(), 1u);  // nothing else is left behind
}

TEST_F(ImageFile, PicturesAreNotWrittenThroughLinks) {
  const View v = all_values();
  std::ofstream(folder_ / "precious") << "precious";
  for (const char* name : {"a.png", "a.png.part", "a.exr", "a.exr.part"})
    std::filesystem::create_symlink(folder_ / "precious", folder_ / name);
  ASSERT_TRUE(write_png(path("a.png"), v).ok());
  ASSERT_TRUE(write_exr(path("a.exr"), v).ok());
  EXPECT_EQ(std::filesystem::file_size(folder_ / "precious"), 8u);
  EXPECT_TRUE(read_view(path("a.png")).ok() && read_view(path("a.exr")).ok());
  EXPECT_EQ(files(), 5u);
}

TEST_F(ImageFile, ExrKeepsEveryColourAndEveryDepthBit) {
  const View v = all_values();
  ASSERT_TRUE(write_exr(path("a.exr"), v).ok());
  const auto read = read_view(path("a.exr"));
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(read->colour, v.colour);
  EXPECT_EQ(read->depth_m, v.depth_m);
}

TEST_F(ImageFile, WritingReplacesWhatWasThere) {
  View v = all_values();
  ASSERT_TRUE(write_png(path("a.png"), v).ok());
  v.colour[3] ^= 0xff;
  ASSERT_TRUE(write_png(path("a.png"), v).ok());
  EXPECT_EQ(read_view(path("a.png"))->colour, v.colour);
}

TEST_F(ImageFile, UnwritablePathsAreNamedAndNothingIsLeft) {
  const std::string bad = path("no/such/folder/a.png");
  const Status written = write_png(bad, all_values());
  ASSERT_FALSE(written.ok());
  EXPECT_NE(written.error().text.find(bad), std::string::npos) << written.error().text;
  EXPECT_FALSE(write_exr(path("no/such/folder/a.exr"), all_values()).ok());
  EXPECT_EQ(files(), 0u);

  // A folder has the file's name: the rename fails, and the temporary file is deleted.
  std::filesystem::create_directories(path("taken.png") + "/inside");
  EXPECT_FALSE(write_png(path("taken.png"), all_values()).ok());
  EXPECT_EQ(files(), 1u);
}

TEST_F(ImageFile, UnreadableFilesAreNamed) {
  std::ofstream(path("text.png")) << "this is not a picture";
  for (const char* name : {"missing.png", "text.png", "."}) {
    const auto read = read_view(path(name));
    ASSERT_FALSE(read.ok()) << name;
    EXPECT_NE(read.error().text.find(path(name)), std::string::npos) << read.error().text;
  }
}

// Not every reader: a hostile file could choose among them.
TEST_F(ImageFile, TheReaderOfTheNameAloneIsAsked) {
  ASSERT_TRUE(write_exr(path("a.exr"), all_values()).ok());
  std::ifstream in(path("a.exr"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (const char* name : {"no.png", "no.heic", "no.mp4", "no", "exr", "a.exr.txt"}) {
    std::ofstream(path(name), std::ios::binary) << bytes;
    const auto read = read_view(path(name));
    ASSERT_FALSE(read.ok()) << name;
    EXPECT_NE(read.error().text.find(path(name)), std::string::npos) << read.error().text;
  }
  std::filesystem::copy(path("a.exr"), path("a.EXR"));
  EXPECT_TRUE(read_view(path("a.EXR")).ok());
}

// In memory the first bytes give the format; if they do not, the name does.
TEST_F(ImageFile, PicturesWithWrongNamesAreKnownByTheirBytes) {
  View v = all_values();
  ASSERT_TRUE(write_exr(path("a.exr"), v).ok());
  ASSERT_TRUE(write_png(path("a.png"), v).ok());
  const auto read = [&](const char* file, const char* name) {
    std::ifstream in(path(file), std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    return read_picture(std::as_bytes(std::span(bytes)), name, 1u << 26);
  };
  for (const char* name : {"wood.tga", "wood", "wood.heic"})
    for (const char* file : {"a.exr", "a.png"}) EXPECT_TRUE(read(file, name).ok()) << file << " as " << name;
  std::ofstream(path("letters")) << "these are no picture at all";
  const auto none = read("letters", "wood.heic");
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find("wood.heic: it is none of png, jpg"), std::string::npos) << none.error().text;
}

TEST_F(ImageFile, TruncatedFilesAreRefusedAtEveryLength) {
  View v{8, 8, std::vector<uint32_t>(64), std::vector<float>(64, 1.0f)};
  for (uint32_t i = 0; i < 64; ++i) v.colour[i] = i * 0x051709;
  ASSERT_TRUE(write_exr(path("whole.exr"), v).ok());
  std::ifstream in(path("whole.exr"), std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  for (size_t length = 0; length < bytes.size(); length += 7) {
    std::ofstream(path("cut.exr"), std::ios::binary) << bytes.substr(0, length);
    EXPECT_FALSE(read_view(path("cut.exr")).ok()) << length;
  }
}

// Headers of PNG files without pixels.
TEST_F(ImageFile, AHeaderThatClaimsTooMuchIsRefused) {
  const std::string before("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16), after("\x08\x02\0\0\0", 5);
  const auto header = [&](const char* name, const std::string& side, const std::string& check) {
    std::ofstream(path(name), std::ios::binary)
        << before << side << side << after << check << std::string("\0\0\0\3IDAT", 8);
    return read_view(path(name));
  };
  const auto huge = header("huge.png", std::string("\0\x01\x86\xa0", 4), "\x27\x30\x9c\x9f");  // 100,000 pixels a side
  ASSERT_FALSE(huge.ok());
  EXPECT_NE(huge.error().text.find(path("huge.png")), std::string::npos) << huge.error().text;
  EXPECT_NE(huge.error().text.find("16384"), std::string::npos) << huge.error().text;
  const auto large = header("large.png", std::string("\0\0\x40\0", 4), "\x26\xaa\x87\xd3");  // 16384 pixels a side
  EXPECT_FALSE(large.ok());
}

// Colours over black, like those of pictures without alpha.
TEST_F(ImageFile, PngWithAlphaIsReadOverBlack) {
  View v{2, 1, {0xff806040, 0x80403020}, {}};
  ASSERT_TRUE(write_png(path("a.png"), v, Alpha::kCoverage).ok());
  const auto read = read_view(path("a.png"));
  ASSERT_TRUE(read.ok()) << read.error().text;
  EXPECT_EQ(read->colour[0], 0x806040u);
  for (int shift : {0, 8, 16})
    EXPECT_NEAR(int(read->colour[1] >> shift & 255), int(v.colour[1] >> shift & 255), 1) << shift;
}

}  // namespace
}  // namespace telesplat::image
