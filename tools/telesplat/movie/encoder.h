// A video from pictures, through ffmpeg, which need not be installed: it is started as a program.
#pragma once

#include <string>
#include <vector>

#include "common/core/result.h"
#include "tools/common/progress_line.h"

namespace telesplat::launcher {

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
