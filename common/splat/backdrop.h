// The picture of the base, drawn at half the resolution or less, and shown in pixels that points leave empty.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/geometry/camera.h"
#include "common/geometry/clip.h"
#include "common/image/shading.h"
#include "common/splat/base_mesh.h"
#include "common/splat/finish.h"

namespace telesplat {
class Crew;
}

namespace telesplat::splat {

struct Backdrop {
  geometry::Camera camera;  ///< each of its pixels covers 2^halvings x 2^halvings pixels of the picture
  int halvings = 1;
  std::vector<uint32_t> colour;   ///< 0x00RRGGBB
  std::vector<float> reciprocal;  ///< 1 / depth in metres; 0: empty
  /// Info words (pixel_key.h) up to this one stay; the greatest one: all do, the pixel is empty.
  std::vector<uint32_t> limit;
};

/// Error, over its distance, that a part of a base may have: finer ones look no better in the backdrop of this picture.
double fine_enough(const geometry::Camera& picture);

/// Draws triangles, both sides, shaded at their corners: in place of a part that is not fine enough, its node's
/// children's there, if there are any. Keeps its buffers from picture to picture.
class BackdropPainter {
 public:
  /// clip: what is cut away is not drawn. picture: camera of the picture that the backdrop is for.
  void paint(const BaseMesh& mesh, const geometry::Clip& clip, const geometry::Camera& picture,
             const image::Shading& shading, Crew& crew, Backdrop& out);

 private:
  // A vertex in homogeneous pixels: (x w, y w, w), w its depth in metres.
  struct Corner {
    float xw, yw, w;
    float x, y, reciprocal;  // pixels, and 1 / w, if it lies beyond the near plane
    uint32_t colour;
    bool is_lit;  // it has its colour
  };
  struct Bounds {
    int left, right, top, bottom;  // the last ones included
  };
  struct Drawn {
    uint32_t first;  // index of its first corner in BasePart::indices
    Bounds bounds;
  };
  // A part of the mesh that may be in view.
  struct Seen {
    const BasePart* part;
    const BaseNode::Bits* hidden;  // or null
    float error_m;                 // its node's
    size_t first;                  // its vertices in corners_
    bool clipped;                  // some of it is cut away
    std::vector<float> inside_m;   // clipped: distance from each plane, of each vertex
    std::vector<Drawn> drawn;
    int top, bottom;  // rows of these
  };
  struct Band;
  size_t look(const BaseMesh& mesh, const geometry::Clip& clip, const geometry::Camera& picture);
  void transform(Seen& seen, const geometry::Clip& clip, const geometry::Camera& camera, const image::Shading& shading);

  static std::optional<Bounds> bounds_of(const Corner* const (&c)[3], const geometry::Camera& camera);

  std::vector<std::pair<size_t, const BaseNode*>> open_;  // nodes to look at, and the nodes above them
  std::vector<Seen> seen_;
  std::vector<Corner> corners_;
};

/// Fills the pixels of a resolved tile, grown by `grow` pixels, that are empty, or whose point lies beyond the
/// backdrop's limit, where the backdrop's pixel there is covered: bilinear between the pixels of its surface.
///   rect: where the tile lies in the picture; near_m: of its camera.
void fill_from(const Backdrop& backdrop, const geometry::Rect& rect, float near_m, const ResolvedTile& tile, int grow);

}  // namespace telesplat::splat
