// Movies of recorded runs: their frames are those that were displayed, to the last bit; what goes wrong is said.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "common/image/file.h"
#include "common/splat/finish.h"
#include "tests/support/patience.h"
#include "tests/support/pipeline_run.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::test {
namespace {

namespace fs = std::filesystem;

struct Outcome {
  int code = 0;
  std::string out, err;
};

Outcome telesplat(const TemporaryFolder& folder, const std::vector<std::string>& arguments) {
  Program program("telesplat", arguments, folder / "telesplat");
  Outcome o;
  o.code = program.wait(100);
  o.out = program.out();
  o.err = program.err();
  return o;
}

Outcome movie(const PipelineRun& run, const std::string& file, std::vector<std::string> more = {}) {
  more.insert(more.begin(), {"movie", run.out(), file});
  return telesplat(run.folder(), more);
}

size_t lines(const std::string& text) { return size_t(std::count(text.begin(), text.end(), '\n')); }

// Where the program is not, what needs it is skipped.
std::string need(const char* program) { return launcher::find_program(program); }

const std::vector<std::string> kEveryFrame{"--record-every", "1", "--duration", "2", "--size", "160x120"};

std::vector<std::string> with(std::vector<std::string> a, const std::vector<std::string>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(Movie, OfAMeshShowsWhatWasDisplayedToTheLastBit) {
  PipelineRun run(kEveryFrame);
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  EXPECT_GT(expect_as_displayed(run, 25), 20u);
  const auto made = run.column("frames.csv", "summaries");
  EXPECT_GT(made.back(), 0) << "nothing was drawn from summaries: the test shows less than it should";
}

// Sets the last column of all rows of frames.csv, which is `halved`.
void set_halved(const PipelineRun& run, char value) {
  const std::string path = run.out() + "/frames.csv";
  std::ifstream in(path);
  std::string line, all;
  std::getline(in, line);
  ASSERT_TRUE(line.ends_with(",halved")) << line;
  for (all = line + "\n"; std::getline(in, line); all += line + "\n") line.back() = value;
  std::ofstream(path) << all;
}

// The machine decides which frames are drawn at half their size; so the test writes that into the record.
TEST(Movie, OfFramesOfHalfTheirSizeShowsThemDoubled) {
  PipelineRun run({"--duration", "1", "--size", "160x120", "--still-samples", "1"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const std::string whole = run.folder() / "whole", half = run.folder() / "half";
  set_halved(run, '1');
  ASSERT_EQ(movie(run, whole + "/", {"--fps", "5"}).code, 0);
  set_halved(run, '0');
  ASSERT_EQ(movie(run, half + "/", {"--fps", "5", "--size", "80x60"}).code, 0);
  int compared = 0;
  for (; fs::exists(fmt::format("{}/{:06}.png", half, compared)); ++compared) {
    auto small = image::read_view(fmt::format("{}/{:06}.png", half, compared));
    const auto large = image::read_view(fmt::format("{}/{:06}.png", whole, compared));
    ASSERT_TRUE(small.ok() && large.ok());
    std::vector<uint32_t> doubled(160 * 120);
    splat::double_rows({80, 60, small->colour.data(), nullptr}, {160, 120, doubled.data(), nullptr}, 0, 120);
    ASSERT_EQ(large->colour.size(), doubled.size());
    size_t different = 0;
    for (size_t i = 0; i < doubled.size(); ++i) different += ((large->colour[i] ^ doubled[i]) & 0xffffff) != 0;
    EXPECT_EQ(different, 0u) << "frame " << compared;
  }
  EXPECT_GE(compared, 5);
}

// Frames that waited for updates, too.
TEST(Movie, OfAMeshDrawnByOpenGlShowsWhatWasDisplayedToTheLastBit) {
  PipelineRun run(
      with(kEveryFrame, {"--renderer", "gl", "--splat", "ellipse", "--shading", "head", "--coupling", "loose"}));
  const int code = run.program().wait();
  if (code != 0) GTEST_SKIP() << "no OpenGL: " << run.program().err();
  EXPECT_GT(expect_as_displayed(run, 10), 5u);
}

// A movie goes as far as its record: where that was cut short it ends and says so; another file is refused.
TEST(Movie, OfAVolumeShowsWhatWasDisplayedToTheLastBit) {
  TemporaryFolder data;
  write_volume(data / "balls.mha");
  PipelineRun run(with(kEveryFrame, {"--samplers", "2"}), data / "balls.mha");
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const std::string record = run.out() + "/slices.events", good = read_text(record);
  EXPECT_GT(expect_as_displayed(run, 30), 20u);

  fs::resize_file(record, good.size() / 2);
  const Outcome cut = movie(run, run.folder() / "cut/", {"--fps", "20"});
  EXPECT_EQ(cut.code, 0) << cut.err;
  EXPECT_NE(cut.out.find("the record was cut short"), std::string::npos) << cut.out;
  const size_t all = on_screen(run.out(), 20).size(),
               count = size_t(std::distance(fs::directory_iterator(run.folder() / "cut"), {}));
  EXPECT_GT(count, 0u);
  EXPECT_LT(count, all);

  const std::pair<std::string, std::string> cases[] = {
      {"", "is not a record"},
      {"TSSLICE", "is not a record"},
      {std::string(5000, '\xff'), "is not a record"},
      {good.substr(0, 30), "ends before frame"},
      {good.substr(0, 8) + std::string(300, '\x7f'), "ends before frame"},
      {good.substr(0, 400) + std::string(good.size() - 400, '\0'), "slices.events"}};
  for (const auto& [content, reason] : cases) {
    std::ofstream(record, std::ios::binary | std::ios::trunc) << content;
    const Outcome made = movie(run, run.folder() / "none/");
    EXPECT_EQ(made.code, 2) << reason;
    EXPECT_NE(made.err.find(reason), std::string::npos) << reason << ": " << made.err;
    EXPECT_EQ(lines(made.err), 1u) << made.err;
    EXPECT_FALSE(fs::exists(run.folder() / "none")) << "nothing is left behind";
  }
  fs::remove(record);
  const Outcome none = movie(run, run.folder() / "none/");
  EXPECT_EQ(none.code, 2);
  EXPECT_NE(none.err.find("slices.events: is not there"), std::string::npos) << none.err;
  EXPECT_EQ(telesplat(run.folder(), {"movie", run.folder() / "no-run", "a.mp4"}).code, 2);
}

TEST(Movie, OfATransparentRunHasPicturesWithItsAlpha) {
  for (const char* scene : {"", "volume"}) {
    TemporaryFolder data;
    write_volume(data / "balls.mha");
    PipelineRun run(with(kEveryFrame, {"--background", "transparent", "--exr"}), *scene ? data / "balls.mha" : "");
    ASSERT_EQ(run.program().wait(), 0) << run.program().err();
    ASSERT_EQ(movie(run, run.folder() / "frames/", {"--fps", "10"}).code, 0);
    const auto wanted = on_screen(run.out(), 10);
    // The same bytes: read_view() knows no alpha.
    size_t compared = 0;
    for (size_t k = 0; k < wanted.size(); ++k) {
      const std::string recorded = read_text(fmt::format("{}/images/frame-{:06}.png", run.out(), wanted[k]));
      if (recorded.empty()) continue;
      ASSERT_GT(recorded.size(), 26u);
      EXPECT_EQ(recorded[25], 6) << "not RGBA";
      const std::string frame = fmt::format("{}/images/frame-{:06}.", run.out(), wanted[k]);
      const auto picture = image::read_view(frame + "png");
      ASSERT_TRUE(picture);
      EXPECT_EQ(picture->colour.front() & 0xffffff, 0u) << "no background";
      EXPECT_NE(picture->colour[picture->colour.size() / 2 + 80] & 0xffffff, 0u);
      EXPECT_TRUE(image::read_view(frame + "exr").ok());
      EXPECT_TRUE(read_text(run.folder() / fmt::format("frames/{:06}.png", k)) == recorded) << k;
      ++compared;
    }
    EXPECT_GT(compared, 5u);
  }
}

TEST(Movie, OfAWallIsThePictureOfAllItsTiles) {
  PipelineRun run({"--wall", "2x1", "--size", "96x80", "--duration", ordinary_or_slow("2", "10")});
  ASSERT_EQ(run.program().wait(patient(60)), 0) << run.program().err();
  const Outcome made = movie(run, run.folder() / "wall/", {"--fps", "10"});
  ASSERT_EQ(made.code, 0) << made.err;
  const auto picture = image::read_view(run.folder() / "wall/000005.png");
  ASSERT_TRUE(picture.ok());
  EXPECT_EQ(picture->width, 192);
  EXPECT_EQ(picture->height, 80);
  const auto shows = [&](int from) {
    size_t different = 0;
    for (int y = 0; y < 80; ++y)
      for (int x = from; x < from + 96; ++x)
        different += picture->colour[size_t(y) * 192 + size_t(x)] != picture->colour[0];
    return different;
  };
  EXPECT_GT(shows(0), 500u);
  EXPECT_GT(shows(96), 500u);
  EXPECT_EQ(movie(run, run.folder() / "odd/", {"--size", "191x80"}).code, 2);
}

TEST(Movie, AsAVideoHasTheRateTheSizeAndTheNumberOfFrames) {
  if (need("ffmpeg").empty() || need("ffprobe").empty()) GTEST_SKIP() << "ffmpeg is not installed";
  TemporaryFolder target;
  const std::string file = target / "a flight.mp4";
  PipelineRun run({"--duration", "2", "--size", "161x121", "--movie", file, "--movie-fps", "25"});
  ASSERT_EQ(run.program().wait(100), 0) << run.program().err();
  EXPECT_NE(run.program().out().find(file), std::string::npos) << run.program().out();
  ASSERT_TRUE(fs::exists(file));
  EXPECT_FALSE(fs::exists(file + ".part"));
  EXPECT_FALSE(fs::exists(file + ".pictures"));
  const std::string command = fmt::format(
      "ffprobe -v error -count_frames -select_streams v -show_entries "
      "stream=codec_name,width,height,pix_fmt,r_frame_rate,nb_read_frames -of csv=p=0 '{}' > '{}'",
      file, target / "probed");
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string probed = read_text(target / "probed");
  EXPECT_NE(probed.find(fmt::format(",160,120,yuv420p,25/1,{}", on_screen(run.out(), 25).size())), std::string::npos)
      << probed;
  for (const char* name : {"b.gif", "b.webm", "b.mkv"}) {
    const Outcome other = movie(run, target / name, {"--fps", "5"});
    EXPECT_EQ(other.code, 0) << name << ": " << other.err;
    EXPECT_GT(fs::file_size(target / name), 500u) << name;
  }
}

TEST(Movie, WithoutFfmpegIsASequenceOfPicturesAndTellsHowToGoOn) {
  PipelineRun run({"--duration", "1", "--size", "96x64"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const std::string path = std::getenv("PATH");
  setenv("PATH", "/nowhere", 1);
  const std::string file = run.folder() / "ada's flight.mp4";
  const Outcome made = movie(run, file, {"--fps", "10"});
  const Outcome again = movie(run, file, {"--fps", "10"});
  setenv("PATH", path.c_str(), 1);
  EXPECT_EQ(made.code, 1) << "there is no movie: " << made.err;
  EXPECT_TRUE(fs::exists(run.folder() / "ada's flight-frames/000000.png"));
  EXPECT_TRUE(fs::exists(run.folder() / "ada's flight-frames/000009.png"));
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(again.code, 2) << "pictures of two movies would mix";
  // A shell takes the command as it stands: each word arrives as it was meant.
  const size_t at = made.out.find("ffmpeg -framerate 10 -i");
  ASSERT_NE(at, std::string::npos) << made.out;
  std::ofstream(run.folder() / "typed") << "ffmpeg() { printf '%s\\n' \"$@\"; }\n"
                                        << made.out.substr(at, made.out.find('\n', at) - at) << "\n";
  ASSERT_EQ(std::system(fmt::format("bash '{}' > '{}'", run.folder() / "typed", run.folder() / "words").c_str()), 0);
  const std::string words = read_text(run.folder() / "words");
  EXPECT_NE(words.find("\ncrop=trunc(iw/2)*2:trunc(ih/2)*2\n"), std::string::npos) << words;
  EXPECT_TRUE(words.ends_with("\n" + file + "\n")) << words;
}

TEST(Movie, ThatIsInterruptedLeavesNoFileAndNoProcess) {
  if (need("ffmpeg").empty()) GTEST_SKIP() << "ffmpeg is not installed";
  PipelineRun run({"--duration", "3", "--size", "640x480"});
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const std::string file = run.folder() / "long.mp4";
  Program program("telesplat", {"movie", run.out(), file, "--fps", "1000"}, run.folder() / "long");
  ASSERT_TRUE(wait_until([&] { return fs::exists(file + ".pictures/000009.png"); }));
  program.signal(SIGINT);
  EXPECT_EQ(program.wait(20), 130) << program.err();
  EXPECT_NE(program.err().find("interrupted"), std::string::npos) << program.err();
  EXPECT_FALSE(fs::exists(file));
  EXPECT_FALSE(fs::exists(file + ".part"));
  EXPECT_FALSE(fs::exists(file + ".pictures"));
  EXPECT_TRUE(run.all_gone()) << "an ffmpeg is left";
}

TEST(Movie, AContactSheetHasThePicturesThatWereAskedFor) {
  PipelineRun run({"--duration", "1", "--size", "96x64", "--animate", "c.y=-0.5:-0.3:1s"}, "julia");
  ASSERT_EQ(run.program().wait(), 0) << run.program().err();
  const Outcome made = movie(run, run.folder() / "sheet.png", {"--pictures", "6"});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.out.find("6 frames of the run"), std::string::npos) << made.out;
  const auto sheet = image::read_view(run.folder() / "sheet.png");
  ASSERT_TRUE(sheet.ok());
  EXPECT_GT(sheet->width, 2 * 96);
  EXPECT_GT(sheet->height, 2 * 64);
}

}  // namespace
}  // namespace telesplat::test
