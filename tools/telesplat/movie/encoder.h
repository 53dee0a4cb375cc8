// A video from pictures, through ffmpeg, which need not be installed: it is started as a program.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/image/file.h"
#include "tools/telesplat/movie/piped_process.h"

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

class Encoder {
 public:
  /// Pictures of width x height pixels, fps of them a second. The file appears under its name when all is done; until
  /// then it is PATH.part. Error: ffmpeg cannot be started, or has none of the encoders.
  static Result<std::unique_ptr<Encoder>> start(const std::string& ffmpeg, const std::string& path, int width,
                                                int height, double fps, const ShouldStop& should_stop);
  /// Removes what is half done.
  ~Encoder();

  /// Error: ffmpeg took it not; its last line.
  Status add(const image::View& picture);
  /// Waits until ffmpeg has written everything, and gives the file its name.
  Status finish();
  /// "libx264"
  const std::string& name() const { return encoder_; }

 private:
  Encoder(PipedProcess process, std::string path, std::string encoder, int width, int height, ShouldStop should_stop);
  /// Of what went wrong, in the words of ffmpeg.
  Error failed(int code) const;

  PipedProcess process_;
  std::string path_, encoder_;
  int width_, height_;
  ShouldStop should_stop_;
  bool done_ = false;
};

}  // namespace telesplat::launcher
