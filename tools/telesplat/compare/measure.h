// One picture of a comparison: a point model splatted by one kernel and renderer, and how far it is from direct
// rendering.
#pragma once

#include <string>
#include <vector>

#include "client/viewer/render/renderer.h"
#include "common/image/measures/flip.h"
#include "common/image/measures/quality.h"

namespace telesplat::launcher {

/// Shares of the squared error: parts of its sum over pixels where reference or reconstruction shows the data set (1 in
/// all, 0 if the pictures are identical):
///   silhouette: only one of the two shows it, or not all of the reference's rays do;  depth_edge: both do, but their
///   depths differ by more than 2 % of the reference's;  interior: the rest.
struct ErrorShares {
  double silhouette = 0, depth_edge = 0, interior = 0;
  double silhouette_pixels = 0, depth_edge_pixels = 0;  ///< shares of the pixels
  double interior_psnr_db = 0;                          ///< over the interior alone; 99 if identical
};

/// Preconditions: equal sizes, both with depth.
ErrorShares error_shares(const image::Reference& reference, const image::View& reconstruction);

struct FrameTimes {
  double frame_ms =
      0;  ///< what a viewer waits for: choosing what to draw, drawing and, for gl, reading the picture back
  double select_ms = 0, render_ms = 0;
  splat::SplatStats stats;  ///< those of the frame of median render_ms
};

struct Cell {
  splat::Kernel kernel;
  std::string renderer;
  float splat_scale = 0;
  image::Quality quality;
  ErrorShares shares;
  double flip = 0;  ///< mean over the pixels that quality.h counts
  FrameTimes times;
  uint64_t items = 0;
  image::View view;             ///< with depth
  std::vector<float> flip_map;  ///< one value a pixel of view
};

struct CellOptions {
  splat::RenderOptions render;
  float splat_scale = 1;
  int repeat = 5;  ///< frames timed; one more is drawn before them
  image::ShadingParameters shading;
  bool best_patch_only = false;  ///< as SelectionOptions has it
  float detail = 1;              ///< SelectionOptions::detail
  std::shared_ptr<const splat::BaseMesh> base;  ///< DrawList::base
};

/// The picture that a view is compared with, and its FLIP comparer.
struct Truth {
  const image::Reference& reference;
  const image::Flip& flip;
};

/// Draws `model` for `camera` and compares it with the truth.
/// applied: the newest event of the model (renderers keep copies of points by it).
Cell measure_cell(viewer::Renderer& renderer, const points::PointModel& model, Sequence applied,
                  const geometry::Camera& camera, const CellOptions& options, const Truth& truth);

}  // namespace telesplat::launcher
