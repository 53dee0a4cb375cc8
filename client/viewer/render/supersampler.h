// Draws parts of a picture with several sub-pixels a pixel, for a camera that rests.
#pragma once

#include <functional>
#include <vector>

#include "client/viewer/render/fine_rays.h"
#include "client/viewer/render/renderer.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Pixels in rows that lie `pitch` apart.
struct PixelBlock {
  uint32_t* pixels;
  size_t pitch;
  int width, height;
};

/// Writes the mean of side x side sub-pixels, channel by channel, rounded (box filter on displayed colours, like
/// references with several rays a pixel). from: width * side x height * side of 0x00RRGGBB, rows from_pitch apart; `to`
/// gets 0xff in the upper byte.
void box_filter(const uint32_t* from, size_t from_pitch, int side, PixelBlock to);

/// Draws rectangles of a view with side x side sub-pixels a pixel, by any renderer.
///
/// If points are as far apart as the view's pixels or farther, sub-pixels show no more than pixels do, and the finish's
/// softened silhouettes are nearer to the truth than exact steps between samples: such a rectangle is left alone.
///
/// No splat is larger than splat::kMaxSplatSide, so samples some pixels apart leave gaps between their splats. If there
/// are many, the rectangle is left alone, too. Else a sub-pixel is a gap if it lies behind all that the view shows in
/// the 3x3 pixels around it; it gets its pixel's colour. If no splat is cut, only empty sub-pixels are gaps: those
/// between a coarse sample and fine ones.
///
/// Splats reach beyond silhouettes by half of their samples' distance. Where finer rays are known (Scene::rays), a
/// sub-pixel shows nothing in front of their hits, and is empty where they missed. Where they are not known, a pixel at
/// a silhouette shows the picture without sub-pixels, whose antialias knows how far splats reach.
/// A pixel lies at a silhouette if the empty sub-pixels in the 3x3 pixels around it together make a pixel or more.
/// Fewer are a gap between fine samples.
class Supersampler {
 public:
  /// Selects the camera's view into the list, which is used before the next call.
  using Select = std::function<void(const geometry::Camera&, const splat::SelectionOptions&, splat::DrawList&)>;
  struct Scene {
    Select select;
    splat::SelectionOptions selection;  ///< its detail is not used: all points are drawn
    splat::RenderOptions render;        ///< without its antialiasing
    const image::Shading& shading;      ///< shading of the view
    const FineRays* rays = nullptr;     ///< rays from the camera's place; null: not known
  };

  /// Only draw() uses the renderer. side: 2 or 4.
  Supersampler(Renderer& renderer, int side) : renderer_(renderer), side_(side) {}

  int side() const { return side_; }
  /// Draws `rect` of the camera's image into `to`, its upper left pixel, rows `pitch` apart. False: the rectangle was
  /// left alone, and nothing was drawn.
  bool draw(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect, uint32_t* to, size_t pitch);

 private:
  struct Fineness {
    bool worthwhile = false;  ///< there are enough samples finer than pixels, and few gaps
    bool gaps = false;
  };
  Fineness fineness(const geometry::Rect& rect) const;
  void render(const Scene& scene, const splat::DrawList& list, const geometry::Camera& camera, image::View& view,
              bool antialias = false);
  void render_coarse(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect);
  void render_closer(const Scene& scene, const geometry::Camera& around, float spacing, image::View& view);
  void show_met(const Scene& scene, const geometry::Camera& around);
  bool count_covered(const geometry::Rect& rect);
  void close_gaps(const geometry::Rect& rect, bool with_depths);
  bool find_silhouettes(const geometry::Rect& rect);
  void show_antialiased(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect, uint32_t* to,
                        size_t pitch);

  Renderer& renderer_;
  const int side_;
  splat::DrawList list_, coarse_list_;
  // The rectangle and a pixel more on each side, with sub-pixels: from all samples, and from closer samples only.
  image::View fine_, closer_;
  // The rectangle and two pixels more on each side, without sub-pixels; and the same antialiased.
  image::View coarse_, antialiased_;
  std::vector<float> met_m_;     // FineRays::look_up() for fine_'s pixels; empty: no rays are known
  std::vector<float> farthest_;  // for a row's pixels: largest depth in the 3x3 pixels around each
  // For each pixel of the rectangle and one more on each side: sub-pixels that show something; sub-pixels whose rays
  // are known; 1 if the pixel shows the antialiased picture.
  std::vector<uint8_t> covered_, known_, silhouette_;
};

}  // namespace telesplat::viewer
