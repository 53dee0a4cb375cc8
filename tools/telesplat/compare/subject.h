// Flags of `telesplat compare`, and its subject: poses of a run, and the scene with its data.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "common/image/measures/flip.h"
#include "common/splat/kernel_traits.h"
#include "tools/telesplat/record/recorded_run.h"

namespace telesplat::launcher {

/// Flags of `telesplat compare`.
struct CompareOptions {
  std::string path;   ///< a run folder
  std::string moved;  ///< the data file, if it has moved since the run
  std::string out;
  int poses = 4;
  std::vector<uint64_t> frames;
  std::vector<std::string> kernels = splat::kernel_names();
  std::vector<std::string> renderers;  ///< empty: cpu, and gl if the machine has OpenGL
  std::string finish = "on";
  double splat_scale = 0;  ///< 0: the scale that suits the kernel
  int samples = 16;        ///< rays a pixel of direct rendering
  int repeat = 5;
  double pixels_per_degree = image::kFlipPixelsPerDegree;
  int threads = 0;
  bool pictures = false;
  data::DataOptions data;  ///< only the cache
};

/// Returns a row a flag; rows point into `options`.
options::Table table(CompareOptions& options);

/// The poses to compare. Made before any data is read.
struct CompareSubject {
  std::unique_ptr<Scene> scene;
  std::string out;
  std::string events;                ///< record of point-model events
  std::string sampling;              ///< points' sampling, for captions
  image::ShadingParameters shading;  ///< as displayed
  bool best_patch_only = false;      ///< the run's packing kept redundant patches
  std::vector<DisplayedFrame> frames;
  std::string name() const { return scene->name(); }  ///< for captions
};

/// Error texts are for a user: exit code 2.
Result<CompareSubject> find_subject(const CompareOptions& options);

}  // namespace telesplat::launcher
