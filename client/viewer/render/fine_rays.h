// What finer rays of a view have met while its head stands still: where they met nothing, no point says so.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/core/ids.h"
#include "common/geometry/camera.h"
#include "common/image/depth_image.h"
#include "common/image/pixel_mask.h"

namespace telesplat::viewer {

/// One eye's, of one place and orientation: rays of another begin anew. Written by one thread, looked up by another.
class FineRays {
 public:
  /// Rays a side of a block; blocks that no ray looked into take no memory.
  static constexpr int kBlock = 64;
  /// More are not kept: 128 MiB. What is left out is shown as points alone do.
  static constexpr size_t kMostBlocks = 16384;
  /// Of different sizes: with two and four rays a side of a pixel. One more makes all begin anew.
  static constexpr size_t kMostLayers = 2;

  /// Of a tile of finer rays.
  struct Tile {
    EpochId epoch;
    geometry::Camera camera;         ///< of the whole frame
    geometry::Rect missed_rect;      ///< where `missed` lies
    const image::PixelMask* missed;  ///< rays that met nothing
    geometry::Rect rect;             ///< where `image` lies
    const image::DepthImage* image;  ///< what the others met, without what was known
  };
  /// Precondition: both rectangles lie in the frame, and mask and image are of their sizes.
  void add(const Tile& tile);
  /// Other rays met something where finer ones had gone farther, and so had those beside them: data that change. What
  /// is around it is forgotten. Precondition: rect lies in the camera's picture, and the image is of its size.
  void revise(const geometry::Camera& camera, const geometry::Rect& rect, const image::DepthImage& image);
  void clear();
  /// The viewer's newest view: rays of another eye are forgotten.
  void follow(const geometry::Camera& view);

  /// What the rays nearest to the camera's pixels have met, by rows: depth in metres, infinity: nothing, 0: not known.
  /// Less than 0: it was not of the finest rays that there are, so samples between them may tell more.
  /// False: nothing is known at all, and met_m is undefined.
  bool look_up(const geometry::Camera& camera, EpochId epoch, std::vector<float>& met_m) const;
  /// Adds the rectangles of the camera's picture in which rays were added or forgotten since the last call.
  void take_changes(const geometry::Camera& camera, std::vector<geometry::Rect>& out);

 private:
  using Block = std::array<uint16_t, size_t{kBlock} * kBlock>;  // by rows: code()
  struct Layer {
    geometry::Camera camera;
    std::unordered_map<int, std::unique_ptr<Block>> blocks;  // by row, then column
    int columns() const { return (camera.width + kBlock - 1) / kBlock; }
    const Block* find(int block_x, int block_y) const;
    uint16_t* at(int x, int y);  // null: nothing is known around
  };
  using Changes = std::vector<std::pair<geometry::Camera, geometry::Rect>>;
  void forget();
  void note_change(const geometry::Camera& camera, const geometry::Rect& rect);
  Layer& layer_of(const geometry::Camera& camera);
  void put(Layer& layer, int x, int y, uint16_t met);
  static bool went_farther(Layer& layer, int x, int y, float depth_m);
  bool same_eye(const geometry::Camera& camera) const;
  bool look_up(const Layer& layer, const geometry::Camera& camera, std::vector<float>& met_m) const;

  mutable std::mutex mutex_;  // guards all
  EpochId epoch_;
  std::vector<Layer> layers_;  // of one frustum, the finest first
  size_t blocks_ = 0;
  double nearest_m_ = std::numeric_limits<double>::infinity();  // of what was met
  Changes changes_;
};

}  // namespace telesplat::viewer
