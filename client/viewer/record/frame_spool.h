// Recorded frames: taken from the display thread without copying, written raw by a thread of their own, turned into
// pictures after the run, so that recording never stalls the display.
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

/// Why a frame is kept: any combination.
enum FrameUse : uint32_t {
  kPicture = 1,
  kVerify = 2,
  kExr = 4,
  kTransparent = 8,  ///< its pictures have alpha: colours have the coverage in their upper byte
  kPictureOnly = 16  ///< a server drew it: its depth says nothing
};

struct SpooledFrame {
  uint64_t number = 0;
  double t_s = 0;  ///< seconds since the first displayed frame
  uint32_t use = 0;
  geometry::Camera camera;
  image::View view;
  EpochId epoch;  ///< of all points in it
  /// Drawn onto the pictures alone: what is verified stays as it was displayed. Null: none.
  std::shared_ptr<const image::Legend> legend;
  image::DisplayPart part;  ///< of a legend: what the frame is of the display
  uint32_t eye = 0;         ///< 1: the left eye's picture, 2: the right one's, 0: all of the display
};

class FrameSpool {
 public:
  /// Spools into `directory` (made if need be); at most `max_waiting` frames wait to be written, more are dropped and
  /// counted.
  static Result<std::unique_ptr<FrameSpool>> open(const std::string& directory, size_t max_waiting = 8);
  ~FrameSpool();

  /// Takes the frame; hands back a view of the same size to draw the next one into.
  image::View exchange(SpooledFrame frame);
  /// Waits until everything is on disk.
  void flush();
  /// Frames that came faster than the disk takes them.
  uint64_t dropped() const { return dropped_; }
  /// Frames that could not be written, which was logged once.
  uint64_t failed() const { return failed_; }
  int error() const { return error_; }  ///< errno of the first of them

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

/// Paths of the spooled frames of a folder, by frame number.
std::vector<std::string> spooled_frames(const std::string& directory);
/// Reads one spooled frame; refuses files that are not one, or were written by an earlier version.
Result<SpooledFrame> read_spooled_frame(const std::string& path);
/// Turns frames marked kPicture into directory/frame-NNNNNN.png with their legends (kExr: .exr too, without) and
/// deletes spooled frames that are not also marked kVerify. progress: done, of. go_on: asked before each frame; once it
/// says no, the remaining ones are left as they are.
Status develop_frames(const std::string& spool_directory, const std::string& picture_directory,
                      const std::function<void(size_t, size_t)>& progress, const std::function<bool()>& go_on = {});

}  // namespace telesplat::viewer
