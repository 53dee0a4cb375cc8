// Where a movie goes: what its name asks for, whether it can be made there, and with what.
#pragma once

#include <string>

#include "common/core/result.h"

namespace telesplat::launcher {

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

/// As it is typed at a shell's prompt.
std::string shell_quoted(const std::string& text);

}  // namespace telesplat::launcher
