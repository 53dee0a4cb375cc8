// What `telesplat compare` is told.
#pragma once

#include <string>
#include <vector>

#include "common/image/measures/flip.h"
#include "common/points/point_model.h"
#include "common/splat/kernel_traits.h"
#include "services/data/data_options.h"

namespace telesplat::launcher {

struct CompareOptions {
  std::string path;   ///< a run folder, or with `still` a data file
  std::string moved;  ///< the data file, where it is not where the run found it
  std::string out;
  int poses = 0;  ///< 0: 4 of a run, 1 with `still`
  std::vector<uint64_t> frames;
  std::vector<std::string> kernels = splat::kernel_names();
  std::vector<std::string> renderers;  ///< empty: cpu, and gl where there is OpenGL
  std::string finish = "on";
  double splat_scale = 0;  ///< 0: what suits the kernel
  int samples = 16;        ///< rays a pixel of direct rendering
  int repeat = 5;
  double pixels_per_degree = image::kFlipPixelsPerDegree;
  int threads = 0;
  bool still = false;  ///< sample each pose itself instead of replaying what the run had cached
  int magnify = 1;     ///< with `still`: display pixels a side per sampled pixel
  bool pictures = false;
  std::string size = "1280x800";  ///< of the display, for a data file
  double fov_deg = 90, near_m = 0.02;
  int octree_depth = points::ModelConfig{}.depth;
  data::DataOptions data;  ///< of a data file; of a run the cache alone
};

/// A row a flag; they point into `options`.
options::Table table(CompareOptions& options);

}  // namespace telesplat::launcher
