// The record of slice images: the replay gives back the frames that a viewer could display, and a file of any content
// does no harm.
#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <random>

#include "client/viewer/record/slice_record.h"
#include "client/viewer/slices/cache.h"
#include "common/wire/serial.h"
#include "tests/support/volume/frames.h"
#include "tests/support/volume/slices.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

struct Sent {
  std::string bytes;  // slice images; message.data points into it
  wire::SliceFrame message;
};

// A frame seen from an angle that depends on its number.
std::unique_ptr<Sent> sent(uint64_t number, const volume::Grid& grid) {
  auto out = std::make_unique<Sent>();
  wire::SliceFrame& f = out->message;
  f.packer = {7};
  f.epoch = {1 + number / 3};
  f.frame = {number};
  f.viewer = {5};
  f.request = {number};
  f.camera = testing::looking_at(grid.centre_room(), testing::orbit(grid, 0.9, 0.3 * double(number), 0.3), 80, 60);
  volume::PlanOptions options;
  options.layers = 6;
  f.shear = volume::plan_frame(grid, std::span(&f.camera, 1), options).value();
  std::vector<uint8_t> bytes;
  for (int l = 0; l < int(f.shear.layers.size()); ++l)
    volume::encode_slice(testing::blobs(f.shear, l, {0, 0, f.shear.width, f.shear.height}), bytes);
  out->bytes.assign(bytes.begin(), bytes.end());
  f.data = std::as_bytes(std::span(out->bytes));
  return out;
}

class SliceRecord : public ::testing::Test {
 protected:
  const std::string path_ =
      (fs::temp_directory_path() / (std::string("telesplat-slices-") + std::to_string(getpid()) +
                                    ::testing::UnitTest::GetInstance()->current_test_info()->name()))
          .string();
  const volume::Grid grid_ = testing::turned_grid();
  ~SliceRecord() override { fs::remove(path_); }

