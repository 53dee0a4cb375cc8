#include "common/volume/slices/view.h"

#include <algorithm>

#include "common/volume/slices/image.h"

namespace telesplat::volume {

SliceView::SliceView(const Grid& grid, const ShearFrame& shear, const geometry::Camera& camera, double margin)
    : shear_(shear), index_to_camera_(camera.view() * grid.index_to_room) {
  const double x = margin * (camera.right - camera.left), y = margin * (camera.top - camera.bottom);
  left_ = camera.left - x, right_ = camera.right + x;
  bottom_ = camera.bottom - y, top_ = camera.top + y;
}

bool SliceView::may_see(int layer, int x, int y) const {
  const double plane = shear_.layers[size_t(layer)].plane;
  // Not seen if all corners lie outside of one of the frustum's planes, which are d = 0 and four through the eye.
  // Corners behind the eye are tested against the same half-spaces, so quadrangles that reach behind it are not lost.
  int behind = 0, beyond_left = 0, beyond_right = 0, beyond_bottom = 0, beyond_top = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int px = std::min((x + corner % 2) * kSliceBlock, shear_.width);
    const int py = std::min((y + corner / 2) * kSliceBlock, shear_.height);
    const glm::dvec3 at = index_to_camera_ * glm::dvec4(shear_.unproject(px, py, plane), 1);
    const double d = -at.z;
    behind += d <= 0;
    beyond_left += at.x < left_ * d;
    beyond_right += at.x > right_ * d;
    beyond_bottom += at.y < bottom_ * d;
    beyond_top += at.y > top_ * d;
  }
  return std::max({behind, beyond_left, beyond_right, beyond_bottom, beyond_top}) < 4;
}

}  // namespace telesplat::volume
