#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <limits>

#include "client/viewer/record/frame_spool.h"
#include "client/viewer/viewer_options.h"
#include "common/core/log.h"

namespace telesplat::viewer {
namespace {

namespace fs = std::filesystem;

class Spool : public testing::Test {
 protected:
  const std::string directory_ =
      (fs::temp_directory_path() /
       (std::string("telesplat-spool-") + testing::UnitTest::GetInstance()->current_test_info()->name()))
          .string();
  Spool() { fs::remove_all(directory_); }
  ~Spool() override { fs::remove_all(directory_); }

  static SpooledFrame frame(uint64_t number, uint32_t use) {
    SpooledFrame f{number,
                   0.25 * double(number),
                   use,
                   geometry::make_camera({}, 90, 20, 10),
                   {20, 10, std::vector<uint32_t>(200, 0x102030), std::vector<float>(200, 1.5f)},
                   {40 + number}};
    f.view.depth_m[7] = std::numeric_limits<float>::infinity();
    f.view.colour[9] = uint32_t(number);
    return f;
  }
};

TEST_F(Spool, FramesComeBackAsTheyWere) {
  auto spool = FrameSpool::open(directory_);
  ASSERT_TRUE(spool.ok());
  const image::View next = (*spool)->exchange(frame(3, kVerify));
  EXPECT_EQ(next.colour.size(), 200u);
  EXPECT_EQ(next.depth_m.size(), 200u);
  (*spool)->flush();
  const auto paths = spooled_frames(directory_);
  ASSERT_EQ(paths.size(), 1u);
  const auto back = read_spooled_frame(paths[0]);
  ASSERT_TRUE(back.ok()) << back.error().text;
  const SpooledFrame expected = frame(3, kVerify);
  EXPECT_EQ(back->number, 3u);
  EXPECT_EQ(back->use, kVerify);
  EXPECT_EQ(back->epoch, (EpochId{43}));
  EXPECT_TRUE(back->camera == expected.camera);
  EXPECT_EQ(back->view.colour, expected.view.colour);
  EXPECT_EQ(back->view.depth_m, expected.view.depth_m);
}

// An exception in the thread that writes: it gets no memory for a frame.
TEST_F(Spool, AFrameThatCannotBeMadeIsCountedAndOthersFollow) {
#ifdef TELESPLAT_SANITIZED
  GTEST_SKIP() << "sanitizers need the memory that is taken away here";
#endif
  const auto write = [&] {
    log::initialise("viewer", "info");
    auto spool = FrameSpool::open(directory_);
    SpooledFrame large = frame(1, kPicture);
    auto legend = std::make_shared<image::Legend>();
    legend->title = std::string(size_t{512} << 20, 'x');
    large.legend = legend;
    rlimit few{};
    getrlimit(RLIMIT_AS, &few);
    long pages = 0;
    std::ifstream("/proc/self/statm") >> pages;
    few.rlim_cur = rlim_t(pages) * rlim_t(sysconf(_SC_PAGESIZE)) + (size_t{256} << 20);
    setrlimit(RLIMIT_AS, &few);
    (*spool)->exchange(std::move(large));
    (*spool)->exchange(frame(2, kPicture));
    (*spool)->flush();
    std::_Exit((*spool)->failed() == 1 && spooled_frames(directory_).size() == 1 ? 0 : 1);
  };
  EXPECT_EXIT(write(), testing::ExitedWithCode(0), "writing a frame failed: ");
}

TEST_F(Spool, AFullDiskIsSaidOnce) {
  std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  auto spool = FrameSpool::open(directory_);
  ASSERT_TRUE(spool.ok());
  testing::internal::CaptureStdout();
  const rlimit small{1000, before.rlim_max};  // smaller than a frame
  setrlimit(RLIMIT_FSIZE, &small);
  for (uint64_t i = 0; i < 20; ++i) {
    EXPECT_EQ((*spool)->exchange(frame(i, kPicture)).colour.size(), 200u) << "the display goes on";
    (*spool)->flush();
  }
  setrlimit(RLIMIT_FSIZE, &before);
  (*spool)->exchange(frame(20, kPicture));
  (*spool)->flush();
  const std::string said = testing::internal::GetCapturedStdout();
  EXPECT_EQ((*spool)->failed(), 20u);
  EXPECT_EQ((*spool)->dropped(), 0u) << "the disk was fast enough";
  const size_t first = said.find("frames cannot be written");
  EXPECT_NE(first, std::string::npos) << said;
  EXPECT_EQ(said.find("frames cannot be written", first + 1), std::string::npos) << "a line, not twenty: " << said;
  ASSERT_EQ(spooled_frames(directory_).size(), 1u) << "once there is room it goes on";
  EXPECT_EQ(std::distance(fs::directory_iterator(directory_), {}), 1) << "no halves";
}

TEST_F(Spool, PicturesAreDevelopedAndOnlyFramesToVerifyStay) {
  {
    auto spool = FrameSpool::open(directory_);
    for (const auto& [number, use] :
         {std::pair{1, uint32_t(kPicture)}, {2, uint32_t(kVerify)}, {3, uint32_t(kPicture | kVerify | kExr)}}) {
      (*spool)->exchange(frame(uint64_t(number), use));
      (*spool)->flush();
    }
  }
  ASSERT_TRUE(develop_frames(directory_, directory_ + "/images", nullptr).ok());
  EXPECT_TRUE(fs::exists(directory_ + "/images/frame-000001.png"));
  EXPECT_FALSE(fs::exists(directory_ + "/images/frame-000002.png"));
  EXPECT_TRUE(fs::exists(directory_ + "/images/frame-000003.exr"));
  EXPECT_EQ(spooled_frames(directory_).size(), 2u);
}

TEST_F(Spool, TransparentPicturesHaveAlpha) {
  {
    auto spool = FrameSpool::open(directory_);
    for (const auto& [number, use] : {std::pair{1, uint32_t(kPicture)}, {2, uint32_t(kPicture | kTransparent)}}) {
      (*spool)->exchange(frame(uint64_t(number), use));
      (*spool)->flush();
    }
  }
  ASSERT_TRUE(develop_frames(directory_, directory_ + "/images", nullptr).ok());
  for (const int number : {1, 2}) {
    std::ifstream in(directory_ + "/images/frame-00000" + std::to_string(number) + ".png", std::ios::binary);
    char header[26] = {};
    ASSERT_TRUE(in.read(header, sizeof header));
    EXPECT_EQ(int(header[25]), number == 1 ? 2 : 6) << "RGB, RGBA";
  }
}

// Frames are compared with references, so legends go only onto the pictures that people look at.
TEST_F(Spool, LegendsAreDrawnOntoPicturesAndLeaveFramesToVerifyAlone) {
  const auto large = [](uint64_t number, uint32_t use) {
    SpooledFrame f = frame(number, use);
    f.camera = geometry::make_camera({}, 90, 640, 400);
    f.view = {640, 400, std::vector<uint32_t>(640 * 400, 0x203040), {}};
    return f;
  };
  const auto legend =
      std::make_shared<const image::Legend>(image::Legend{"depth [m]", 0, 10, *colour::find_colour_map("viridis"), {}});
  {
    auto spool = FrameSpool::open(directory_);
    SpooledFrame with = large(1, kPicture | kVerify), left = large(3, kPicture);
    with.legend = left.legend = legend;
    with.part = {640, 400, 0, 0};
    left.part = {1280, 400, 0, 0};  // the left half of a wall
    for (auto* f : {&with, &left}) {
      (*spool)->exchange(std::move(*f));
      (*spool)->flush();
    }
    (*spool)->exchange(large(2, kPicture));
    (*spool)->flush();
  }
  const auto kept = read_spooled_frame(spooled_frames(directory_).at(0));
  ASSERT_TRUE(kept) << kept.error().text;
  ASSERT_TRUE(kept->legend);
  EXPECT_EQ(*kept->legend, *legend);
  ASSERT_TRUE(develop_frames(directory_, directory_ + "/images", nullptr).ok());
  const auto with = image::read_view(directory_ + "/images/frame-000001.png");
  const auto without = image::read_view(directory_ + "/images/frame-000002.png");
  const auto left = image::read_view(directory_ + "/images/frame-000003.png");
  ASSERT_TRUE(with && without && left);
  const auto has = [](const image::View& view, uint32_t c) {
    return std::find(view.colour.begin(), view.colour.end(), c) != view.colour.end();
  };
  EXPECT_TRUE(has(*with, legend->map.at(1)));
  EXPECT_EQ(without->colour, std::vector<uint32_t>(640 * 400, 0x203040));
  EXPECT_EQ(left->colour, without->colour) << "the legend lies in the wall's lower right corner";
  const auto again = read_spooled_frame(spooled_frames(directory_).at(0));
  EXPECT_EQ(again->view.colour, std::vector<uint32_t>(640 * 400, 0x203040));
}

TEST_F(Spool, FilesThatAreNoFramesAreRefused) {
  {
    auto spool = FrameSpool::open(directory_);
    (*spool)->exchange(frame(1, kVerify));
    (*spool)->flush();
  }
  const std::string path = spooled_frames(directory_).at(0);
  const auto size = fs::file_size(path);
  for (const auto length : {size - 1, size_t{50}, size_t{0}}) {
    fs::resize_file(path, length);
    EXPECT_FALSE(read_spooled_frame(path).ok()) << length;
  }
  EXPECT_FALSE(read_spooled_frame(directory_).ok());
  EXPECT_FALSE(FrameSpool::open("/proc/no/such/place").ok());
}

TEST_F(Spool, FramesOfAnEarlierVersionAreNamed) {
  {
    auto spool = FrameSpool::open(directory_);
    (*spool)->exchange(frame(1, kVerify));
    (*spool)->flush();
  }
  const std::string path = spooled_frames(directory_).at(0);
  std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
  file.seekp(7).put('1');
  file.close();
  const auto back = read_spooled_frame(path);
  ASSERT_FALSE(back.ok());
  EXPECT_NE(back.error().text.find(path), std::string::npos);
  EXPECT_NE(back.error().text.find("version '1' instead of '4'"), std::string::npos) << back.error().text;
}

TEST(ParseSize, TakesWidthAndHeightWithinLimits) {
  EXPECT_EQ(*parse_size("2560x1600", "--size"), (std::pair{2560, 1600}));
  for (const char* bad : {"", "x", "100", "100x", "x100", "100x100x100", "0x100", "100x8", "20000x100", "-100x100",
                          "1e3x100", "100 x100", "99999999999x100"})
    EXPECT_FALSE(parse_size(bad, "--size").ok()) << bad;
}

}  // namespace
}  // namespace telesplat::viewer
