// Parts of a picture with several sub-pixels a pixel, for a camera that rests.
#pragma once

#include <functional>
#include <vector>

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
/// Splats reach beyond silhouettes by half of their samples' distance. A pixel at one that was sampled more finely than
/// once shows these samples alone, and its quarters those a sub-pixel apart alone if they have any: where finer rays
/// hit nothing there is nothing. That it was sampled so is seen by such samples in it; or, where splats cover less than
/// half of it, beside it. Where it was not, it shows what a picture without sub-pixels does, whose antialias knows how
/// far splats reach.
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
  void find_silhouettes(const geometry::Rect& rect);
  void show_antialiased(const Scene& scene, const geometry::Camera& camera, const geometry::Rect& rect, uint32_t* to,
                        size_t pitch);
  void close_gaps(const geometry::Rect& rect, bool with_depths);
  void sharpen(const Scene& scene, const geometry::Camera& around, const geometry::Rect& rect);
  bool count_covered(const geometry::Rect& rect, const image::View& view, std::vector<uint8_t>& covered) const;
  bool was_sampled(size_t pixel, size_t row) const;
  void render_closer(const Scene& scene, const geometry::Camera& around, float spacing, image::View& view);
  void show_samples(size_t first);

  Renderer& renderer_;
  const int side_;
  splat::DrawList list_, coarse_list_;
  // Of the rectangle and a pixel more on each side, with sub-pixels: all, by samples closer than pixels, by those a
  // sub-pixel apart.
  image::View fine_, closer_, finest_;
  // Without sub-pixels, of the rectangle and two pixels more on each side; and the same antialiased.
  image::View coarse_, antialiased_;
  std::vector<float> farthest_;  // of the 3x3 pixels around each of a row
  // Of each pixel of the rectangle and one more on each side, how many sub-pixels show something: by all splats, by
  // samples closer than pixels; and whether it lies at a silhouette (not of those around the rectangle).
  std::vector<uint8_t> covered_, sampled_, silhouette_;
};

}  // namespace telesplat::viewer
