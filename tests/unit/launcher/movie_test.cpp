// Movies: what a name asks for, where it is refused, and what goes through an encoder.
#include <gtest/gtest.h>

#include <sys/stat.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>

#include "common/core/clock.h"
#include "tools/telesplat/movie/encoder.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using Kind = MovieTarget::Kind;

bool never() { return false; }

/// Goes when the object does.
class Folder {
 public:
  Folder() {
    std::string pattern = (fs::temp_directory_path() / "telesplat-movie-XXXXXX").string();
    path_ = mkdtemp(pattern.data());
  }
  ~Folder() { fs::remove_all(path_); }
  std::string operator/(const std::string& name) const { return path_ + "/" + name; }

 private:
  std::string path_;
};

std::string read_text(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

bool wait_until(const std::function<bool()>& condition) {
  for (const double until = monotonic_s() + 20; monotonic_s() < until; usleep(10'000))
    if (condition()) return true;
  return false;
}

class Movies : public ::testing::Test {
 protected:
  Folder folder;
  const std::string path_before = std::getenv("PATH") ? std::getenv("PATH") : "";
  Movies() { signal(SIGPIPE, SIG_IGN); }  // as every program of this project does
  ~Movies() override { setenv("PATH", path_before.c_str(), 1); }

  void write(const std::string& name, const std::string& content) const { std::ofstream(folder / name) << content; }
  std::string refused(const std::string& name) const {
    const auto target = movie_target(name);
    return target ? "" : target.error().text;
  }
  // A program "ffmpeg" that does what a script says, and nothing else in PATH.
  void only_ffmpeg(const std::string& script) const {
    fs::create_directories(folder / "bin");
    const std::string program = folder / "bin/ffmpeg";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    chmod(program.c_str(), 0755);
    setenv("PATH", (folder / "bin").c_str(), 1);
  }
  static image::View grey(int width, int height, uint32_t level) {
    return {width, height, std::vector<uint32_t>(size_t(width) * size_t(height), level * 0x010101u), {}};
  }
};

constexpr const char* kKnowsX264 =
    "for a; do [ \"$a\" = -encoders ] && { echo ' V....D libx264  H.264'; exit 0; }; done";

TEST_F(Movies, TheNameSaysWhatIsMade) {
  only_ffmpeg("exit 0");
  const auto kind = [&](const std::string& name) { return movie_target(folder / name)->kind; };
  for (const char* name : {"a.mp4", "a.m4v", "a.mov", "a.mkv", "a.avi", "a.webm", "a.gif", "A.MP4", "new/a.mp4"})
    EXPECT_EQ(kind(name), Kind::kVideo) << name;
  EXPECT_EQ(kind("a.png"), Kind::kSheet);
  fs::create_directory(folder / "there");
  for (const char* name : {"frames/", "there", "a-%d.png", "new/%06d.png"})
    EXPECT_EQ(kind(name), Kind::kPictures) << name;
  EXPECT_FALSE(fs::exists(folder / "new")) << "a look leaves nothing behind";
  EXPECT_TRUE(fs::is_empty(folder / "there"));
}

TEST_F(Movies, PicturesAreNumberedAsTheNameSays) {
  EXPECT_EQ(movie_target(folder / "f/")->picture(7), folder / "f/000007.png");
  EXPECT_EQ(movie_target(folder / "f/x-%03d.png")->picture(7), folder / "f/x-007.png");
  EXPECT_EQ(movie_target(folder / "f/x%d.png")->picture(1234), folder / "f/x1234.png");
  EXPECT_EQ(movie_target(folder / "f/x-%03d.png")->pattern(), folder / "f/x-%03d.png");
}

TEST_F(Movies, NamesThatAskForNothingKnownAreRefused) {
  for (const char* name : {"a.txt", "a", "a.mp3", "f/%s.png", "f/%n.png", "f/%06d%06d.png", "f/%99999d.png",
                           "f/%-6d.png", "f/%06d.exr", "f/%", "f/100%.png"}) {
    const std::string error = refused(folder / name);
    EXPECT_NE(error.find(folder / name), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
  EXPECT_NE(refused(folder / "a.txt").find(".mp4"), std::string::npos);
}

TEST_F(Movies, PlacesWhereNothingCanBeWrittenAreRefused) {
  only_ffmpeg("exit 0");
  write("file", "");
  fs::create_directory(folder / "folder.mp4x");
  fs::create_directory(folder / "folder.png");
  for (const std::string& name :
       {folder / "file/a.mp4", folder / "file/deeper/%d.png", std::string("/proc/nowhere/a.mp4"),
        std::string("/proc/a.mp4"), std::string("/proc/nowhere/")})
    EXPECT_NE(refused(name).find("/"), std::string::npos) << name;
  EXPECT_TRUE(refused("a-movie-in-the-working-folder.mp4").empty());
  mkfifo((folder / "pipe.mp4").c_str(), 0600);
  EXPECT_NE(refused(folder / "pipe.mp4").find("no ordinary file"), std::string::npos);
}

TEST_F(Movies, AFolderThatHoldsSuchPicturesIsRefused) {
  fs::create_directory(folder / "f");
  write("f/notes.txt", "");
  write("f/x.png", "");
  EXPECT_EQ(refused(folder / "f/"), "");
  write("f/000123.png", "");
  EXPECT_NE(refused(folder / "f/").find("holds pictures already (000123.png)"), std::string::npos);
  EXPECT_EQ(refused(folder / "f/y-%d.png"), "") << "others do not mix with these";
}

TEST_F(Movies, WithoutFfmpegThereArePictures) {
  setenv("PATH", (folder / "none").c_str(), 1);
  const auto target = movie_target(folder / "flight.mp4");
  ASSERT_TRUE(target.ok()) << target.error().text;
  EXPECT_EQ(target->kind, Kind::kPictures);
  EXPECT_EQ(target->picture(0), folder / "flight-frames/000000.png");
  EXPECT_EQ(target->wanted_video, folder / "flight.mp4");
}

TEST_F(Movies, SizesThatAVideoCannotHaveAreRefused) {
  only_ffmpeg("exit 0");
  const auto error = [&](const std::string& file, const std::string& size) {
    MovieOptions o;
    o.file = folder / file;
    o.size = size;
    const auto plan = plan_movie(o, "--movie-size");
    return plan ? "" : plan.error().text;
  };
  EXPECT_EQ(error("a.mp4", "640x400"), "");
  EXPECT_NE(error("a.mp4", "641x400").find("--movie-size 641x400"), std::string::npos);
  EXPECT_EQ(error("a.gif", "641x401"), "");
  EXPECT_EQ(error("f/", "641x401"), "");
  for (const char* size : {"0x0", "x", "640", "99999x10"}) EXPECT_NE(error("a.mp4", size), "") << size;
}

TEST_F(Movies, AnEncoderGetsEveryPictureAndTheFileItsNameAtTheEnd) {
  // What comes in becomes the file that the last argument names.
  only_ffmpeg(std::string(kKnowsX264) + "\nfor a; do out=\"$a\"; done\n/bin/cat > \"${out#file:}\"");
  const std::string file = folder / "a film; $(touch oops) 'x'.mp4";
  auto encoder = Encoder::start(folder / "bin/ffmpeg", file, 5, 3, 30, never);
  ASSERT_TRUE(encoder.ok()) << encoder.error().text;
  EXPECT_EQ((*encoder)->name(), "libx264");
  for (uint32_t i = 0; i < 40; ++i) ASSERT_TRUE((*encoder)->add(grey(5, 3, i)).ok());
  EXPECT_FALSE(fs::exists(file));
  ASSERT_TRUE((*encoder)->finish().ok());
  const std::string bytes = read_text(file);
  ASSERT_EQ(bytes.size(), 40u * 4 * 2 * 4) << "the odd column and row are left out";
  EXPECT_EQ(uint8_t(bytes[39 * 32]), 39);
  EXPECT_FALSE(fs::exists(file + ".part"));
  EXPECT_FALSE(fs::exists("oops"));
}

TEST_F(Movies, AnEncoderDoesNotWriteThroughALinkThatLiesThere) {
  only_ffmpeg(std::string(kKnowsX264) + "\nfor a; do out=\"$a\"; done\n/bin/cat > \"${out#file:}\"");
  std::ofstream(folder / "precious") << "mine";
  fs::create_symlink(folder / "precious", folder / "a.mp4.part");
  auto encoder = Encoder::start(folder / "bin/ffmpeg", folder / "a.mp4", 4, 2, 30, never);
  ASSERT_TRUE(encoder.ok()) << encoder.error().text;
  ASSERT_TRUE((*encoder)->add(grey(4, 2, 1)).ok());
  ASSERT_TRUE((*encoder)->finish().ok());
  EXPECT_EQ(read_text(folder / "precious"), "mine");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder / "a.mp4")));
}

TEST_F(Movies, WhatAnEncoderComplainsOfIsToldByItsLastLine) {
  only_ffmpeg(std::string(kKnowsX264) + "\necho first >&2; echo 'no space left' >&2; exit 3");
  auto encoder = Encoder::start(folder / "bin/ffmpeg", folder / "a.mp4", 640, 480, 30, never);
  ASSERT_TRUE(encoder.ok());
  Status s = ok_status();
  for (int i = 0; i < 1000 && s; ++i) s = (*encoder)->add(grey(640, 480, 1));
  ASSERT_FALSE(s.ok()) << "a program that has ended takes no pictures";
  EXPECT_NE(s.error().text.find("code 3: no space left"), std::string::npos) << s.error().text;
  EXPECT_EQ(s.error().text.find("first"), std::string::npos);
  encoder->reset();
  EXPECT_FALSE(fs::exists(folder / "a.mp4"));
  EXPECT_FALSE(fs::exists(folder / "a.mp4.part"));
}

TEST_F(Movies, AnotherEncoderIsTakenWhereTheFirstIsMissing) {
  only_ffmpeg("echo ' V.S... mpeg4 MPEG-4 part 2'; /bin/cat > /dev/null");
  auto encoder = Encoder::start(folder / "bin/ffmpeg", folder / "a.mp4", 4, 4, 30, never);
  ASSERT_TRUE(encoder.ok()) << encoder.error().text;
  EXPECT_EQ((*encoder)->name(), "mpeg4");
  const auto none = Encoder::start(folder / "bin/ffmpeg", folder / "a.webm", 4, 4, 30, never);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find("no encoder libvpx-vp9 or libvpx"), std::string::npos) << none.error().text;
}

TEST_F(Movies, AnEncoderThatHangsIsEndedWithWhatItHadWritten) {
  only_ffmpeg(std::string(kKnowsX264) +
              "\nfor a; do out=\"$a\"; done\necho half > \"${out#file:}\"\nexec /bin/sleep 600");
  bool stop = false;
  auto encoder = Encoder::start(folder / "bin/ffmpeg", folder / "a.mp4", 640, 480, 30, [&] { return stop; });
  ASSERT_TRUE(encoder.ok()) << encoder.error().text;
  ASSERT_TRUE(wait_until([&] { return fs::exists(folder / "a.mp4.part"); }));
  stop = true;
  EXPECT_FALSE((*encoder)->add(grey(640, 480, 1)).ok());
  EXPECT_FALSE((*encoder)->finish().ok());
  encoder->reset();
  EXPECT_FALSE(fs::exists(folder / "a.mp4.part"));
}

TEST(ShellWords, AreQuotedWhereTheyNeedIt) {
  EXPECT_EQ(shell_quoted("runs/a-b_1.mp4"), "runs/a-b_1.mp4");
  EXPECT_EQ(shell_quoted("a b"), "'a b'");
  EXPECT_EQ(shell_quoted("it's"), "'it'\\''s'");
  EXPECT_EQ(shell_quoted(""), "''");
}

}  // namespace
}  // namespace telesplat::launcher
