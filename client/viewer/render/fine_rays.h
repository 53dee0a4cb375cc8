// Keeps hits and misses of finer rays while a view's head stands still: no point of the model shows a miss.
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

/// Rays from one eye, at one place and orientation; another eye begins anew. One thread writes, another looks up.
class FineRays {
 public:
  /// Rays a side of a block; blocks that no ray looked into take no memory.
  static constexpr int kBlock = 64;
  /// Limit of memory: 128 MiB. Where rays are omitted, the picture shows what points alone show.
  static constexpr size_t kMostBlocks = 16384;
  /// Layers of different sizes: with two and four rays a side of a pixel. A third one makes all begin anew.
  static constexpr size_t kMostLayers = 2;

  /// A tile of finer rays.
  struct Tile {
    EpochId epoch;
    geometry::Camera camera;         ///< the whole frame's camera
    geometry::Rect missed_rect;      ///< place of `missed`
    const image::PixelMask* missed;  ///< rays that met nothing
    geometry::Rect rect;             ///< place of `image`
    const image::DepthImage* image;  ///< hits of the other rays, without those known before
  };
  /// Precondition: both rectangles lie in the frame, and mask and image have their sizes.
  void add(const Tile& tile);
  /// Other rays met something that finer rays, and those beside them, had passed: the data have changed. Forgets the
  /// rays around it. Precondition: rect lies in the camera's picture, and the image has its size.
  void revise(const geometry::Camera& camera, const geometry::Rect& rect, const image::DepthImage& image);
  void clear();
  /// Takes the viewer's newest view: rays of another eye are forgotten.
  void follow(const geometry::Camera& view);

  /// Returns the hits of the rays nearest to the camera's pixels, by rows: depth in metres, infinity: a miss, 0: not
  /// known. A negative depth is from a coarser layer, so samples between its rays may show more. False: nothing is
  /// known, and met_m is undefined.
  bool look_up(const geometry::Camera& camera, EpochId epoch, std::vector<float>& met_m) const;
  /// Adds the rectangles of the camera's picture in which rays were added or forgotten since the last call.
  void take_changes(const geometry::Camera& camera, std::vector<geometry::Rect>& out);

 private:
  using Block = std::array<uint16_t, size_t{kBlock} * kBlock>;  // by rows: code()
  struct Layer {
    geometry::Camera camera;
    std::unordered_map<int, std::unique_ptr<Block>> blocks;  // key: row * columns() + column
    int columns() const { return (camera.width + kBlock - 1) / kBlock; }
    const Block* find(int block_x, int block_y) const;
    uint16_t* at(int x, int y);  // null: no ray of this block is known
  };
  using Changes = std::vector<std::pair<geometry::Camera, geometry::Rect>>;
  void forget();
  void note_change(const geometry::Camera& camera, const geometry::Rect& rect);
  Layer& layer_of(const geometry::Camera& camera);
  void put(Layer& layer, int x, int y, uint16_t met);
  static bool went_farther(Layer& layer, int x, int y, float depth_m);
  bool same_eye(const geometry::Camera& camera) const;
  bool look_up(const Layer& layer, const geometry::Camera& camera, std::vector<float>& met_m) const;

  mutable std::mutex mutex_;  // guards all members
  EpochId epoch_;
  std::vector<Layer> layers_;  // all of one frustum, the finest first
  size_t blocks_ = 0;
  double nearest_m_ = std::numeric_limits<double>::infinity();  // depth of the nearest hit
  Changes changes_;
};

}  // namespace telesplat::viewer
