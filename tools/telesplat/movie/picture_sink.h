// Where the frames of a movie go: to an encoder, or into a folder of pictures.
#pragma once

#include <memory>
#include <string>

#include "tools/telesplat/movie/encoder.h"
#include "tools/telesplat/movie/movie_target.h"

namespace telesplat::launcher {

class PictureSink {
 public:
  /// Of a video or of pictures. What was not finished is removed in the end.
  /// alpha: of pictures; videos have none.
  static Result<std::unique_ptr<PictureSink>> open(const MovieTarget& target, int width, int height, double fps,
                                                   image::Alpha alpha, const ShouldStop& should_stop);
  virtual ~PictureSink() = default;
  /// The next picture. again: it is the one before once more.
  virtual Status add(const image::View& picture, bool again) = 0;
  virtual Status finish() = 0;
  /// What it was made with, for people: "libx264".
  virtual std::string with() const = 0;
};

}  // namespace telesplat::launcher
