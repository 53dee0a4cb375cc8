// Pictures of what is on display, taken when the person asks, written in the background.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <string>

#include "common/image/file.h"

namespace telesplat::viewer {

/// FOLDER/WHAT-DATE-TIME.ENDING, a name that no file has. Makes the folder; where that fails, writing will.
std::string new_file(const std::string& folder, const std::string& what, const std::string& ending);

class Screenshots {
 public:
  /// Into `directory` (made if need be). tell: what became of each picture, a line for the person; called from any
  /// thread, never from two at once.
  Screenshots(std::string directory, std::function<void(const std::string&)> tell);
  /// Waits until all are written.
  ~Screenshots();

  /// Copies the view and writes it as telesplat-YYYYMMDD-HHMMSS-NNN.png; no file is overwritten. exr: as .exr with its
  /// depth, which it must have.
  void take(const image::View& view, image::Alpha alpha = image::Alpha::kNone, bool exr = false);

 private:
  std::string next_path(const char* ending);

  std::string directory_;
  std::function<void(const std::string&)> tell_;
  int count_ = 0;
  std::future<void> writing_;  // the last one; each waits for the one before
};

}  // namespace telesplat::viewer
