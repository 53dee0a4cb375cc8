// Parts of a picture with several sub-pixels a pixel, for a camera that rests.
#pragma once

#include <functional>
#include <vector>

#include "client/viewer/render/fine_rays.h"
#include "client/viewer/render/renderer.h"
#include "common/image/file.h"

namespace telesplat::viewer {

/// Mean of side x side sub-pixels, channel by channel, rounded (box filter on displayed colours, as references of
/// several rays a pixel have it). from: width * side x height * side of 0x00RRGGBB, rows from_pitch apart; to: rows
/// `pitch` apart, with 0xff in the upper byte.
void box_filter(const uint32_t* from, size_t from_pitch, int side, int width, int height, uint32_t* to, size_t pitch);

/// Draws rectangles of a view with side x side sub-pixels a pixel, by any renderer.
///
/// Where the points are as far apart as the view's pixels or farther, sub-pixels show nothing that pixels do not, and
/// the finish's softened silhouettes are nearer to the truth than the exact steps between samples: such a rectangle is
/// left alone.
///
/// No splat is larger than splat::kMaxSplatSide, so that samples some pixels apart leave gaps between their splats.
/// Where they are many, the rectangle is left alone, too. Elsewhere a sub-pixel that lies behind all that the view
/// shows in the 3x3 pixels around it is such a gap; it gets its pixel's colour. Where no splat is cut, one that shows
/// nothing is a gap still: between a coarse sample and fine ones.
///
/// Splats reach beyond silhouettes by half of their samples' distance. Where it is known what finer rays met
/// (Scene::rays), a sub-pixel shows nothing that lies before that: where a ray met nothing there is nothing. Where it
/// is not known, a pixel of a silhouette shows what a picture without sub-pixels does, whose antialias knows how far
/// splats reach.
/// A pixel lies at a silhouette if in the 3x3 pixels around it sub-pixels show nothing that together make a pixel or
/// more. Fewer are a gap between fine samples.
class Supersampler {
 public:
  /// Puts what the camera sees into the list, which is used before the next call.
  using Select = std::function<void(const geometry::Camera&, const splat::SelectionOptions&, splat::DrawList&)>;
  struct Scene {
    Select select;
    splat::SelectionOptions selection;  ///< its detail is not used: all points are drawn
    splat::RenderOptions render;        ///< without its antialiasing
    const image::Shading& shading;      ///< of the view
    const FineRays* rays = nullptr;     ///< of where the camera is; null: not known
  };

  /// The renderer is used by draw() alone. side: 2 or 4.
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
  // Of the rectangle and a pixel more on each side, with sub-pixels: all, and by closer samples alone.
  image::View fine_, closer_;
  // Without sub-pixels, of the rectangle and two pixels more on each side; and the same antialiased.
  image::View coarse_, antialiased_;
  std::vector<float> met_m_;     // FineRays::look_up(), of fine_'s pixels; empty: no rays are known
  std::vector<float> farthest_;  // of the 3x3 pixels around each of a row
  // Of each pixel of the rectangle and one more on each side: how many sub-pixels show something, of how many it is
  // known what rays met, and whether the pixel shows the antialiased picture instead.
  std::vector<uint8_t> covered_, known_, silhouette_;
};

}  // namespace telesplat::viewer