  void record(const std::vector<uint64_t>& numbers, uint64_t max_bytes = 1u << 30) const {
    SliceRecorder recorder(path_, max_bytes);
    for (const uint64_t n : numbers) recorder.add(grid_, sent(n, grid_)->message);
  }
  std::string bytes() const {
    std::ifstream in(path_, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::string& content) const { std::ofstream(path_, std::ios::binary | std::ios::trunc) << content; }
  static std::string part(std::string_view type, std::string_view body) {
    std::string out(12, '\0');
    const auto type_bytes = uint32_t(type.size());
    const auto body_bytes = uint64_t(body.size());
    std::memcpy(out.data(), &type_bytes, 4);
    std::memcpy(out.data() + 4, &body_bytes, 8);
    return out.append(type).append(body);
  }
  // Looks for frame 1 in such a file. Returns the error, "found" or "ends".
  std::string outcome(const std::string& content) const {
    write(content);
    auto replay = SliceReplay::open(path_);
    if (!replay) return replay.error().text;
    const auto found = (*replay)->advance({1}, 0);
    return !found ? found.error().text : *found ? "found" : "ends";
  }
};

void expect_same(const volume::VolumeFrame& a, const volume::VolumeFrame& b) {
  EXPECT_EQ(a.grid, b.grid);
  EXPECT_EQ(a.frame, b.frame);
  EXPECT_EQ(a.epoch, b.epoch);
  ASSERT_EQ(a.layers.size(), b.layers.size());
  for (size_t i = 0; i < a.layers.size(); ++i) EXPECT_EQ(a.layers[i].texels, b.layers[i].texels) << "layer " << i;
}

TEST_F(SliceRecord, FramesComeBackAsTheyWere) {
  record({1, 2, 3, 5, 8});
  auto replay = SliceReplay::open(path_);
  ASSERT_TRUE(replay.ok()) << replay.error().text;
  EXPECT_EQ((*replay)->frame(), nullptr);
  for (const uint64_t n : {1, 3, 3, 8}) {  // 2 was never displayed, 3 twice
    const auto found = (*replay)->advance({n}, 0);
    ASSERT_TRUE(found.ok()) << found.error().text;
    ASSERT_TRUE(*found) << n;
    std::vector<volume::SliceImage> images;
    const auto expected = decode_frame(sent(n, grid_)->message, grid_, images);
    expect_same(*(*replay)->frame(), *expected->frame);
  }
  EXPECT_FALSE(*(*replay)->advance({9}, 0)) << "the record ends before it";
  EXPECT_EQ((*replay)->newest().value, 8u);
}

TEST_F(SliceRecord, AnotherMastersFramesAreToldFromTheFirstOnes) {
  record({1, 2, 3, 1, 2, 3});
  auto replay = SliceReplay::open(path_);
  ASSERT_TRUE(*(*replay)->advance({1}, 0));
  ASSERT_TRUE(*(*replay)->advance({3}, 1));
  EXPECT_FALSE(*(*replay)->advance({1}, 2));
}

TEST_F(SliceRecord, AChangedGridIsKept) {
  volume::Grid other = grid_;
  other.size = {30, 30, 30};
  {
    SliceRecorder recorder(path_, 1u << 30);
    recorder.add(grid_, sent(1, grid_)->message);
    recorder.add(other, sent(2, other)->message);
  }
  auto replay = SliceReplay::open(path_);
  ASSERT_TRUE(*(*replay)->advance({1}, 0));
  EXPECT_EQ((*replay)->frame()->grid, grid_);
  ASSERT_TRUE(*(*replay)->advance({2}, 0));
  EXPECT_EQ((*replay)->frame()->grid, other);
}

TEST_F(SliceRecord, TheLimitLeavesOutTheRest) {
  record({1, 2, 3, 4});
  const uint64_t whole = fs::file_size(path_);
  record({1, 2, 3, 4}, whole / 2);
  EXPECT_LE(fs::file_size(path_), whole / 2 + 8);
  auto replay = SliceReplay::open(path_);
  EXPECT_TRUE(*(*replay)->advance({1}, 0));
  EXPECT_FALSE(*(*replay)->advance({4}, 0));
}

TEST_F(SliceRecord, ASessionWithoutSlicesLeavesNoFile) {
  { SliceRecorder recorder(path_, 1u << 30); }
  EXPECT_FALSE(fs::exists(path_));
}

TEST_F(SliceRecord, CutAnywhereItEndsBeforeTheCut) {
  record({1, 2});
  const std::string whole = bytes();
  for (size_t length = 0; length < whole.size(); length += 1 + length / 40) {
    write(whole.substr(0, length));
    auto replay = SliceReplay::open(path_);
    if (length < 8) {
      ASSERT_FALSE(replay.ok()) << length;
      EXPECT_NE(replay.error().text.find(path_), std::string::npos);
      continue;
    }
    ASSERT_TRUE(replay.ok()) << length;
    const auto second = (*replay)->advance({2}, 0);
    ASSERT_TRUE(second.ok()) << length << ": " << second.error().text;
    EXPECT_FALSE(*second) << length;
  }
}

TEST_F(SliceRecord, WhatIsNoRecordIsRefusedByName) {
  for (const std::string& content : {std::string(), std::string("TSSLICE"), std::string("TSSLICE9 and more"),
                                     std::string("TSEVENT3"), std::string(1000, '\xff')}) {
    const std::string error = outcome(content);
    EXPECT_NE(error.find(path_ + ": is not a record of slice images"), std::string::npos) << error;
  }
  EXPECT_FALSE(SliceReplay::open(path_ + ".none").ok());
}

TEST_F(SliceRecord, FramesThatCannotBeAreErrorsThatNameTheFile) {
  record({1});
  const std::string whole = bytes(), grid = whole.substr(8, 12 + 4 + 144), frame = whole.substr(8 + grid.size());
  ASSERT_EQ(outcome("TSSLICE1" + grid + frame), "found");
  std::string no_voxels = grid, huge = grid, placed_nowhere = grid;
  std::memset(no_voxels.data() + 16, 0, 4);
  std::memset(huge.data() + 16, 0xff, 12);
  std::memset(placed_nowhere.data() + 16 + 16, 0xff, 8);  // NaN
  const std::pair<std::string, std::string> cases[] = {{frame, "before any grid"},
                                                       {part("grid", "short"), "5 bytes instead of 144"},
                                                       {no_voxels + frame, "voxels"},
                                                       {huge + frame, "voxels"},
                                                       {placed_nowhere + frame, "placement"},
                                                       {grid + part("nonsense", "body"), "no frame"},
                                                       {grid + part("slice_frame", "no map"), "slice_frame"},
                                                       {grid + part("slice_frame", ""), "slice_frame"}};
  for (const auto& [content, reason] : cases) {
    const std::string error = outcome("TSSLICE1" + content);
    EXPECT_NE(error.find(path_), std::string::npos) << reason << ": " << error;
    EXPECT_NE(error.find(reason), std::string::npos) << reason << ": " << error;
  }
}

TEST_F(SliceRecord, ClaimedLengthsAllocateNothing) {
  for (const uint64_t claimed : {uint64_t(1) << 40, ~uint64_t(0), ~uint64_t(0) - 11}) {
    std::string content = "TSSLICE1" + part("slice_frame", "abc");
    std::memcpy(content.data() + 12, &claimed, 8);
    EXPECT_EQ(outcome(content), "ends");
  }
}

TEST_F(SliceRecord, DamagedBytesNeverEndTheProgram) {
  record({1});
  const std::string whole = bytes();
  std::mt19937 random(7);
  int refused = 0;
  for (int round = 0; round < 300; ++round) {
    std::string content = whole;
    // Mostly at the beginning, where lengths and numbers are.
    const size_t most = round % 2 ? content.size() - 8 : 900;
    for (int n = 1 + round % 5; n > 0; --n) content[8 + random() % most] = char(random());
    const std::string result = outcome(content);
    if (result == "found" || result == "ends") continue;
    ++refused;
    EXPECT_NE(result.find(path_), std::string::npos) << result;
  }
  EXPECT_GT(refused, 30);
}

}  // namespace
}  // namespace telesplat::viewer
