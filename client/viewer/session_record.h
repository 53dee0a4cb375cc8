// Keeps a viewer's record: frames that become pictures, and what it received. The folder is the one that it was given,
// or that of the session's own record if this machine has it.
#pragma once

#include <atomic>
#include <memory>
#include <string>

#include "client/viewer/record/event_record.h"
#include "client/viewer/record/frame_spool.h"
#include "client/viewer/record/record_options.h"
#include "client/viewer/record/slice_record.h"
#include "common/core/descriptor.h"
#include "common/wire/messages.h"

namespace telesplat::viewer {

class SessionRecord {
 public:
  /// Opens the folder that was given, if one was. Error: it cannot be written to, or another viewer records there.
  static Result<std::unique_ptr<SessionRecord>> open(const RecordOptions& options);

  /// Worker's thread: takes the session from its master, before any of its data are received. The first call opens the
  /// session's folder if no folder was given.
  void follow(const wire::Welcome& session);
  /// Place of the record in the session's folder: "." or a folder's name; empty: elsewhere, or there is no record.
  const std::string& records_in() const { return records_in_; }
  EventRecorder* events() const { return events_.get(); }
  SliceRecorder* slices() const { return slices_.get(); }

  /// Display's thread, once the session is known; null: there is no record.
  FrameSpool* spool() const { return spool_ready_; }
  /// Call it after the session; empty: there is no record.
  const std::string& directory() const { return directory_; }
  /// Writes what is waiting for the record of received data, then counts files that could not be written to their end;
  /// frames count as one file. Worker's thread; after the session any.
  uint64_t files_failed();
  /// Names those files and the reason: "3 pictures, points.events: No space left on device"; empty: all was written.
  std::string failure();

 private:
  explicit SessionRecord(const RecordOptions& options) : options_(options) {}
  Status open_in(const std::string& directory);
  Status join(const std::string& folder, const std::string& id);

  const RecordOptions options_;
  bool known_ = false;  // follow() was called
  Descriptor lock_;     // on images/, held while it records
  std::string directory_, records_in_;
  std::unique_ptr<FrameSpool> spool_;
  std::atomic<FrameSpool*> spool_ready_{nullptr};
  std::unique_ptr<EventRecorder> events_;
  std::unique_ptr<SliceRecorder> slices_;
};

}  // namespace telesplat::viewer
