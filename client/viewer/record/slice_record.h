// Records the frames of slice images that a viewer put into its cache, as they came: they suffice to warp any displayed
// frame of a volume again.
//
// File (record_file.h): "TSSLICE1". Types: "grid" (three u32: voxels on each axis; sixteen doubles: index_to_room,
// column by column) where the grid of the frames that follow begins, and the wire's "slice_frame".
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/viewer/record/record_file.h"
#include "client/viewer/slices/cache.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

class SliceRecorder {
 public:
  /// As RecordWriter::open(). The first frame makes the file: sessions of points make none.
  SliceRecorder(std::string path, uint64_t max_bytes) : path_(std::move(path)), max_bytes_(max_bytes) {}

  /// Adds a frame of this grid that this viewer may display.
  void add(const volume::Grid& grid, const wire::SliceFrame& frame);
  /// Returns when all frames so far are on disk.
  void flush();
  bool failed() const { return error() != 0; }
  int error() const { return file_ ? file_->error() : error_; }  ///< as RecordWriter's

 private:
  bool ready();

  const std::string path_;
  const uint64_t max_bytes_;
  std::optional<RecordWriter> file_;
  std::optional<volume::Grid> grid_;  // the grid written last
  int error_ = 0;                     // errno if the file could not be made
};

/// Finds the frames of a record again, in order.
class SliceReplay {
 public:
  /// Refuses files that are not a record. A record that ends in mid-frame ends before that frame.
  static Result<std::unique_ptr<SliceReplay>> open(const std::string& path);

  /// Goes on to the frame of this number. replica: least number of times that numbers began again before it (another
  /// master). False: the record ends before it. Errors name the file and what is wrong with the frame.
  Result<bool> advance(FrameId frame, uint32_t replica);
  /// Null before the first frame.
  const volume::VolumeFrame* frame() const { return shown_.get(); }
  /// Number of the newest frame found in the record so far; 0: none yet.
  FrameId newest() const { return newest_; }

 private:
  explicit SliceReplay(RecordReader file) : file_(std::move(file)) {}
  Status read_grid();
  /// Decodes the frame at hand if it is the wanted one.
  Result<bool> read_frame(FrameId wanted, uint32_t replica);

  RecordReader file_;
  std::optional<volume::Grid> grid_;
  std::vector<volume::SliceImage> images_;
  std::shared_ptr<const volume::VolumeFrame> shown_;
  FrameId newest_;
  uint32_t replica_ = 0;
};

}  // namespace telesplat::viewer
