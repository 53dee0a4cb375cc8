// What is asked of a movie, and where it goes: whether it can be made there, and with what.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "common/core/result.h"
#include "common/options/table.h"
#include "tools/common/progress_line.h"

namespace telesplat::launcher {

/// Flags of `telesplat run` and `view`, and of `telesplat movie`.
struct MovieOptions {
  std::string file;   ///< what to make (movie_target()); empty: nothing
  double fps = 30;    ///< frames a second of the movie
  std::string size;   ///< "WxH"; empty: the display's
  int pictures = 12;  ///< of a contact sheet
  int threads = 0;    ///< to draw with; 0: one a core
};

/// --movie and what begins with it: of a command that runs something.
options::Table movie_rows(MovieOptions& options);
/// The flags of `telesplat movie` beside the run and the file.
options::Table movie_table(MovieOptions& options);

/// The size asked for; {0, 0}: the display's. Error: names the flag. flag: "--size".
Result<std::pair<int, int>> movie_size(const MovieOptions& options, const char* flag);

struct MovieTarget {
  enum class Kind { kVideo, kPictures, kSheet };
  Kind kind = Kind::kVideo;
  std::string path;    ///< the file; of pictures their folder
  std::string ffmpeg;  ///< of a video: the program that encodes it
  /// Of pictures: "frame-", 6, ".png" are frame-000000.png, frame-000001.png, ...
  std::string prefix, suffix = ".png";
  int digits = 6;
  /// Pictures in place of a video, because there is no ffmpeg: the name that was asked for.
  std::string wanted_video;

  /// Of the n-th picture.
  std::string picture(uint64_t n) const;
  /// The same for ffmpeg: "folder/frame-%06d.png".
  std::string pattern() const;
};

/// FILE.mp4, .m4v, .mov, .mkv, .avi, .webm, .gif: a video, where ffmpeg is installed (a program of that name in PATH),
/// else pictures in FILE-frames/. A name that ends in "/", a folder that is there, or FOLDER/NAME%06d.png: pictures.
/// FILE.png: a contact sheet. Folders need not be there yet. Error: names the file and what is wrong; another kind of
/// name, a place where nothing can be written, a folder that holds such pictures already. Leaves nothing behind.
Result<MovieTarget> movie_target(const std::string& name);

/// A program in PATH; empty: there is none. Relative folders of PATH are passed over.
std::string find_program(const std::string& name);

/// How a kind of video file is made: what ffmpeg calls its format, the encoders to try, in this order, with what each
/// is told.
struct Container {
  struct Encoder {
    std::string name;
    std::vector<std::string> arguments;
  };
  std::string extension, format;
  std::vector<Encoder> encoders;
  bool even_sides = true;  ///< pictures have even sides; of odd ones the last row or column is left out
};
/// By the file's extension; null: no video's.
const Container* container_of(const std::string& path);
/// ".mp4, .mov, ..."
std::string container_names();

/// Makes a video of the pictures folder/000000.png, 000001.png, ..., fps of them a second. Returns the encoder's name,
/// "libx264". The file appears under its name when all is done; until then it is PATH.part. Error: ffmpeg cannot be
/// started, has none of the encoders or fails (its last line), or should_stop says so; no file is left.
Result<std::string> encode_video(const std::string& ffmpeg, const std::string& folder, const std::string& path,
                                 double fps, const tools::ShouldStop& should_stop);

}  // namespace telesplat::launcher
