// Saves pictures of what is on display when the person asks; writes them in the background.
#pragma once

#include <deque>
#include <functional>
#include <future>
#include <string>

#include "common/image/file.h"

namespace telesplat::viewer {

/// Returns FOLDER/WHAT-DATE-TIME.ENDING, a name that no file has. Makes the folder; if it cannot, writing will fail.
std::string new_file(const std::string& folder, const std::string& what, const std::string& ending);

class Screenshots {
 public:
  /// Writes into `directory` (made if need be). tell: gets a line for the person on the result of each picture; called
  /// from any thread, never from two at once.
  Screenshots(std::string directory, std::function<void(const std::string&)> tell);
  /// Waits until all pictures are written.
  ~Screenshots();

  /// Copies the view and writes it as telesplat-YYYYMMDD-HHMMSS-NNN.png; no file is overwritten. exr: as .exr with its
  /// depth, which the view must have.
  void take(const image::View& view, image::Alpha alpha = image::Alpha::kNone, bool exr = false);

 private:
  std::string next_path(const char* ending);

  std::string directory_;
  std::function<void(const std::string&)> tell_;
  int count_ = 0;
  std::future<void> writing_;  // the last one; each waits for the one before
};

}  // namespace telesplat::viewer
