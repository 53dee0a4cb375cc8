// The point-model events that a viewer applied, kept as they came. They are all that is needed to make any displayed
// frame's model again: a replica is its packer's events in their order ("Replication" in docs/architecture.md).
//
// File: "TSEVENT2", then records  u32 type length, u64 body length, type, body  (little-endian). Types: "replica" (six
// floats: the box in room space, lo then hi; u32: octree depth; u32: 1 if mosaics are merged) where a replica begins,
// and the wire's "patch", "forget", "epoch_begin".
#pragma once

#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "client/viewer/points/event_sequencer.h"
#include "common/points/point_model.h"

namespace telesplat::viewer {

class EventRecorder {
 public:
  /// Makes the file anew. At most max_bytes are written, then a warning is logged and the rest is left out.
  static Result<std::unique_ptr<EventRecorder>> open(const std::string& path, uint64_t max_bytes);

  void begin_replica(const points::ModelConfig& config);
  void add(const ModelEvent& event);
  /// Everything so far is on disk.
  void flush();

 private:
  struct Close {
    void operator()(FILE* f) const { std::fclose(f); }
  };
  void write(std::string_view type, std::string_view body);
  std::unique_ptr<FILE, Close> file_;
  std::string path_;
  uint64_t bytes_ = 0, max_bytes_ = 0;
  bool full_ = false;
};

/// Plays a record into a model, event by event.
class EventReplay {
 public:
  /// Refuses files that are not a record. A record that ends in mid-event (a viewer that was killed) ends before that
  /// event.
  static Result<std::unique_ptr<EventReplay>> open(const std::string& path);
  ~EventReplay();

  /// Applies events until the model holds everything up to and including `sequence`, or the
  /// record ends. Goes forward only. Errors name the file and what is wrong with the event.
  Status advance(Sequence sequence);
  /// Goes on to where the viewer began its next replica, because another packer took over and numbers began again. A
  /// replica that holds no event does not count. Fails if there is none.
  Status next_replica();
  /// Null before the first event. Pointers into it hold until the next advance().
  const points::PointModel* model() const;
  Sequence applied() const;
  bool at_end() const;

 private:
  EventReplay();
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::viewer
