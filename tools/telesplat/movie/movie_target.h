// Flags of movies, and their target: its kind, whether it can be written, and the program that makes it.
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
  std::string file;   ///< file to make (movie_target()); empty: no movie
  double fps = 30;    ///< frames a second of the movie
  std::string size;   ///< "WxH"; empty: the display's
  int pictures = 12;  ///< on a contact sheet
  int threads = 0;    ///< drawing threads; 0: one a core
};

/// --movie and its companions: flags of a command that runs a session.
options::Table movie_rows(MovieOptions& options);
/// The flags of `telesplat movie` beside the run and the file.
options::Table movie_table(MovieOptions& options);

/// Returns the size asked for; {0, 0}: the display's. Error: names the flag. flag: "--size".
Result<std::pair<int, int>> movie_size(const MovieOptions& options, const char* flag);

struct MovieTarget {
  enum class Kind { kVideo, kPictures, kSheet };
  Kind kind = Kind::kVideo;
  std::string path;    ///< the file, or the pictures' folder
  std::string ffmpeg;  ///< for a video: the program that encodes it
  /// Names of pictures: "frame-", 6, ".png" are frame-000000.png, frame-000001.png, ...
  std::string prefix, suffix = ".png";
  int digits = 6;
  /// The video's name, if there is no ffmpeg and pictures take its place.
  std::string wanted_video;

  /// Returns the path of picture n.
  std::string picture(uint64_t n) const;
  /// Returns the same for ffmpeg: "folder/frame-%06d.png".
  std::string pattern() const;
};

/// FILE.mp4, .m4v, .mov, .mkv, .avi, .webm, .gif: a video if ffmpeg is installed (a program of that name in PATH), else
/// pictures in FILE-frames/. A name that ends in "/", an existing folder, or FOLDER/NAME%06d.png: pictures. FILE.png: a
/// contact sheet. Missing folders are no error. Error: names the file and what is wrong; another kind of name, a place
/// that cannot be written, a folder that holds such pictures already. Leaves nothing behind.
Result<MovieTarget> movie_target(const std::string& name);

/// Finds a program in PATH; empty: PATH does not have it. Skips relative folders of PATH.
std::string find_program(const std::string& name);

/// A kind of video file: its format in ffmpeg, and the encoders to try, in this order, with their arguments.
struct Container {
  struct Encoder {
    std::string name;
    std::vector<std::string> arguments;
  };
  std::string extension, format;
  std::vector<Encoder> encoders;
  bool even_sides = true;  ///< sides must be even: an odd last row or column is left out
};
/// Chooses by the file's extension; null: no video's.
const Container* container_of(const std::string& path);
/// ".mp4, .mov, ..."
std::string container_names();

/// Makes a video of the pictures folder/000000.png, 000001.png, ..., fps of them a second. Returns the encoder's name,
/// "libx264". The file is PATH.part until it is complete, then PATH. Error: ffmpeg cannot be started, has none of the
/// encoders or fails (its last line), or should_stop returns true; no file is left.
Result<std::string> encode_video(const std::string& ffmpeg, const std::string& folder, const std::string& path,
                                 double fps, const tools::ShouldStop& should_stop);

}  // namespace telesplat::launcher
