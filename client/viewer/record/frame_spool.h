// Records frames: takes them from the display thread without copying, writes them raw in a thread of its own, and turns
// them into pictures after the run, so that recording never stalls the display.
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/core/ids.h"
#include "common/core/result.h"
#include "common/geometry/camera.h"
#include "common/image/file.h"
#include "common/image/legend.h"

namespace telesplat::viewer {

/// Reasons to keep a frame: any combination.
enum FrameUse : uint32_t {
  kPicture = 1,
  kVerify = 2,
  kExr = 4,
  kTransparent = 8,  ///< its pictures have alpha: colours have the coverage in their upper byte
  kPictureOnly = 16  ///< a server drew it: it has no depth
};

struct SpooledFrame {
  uint64_t number = 0;
  double t_s = 0;  ///< seconds since the first displayed frame
  uint32_t use = 0;
  geometry::Camera camera;
  image::View view;
  EpochId epoch;  ///< epoch of all its points
  /// Drawn onto pictures only: frames for verification stay as displayed. Null: no legend.
  std::shared_ptr<const image::Legend> legend;
  image::DisplayPart part;  ///< for a legend: the frame's place in the display
  uint32_t eye = 0;         ///< 1: the left eye's picture, 2: the right one's, 0: all of the display
};

class FrameSpool {
 public:
  /// Spools into `directory` (made if need be). At most `max_waiting` frames wait to be written; further ones are
  /// dropped and counted.
  static Result<std::unique_ptr<FrameSpool>> open(const std::string& directory, size_t max_waiting = 8);
  ~FrameSpool();

  /// Takes the frame; hands back a view of the same size to draw the next one into.
  image::View exchange(SpooledFrame frame);
  /// Waits until everything is on disk.
  void flush();
  /// Frames that were dropped because they came faster than the disk could take them.
  uint64_t dropped() const { return dropped_; }
  /// Frames that could not be written; the first one was logged.
  uint64_t failed() const { return failed_; }
  int error() const { return error_; }  ///< errno of the first of those

 private:
  FrameSpool() = default;
  void write_loop();
  void on_failure(int error);

  std::string directory_;
  size_t max_waiting_ = 8;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<SpooledFrame> waiting_;
  std::vector<image::View> free_;
  bool stop_ = false, writing_ = false;
  std::atomic<uint64_t> dropped_ = 0, failed_ = 0;
  std::atomic<int> error_ = 0;
  std::thread thread_;
};

/// Paths of a folder's spooled frames, by frame number.
std::vector<std::string> spooled_frames(const std::string& directory);
/// Reads one spooled frame; refuses other files, and those of an earlier version.
Result<SpooledFrame> read_spooled_frame(const std::string& path);
/// Turns frames marked kPicture into directory/frame-NNNNNN.png with their legends (kExr: also .exr, without legend)
/// and deletes spooled frames that are not also marked kVerify. progress: done, of. go_on: asked before each frame;
/// once it returns false, the remaining ones are left as they are.
Status develop_frames(const std::string& spool_directory, const std::string& picture_directory,
                      const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& go_on = {});

}  // namespace telesplat::viewer
