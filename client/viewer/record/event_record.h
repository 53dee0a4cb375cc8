// Records the point-model events that a viewer applied, as they came. They suffice to rebuild the model of any
// displayed frame: a replica is its packer's events in their order ("Replication" in docs/architecture.md).
//
// File (record_file.h): "TSEVENT5". Types: "replica" (six floats: the box in room space, lo then hi; u32: octree depth;
// u32: 1 if mosaics are merged) where a replica begins, the wire's "patch", "forget", "refine", "epoch_begin", and
// "summary" (u64: its number, u32: key of its brick) where the viewer made a summary of a brick
// (common/points/summary.h) from the model as it was then; the wire's "base_begin", "base_tree", "base_part" and
// "base_hidden", "base_drop" (u32: a node of the base whose triangles go), and "base_change" (u64: number, counted with
// those of summaries) where the viewer showed what it had of its base. "TSEVENT4", from
// earlier versions, has no base, "TSEVENT3" no refinements either, and "TSEVENT2" no summaries.
#pragma once

#include <memory>
#include <string>

#include "client/viewer/points/event_sequencer.h"
#include "client/viewer/record/record_file.h"
#include "client/viewer/render/fine_rays.h"
#include "common/points/summary.h"
#include "common/splat/select/view_selection.h"

namespace telesplat::viewer {

class EventRecorder {
 public:
  /// As RecordWriter::open.
  static Result<std::unique_ptr<EventRecorder>> open(const std::string& path, uint64_t max_bytes);

  void begin_replica(const points::ModelConfig& config);
  void add(const ModelEvent& event);
  void add(const wire::BasePart& part);
  void add(const wire::BaseBegin& begin);
  void add(const wire::BaseTree& tree);
  void add(const wire::BaseHidden& hidden);
  /// The viewer dropped the triangles of a node of its base.
  void add_base_drop(uint32_t node);
  /// number: ModelCache::summaries_made() with this change.
  void add_base_change(uint64_t number);
  /// number: counts all summaries that the viewer made, with this one.
  void add_summary(uint64_t number, points::ClusterKey brick);
  /// Returns when all events so far are on disk.
  void flush() { file_.flush(); }
  bool failed() const { return file_.failed(); }
  int error() const { return file_.error(); }  ///< as RecordWriter's

 private:
  explicit EventRecorder(RecordWriter file) : file_(std::move(file)) {}
  RecordWriter file_;
};

/// Plays a record into a model, event by event.
class EventReplay {
 public:
  /// Refuses files that are not a record. A record that ends in mid-event (the viewer was killed) ends before that
  /// event. with_summaries: makes summaries again, too, which takes time.
  static Result<std::unique_ptr<EventReplay>> open(const std::string& path, bool with_summaries = false);
  ~EventReplay();

  /// State of a displayed frame: its newest event, and its number of summaries.
  struct Moment {
    Sequence sequence;
    uint64_t summaries = ~uint64_t{0};
  };
  /// Applies events until the model holds everything up to and including the moment, or the record ends. Goes forward
  /// only. Errors name the file and what is wrong with the event.
  Status advance(const Moment& moment);
  Status advance(Sequence sequence) { return advance(Moment{sequence}); }
  /// Goes on to where the viewer began its next replica, because another packer took over and numbers began again. A
  /// replica without events does not count. Fails if there is no such replica.
  Status next_replica();
  /// Null before the first event. Pointers into it hold until the next advance().
  const points::PointModel* model() const;
  /// Summaries of the model's bricks; empty unless they are made.
  const points::Summaries& summaries() const;
  /// The base that the viewer drew (splat::DrawList::base).
  std::shared_ptr<const splat::BaseMesh> base() const;
  Sequence applied() const;
  /// Hits of rays that are finer than the viewer's views.
  const FineRays& fine_rays() const;
  bool at_end() const;

 private:
  struct Impl;
  explicit EventReplay(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace telesplat::viewer
