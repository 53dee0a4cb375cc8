// The frames of slice images that a viewer put into its cache, kept as they came: all that is needed to warp any
// displayed frame of a volume again.
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
  /// As RecordWriter::open. The file is made with the first frame: sessions of points leave none.
  SliceRecorder(std::string path, uint64_t max_bytes) : path_(std::move(path)), max_bytes_(max_bytes) {}

  /// A frame that this viewer may display, of this grid.
  void add(const volume::Grid& grid, const wire::SliceFrame& frame);
  /// Everything so far is on disk.
  void flush();
  bool failed() const { return error() != 0; }
  int error() const { return file_ ? file_->error() : error_; }  ///< as RecordWriter's

 private:
  bool ready();

  const std::string path_;
  const uint64_t max_bytes_;
  std::optional<RecordWriter> file_;
  std::optional<volume::Grid> grid_;  // the last one written
  int error_ = 0;                     // the file could not be made
};

/// Finds the frames of a record again, in order.
class SliceReplay {
 public:
  /// Refuses files that are not a record. One that ends in mid-frame ends before that frame.
  static Result<std::unique_ptr<SliceReplay>> open(const std::string& path);

  /// Goes on to the frame of this number. replica: how many times numbers had begun again by then, at least (another
  /// master). False: the record ends before it. Errors name the file and what is wrong with the frame.
  Result<bool> advance(FrameId frame, uint32_t replica);
  /// Null before the first.
  const volume::VolumeFrame* frame() const { return shown_.get(); }
  /// The number of the newest frame that the record was found to hold; 0: none.
  FrameId newest() const { return newest_; }

 private:
  explicit SliceReplay(RecordReader file) : file_(std::move(file)) {}
  Status read_grid();
  /// The frame at hand, if it is the one that is looked for.
  Result<bool> read_frame(FrameId wanted, uint32_t replica);

  RecordReader file_;
  std::optional<volume::Grid> grid_;
  std::vector<volume::SliceImage> images_;
  std::shared_ptr<const volume::VolumeFrame> shown_;
  FrameId newest_;
  uint32_t replica_ = 0;
};

}  // namespace telesplat::viewer
