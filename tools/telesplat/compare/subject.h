// What is compared: which poses, of which data, and the point model that each of them shows.
#pragma once

#include <memory>

#include "tools/telesplat/compare/compare_options.h"
#include "tools/telesplat/record/frame_replay.h"
#include "tools/telesplat/scene/scene.h"

namespace telesplat::launcher {

/// The poses to compare, before any data is read.
struct CompareSubject {
  std::unique_ptr<Scene> scene;
  std::string out;
  std::string events;                ///< record of point-model events; empty: poses are sampled
  std::string sampling;              ///< how the points were sampled, for captions
  image::ShadingParameters shading;  ///< as it was displayed
  bool best_patch_only = false;      ///< the run's packing kept redundant patches
  int octree_depth = 6;
  std::vector<DisplayedFrame> frames;
  bool first_view = false;  ///< the pose of the only frame is fitted to the data's box, once that is known
  std::string name() const { return scene->name(); }  ///< for captions
};

/// Error texts are for a user: exit code 2.
Result<CompareSubject> find_subject(const CompareOptions& options);

/// The point models of a subject's poses, one after the other.
class PoseModels {
 public:
  /// Opens the record, if the subject has one. `scene` must outlive this.
  static Result<std::unique_ptr<PoseModels>> open(const CompareSubject& subject, int magnify, DirectScene& scene);

  /// What the frame displayed, or what one sampling frame of its pose gives. Frames come in order of display.
  /// The model holds until the next call.
  Result<const points::PointModel*> of(const DisplayedFrame& frame);
  Sequence applied() const { return applied_; }

 private:
  PoseModels(const CompareSubject& subject, int magnify, DirectScene& scene)
      : subject_(subject), magnify_(magnify), scene_(scene) {}
  Result<const points::PointModel*> replay(const DisplayedFrame& frame);

  const CompareSubject& subject_;
  int magnify_;
  DirectScene& scene_;
  std::unique_ptr<ModelReplay> events_;
  std::unique_ptr<points::PointModel> sampled_;
  Sequence applied_;
};

}  // namespace telesplat::launcher
