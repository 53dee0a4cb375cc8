// Movies: targets by name, refusals, and the encoder's arguments.
#include <gtest/gtest.h>

#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "tools/telesplat/movie/contact_sheet.h"
#include "tools/telesplat/movie/movie.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::launcher {
namespace {

namespace fs = std::filesystem;
using Kind = MovieTarget::Kind;

bool never() { return false; }

/// A temporary folder; the destructor deletes it.
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

class Movies : public ::testing::Test {
 protected:
  Folder folder;
  const std::string path_before = std::getenv("PATH") ? std::getenv("PATH") : "";
  ~Movies() override { setenv("PATH", path_before.c_str(), 1); }

  void write(const std::string& name, const std::string& content) const { std::ofstream(folder / name) << content; }
  std::string refused(const std::string& name) const {
    const auto target = movie_target(name);
    return target ? "" : target.error().text;
  }
  // Makes a program "ffmpeg" that runs a script, the only program in PATH.
  void only_ffmpeg(const std::string& script) const {
    fs::create_directories(folder / "bin");
    const std::string program = folder / "bin/ffmpeg";
    std::ofstream(program) << "#!/bin/sh\n" << script << "\n";
    chmod(program.c_str(), 0755);
    setenv("PATH", (folder / "bin").c_str(), 1);
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

// Writes its arguments into the file "words", a line each, and makes the file of the last argument.
constexpr const char* kTellsItsWords =
    "\nfor a; do out=\"$a\"; echo \"$a\"; done > \"${0%bin/ffmpeg}words\"\necho film > \"${out#file:}\"";

TEST_F(Movies, AnEncoderReadsTheFolderAndTheFileGetsItsNameAtTheEnd) {
  only_ffmpeg(std::string(kKnowsX264) + kTellsItsWords);
  const std::string file = folder / "a film; $(touch oops) 'x'.mp4", pictures = folder / "100 %";
  fs::create_directory(pictures);
  const auto made = encode_video(folder / "bin/ffmpeg", pictures, file, 25, never);
  ASSERT_TRUE(made.ok()) << made.error().text;
  EXPECT_EQ(*made, "libx264");
  EXPECT_EQ(read_text(file), "film\n");
  const std::string words = read_text(folder / "words");
  EXPECT_NE(words.find("\n-framerate\n25\n"), std::string::npos) << words;
  EXPECT_NE(words.find("\n" + (folder / "100 %%/%06d.png") + "\n"), std::string::npos) << words;
  EXPECT_TRUE(words.ends_with("\nfile:" + file + ".part\n")) << words;
  EXPECT_FALSE(fs::exists(file + ".part"));
  EXPECT_FALSE(fs::exists("oops"));
}

TEST_F(Movies, AnEncoderDoesNotWriteThroughALinkThatLiesThere) {
  only_ffmpeg(std::string(kKnowsX264) + kTellsItsWords);
  std::ofstream(folder / "precious") << "mine";
  fs::create_symlink(folder / "precious", folder / "a.mp4.part");
  ASSERT_TRUE(encode_video(folder / "bin/ffmpeg", folder / "", folder / "a.mp4", 30, never).ok());
  EXPECT_EQ(read_text(folder / "precious"), "mine");
  EXPECT_TRUE(fs::is_regular_file(fs::symlink_status(folder / "a.mp4")));
}

TEST_F(Movies, WhatAnEncoderComplainsOfIsToldByItsLastLine) {
  only_ffmpeg(std::string(kKnowsX264) + "\necho first >&2; echo 'no space left' >&2; exit 3");
  const auto made = encode_video(folder / "bin/ffmpeg", folder / "", folder / "a.mp4", 30, never);
  ASSERT_FALSE(made.ok());
  EXPECT_EQ(made.error().text, (folder / "a.mp4") + ": ffmpeg ended with code 3: no space left");
  EXPECT_FALSE(fs::exists(folder / "a.mp4"));
  EXPECT_FALSE(fs::exists(folder / "a.mp4.part"));
}

TEST_F(Movies, AnotherEncoderIsTakenWhereTheFirstIsMissing) {
  only_ffmpeg(std::string("for a; do [ \"$a\" = -encoders ] && { echo ' V.S... mpeg4 MPEG-4 part 2'; exit 0; }; done") +
              kTellsItsWords);
  const auto made = encode_video(folder / "bin/ffmpeg", folder / "", folder / "a.mp4", 30, never);
  ASSERT_TRUE(made.ok()) << made.error().text;
  EXPECT_EQ(*made, "mpeg4");
  const auto none = encode_video(folder / "bin/ffmpeg", folder / "", folder / "a.webm", 30, never);
  ASSERT_FALSE(none.ok());
  EXPECT_NE(none.error().text.find("no encoder libvpx-vp9 or libvpx"), std::string::npos) << none.error().text;
}

TEST_F(Movies, AnEncoderThatHangsIsEndedWithWhatItHadWritten) {
  only_ffmpeg(std::string(kKnowsX264) +
              "\nfor a; do out=\"$a\"; done\necho half > \"${out#file:}\"\nexec /bin/sleep 600");
  const auto made = encode_video(folder / "bin/ffmpeg", folder / "", folder / "a.mp4", 30,
                                 [&] { return fs::exists(folder / "a.mp4.part"); });
  EXPECT_FALSE(made.ok());
  EXPECT_FALSE(fs::exists(folder / "a.mp4.part"));
}

TEST(ContactSheets, HaveTheirPicturesInRowsAndColumns) {
  const image::View red{3, 2, std::vector<uint32_t>(6, 0xff0000), {}},
      blue{5, 4, std::vector<uint32_t>(20, 0x0000ff), {}};
  const auto sheet =
      contact_sheet({"caption"}, {{"a row", {{{red, blue}, {"text"}}, {{red}, {}}}}, {"", {{{blue}, {}}}}});
  const auto count = [&](uint32_t colour) { return std::count(sheet.colour.begin(), sheet.colour.end(), colour); };
  EXPECT_EQ(count(0xff0000), 2 * 6);
  EXPECT_EQ(count(0x0000ff), 2 * 20);
  EXPECT_GT(count(0xe8e8e8), 0) << "the row's label";
}

}  // namespace
}  // namespace telesplat::launcher
