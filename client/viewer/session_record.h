// Where a viewer keeps what it shows: pictures to be and what it received. The folder is the one that it was told, or
// that of the session's own record, if this machine has it.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "client/viewer/record/event_record.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/record/slice_record.h"
#include "common/core/descriptor.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

class SessionRecord {
 public:
  struct Options {
    std::string out;           ///< folder; empty: that of the session, if join is set
    bool join = true;          ///< keep a record in the session's folder
    std::string name;          ///< the viewer's: of its folder in the session's, where that has pictures of another
    uint64_t received_mb = 0;  ///< kept of what was received, MiB at most; 0: nothing
  };

  /// Opens the folder that was told. Error: it cannot be written to, or another viewer records there.
  static Result<std::unique_ptr<SessionRecord>> open(const Options& options);

  /// Worker's thread: the session as its master tells it, before anything of it is received. The first time it takes
  /// the session's folder, if none was told.
  void follow(const wire::Welcome& session);
  /// Where in the session's folder it records: "." or a folder's name; empty: elsewhere, or nowhere.
  const std::string& records_in() const { return records_in_; }
  EventRecorder* events() const { return events_.get(); }
  SliceRecorder* slices() const { return slices_.get(); }

  /// Display's thread, once the session is known; null: nothing is kept.
  FrameSpool* spool() const { return spool_ready_; }
  /// After the session; empty: nothing is kept.
  const std::string& directory() const { return directory_; }
  /// How many files could not be written to their end, the frames to be counting as one. What is waiting to be written
  /// of them is, first. Worker's thread; after the session any.
  uint64_t files_failed();
  /// Those files, and why: "3 pictures, points.events: No space left on device"; empty: all was written.
  std::string failure();

 private:
  explicit SessionRecord(const Options& options) : options_(options) {}
  Status open_in(const std::string& directory);
  Status join(const std::string& folder, const std::string& id);

  const Options options_;
  bool known_ = false;  // the session
  Descriptor lock_;     // on images/, for as long as it records
  std::string directory_, records_in_;
  std::unique_ptr<FrameSpool> spool_;
  std::atomic<FrameSpool*> spool_ready_{nullptr};
  std::unique_ptr<EventRecorder> events_;
  std::unique_ptr<SliceRecorder> slices_;
};

}  // namespace telesplat::viewer
