#include "common/volume/warp/plan.h"

#include <algorithm>
#include <cmath>
#include <glm/matrix.hpp>

namespace telesplat::volume {
namespace {

static_assert(kWarpSolid == static_cast<int>(static_cast<float>(kWarpOpaque) * (1 - kSolid)));
static_assert((kMaxRasterSide + 3) * kWarpSubtexels < static_cast<int>(kWarpMagic));

int64_t floor_to(int64_t value, int64_t step) {
  const int64_t rest = value % step;
  return value - (rest < 0 ? rest + step : rest);
}

// A camera with a pixel's corner at each whole lattice number: to_texel is made from it.
geometry::Camera of_lattice(const geometry::Camera& camera, const PixelLattice& across, const PixelLattice& down) {
  geometry::Camera out = camera;
  out.width = out.height = 1;
  out.left = across.offset * across.pitch;
  out.right = out.left + across.pitch;
  out.top = -down.offset * down.pitch;
  out.bottom = out.top - down.pitch;
  return out;
}

struct Range {
  float lo = INFINITY, hi = -INFINITY;
  void extend(float v) { lo = std::min(lo, v), hi = std::max(hi, v); }
};

}  // namespace

PixelLattice PixelLattice::make(double lo, double hi, int pixels) {
  PixelLattice out;
  int exponent = 0;
  const double mantissa = std::frexp((hi - lo) / pixels, &exponent);
  out.pitch = std::ldexp(std::nearbyint(std::ldexp(mantissa, 36)), exponent - 36);
  // Whole and half numbers are frequent: the split of numbers from offsets lies away from both.
  const double at = std::nearbyint(lo / out.pitch * 4096) / 4096;
  out.first = static_cast<int64_t>(std::floor(at + 0.3));
  out.offset = at - static_cast<double>(out.first);
  return out;
}

std::vector<PlacedLayer> place_layers(const VolumeFrame& frame, const geometry::Camera& camera) {
  std::vector<PlacedLayer> out;
  const glm::dvec3 eye = frame.grid.room_to_index() * glm::dvec4(camera.pose.position_room, 1);
  for (const int i : front_to_back(frame, eye)) {
    const LayerImage& image = frame.layers[static_cast<size_t>(i)];
    const double plane = frame.shear.layers[static_cast<size_t>(image.layer)].plane;
    const auto to_raster = warp(frame.grid, frame.shear, plane, camera);
    if (!to_raster) continue;
    // Raster pixel (rect.x, rect.y) has its centre at + 0.5 and is texel (1, 1).
    glm::dmat3 rows = glm::transpose(*to_raster);
    rows[0] += (0.5 - image.rect.x) * rows[2];
    rows[1] += (0.5 - image.rect.y) * rows[2];
    out.push_back({&image, rows, std::abs(plane - eye[frame.shear.axis])});
  }
  return out;
}

WarpPlan::WarpPlan(const VolumeFrame& frame, const geometry::Camera& camera)
    : across_(PixelLattice::make(camera.left, camera.right, camera.width)),
      down_(PixelLattice::make(-camera.top, -camera.bottom, camera.height)),
      width_(camera.width),
      height_(camera.height) {
  const auto tiles = [](int64_t first, int pixels, int64_t side) {
    return static_cast<int>((first + pixels - 1 - floor_to(first, side)) / side + 1);
  };
  tiles_x_ = tiles(across_.first, width_, kWarpTileWidth);
  tiles_y_ = tiles(down_.first, height_, kWarpTileHeight);
  layers_ = place_layers(frame, of_lattice(camera, across_, down_));
}

geometry::Rect WarpPlan::rect(int tx, int ty) const {
  const auto x0 =
      static_cast<int>(floor_to(across_.first, kWarpTileWidth) + int64_t{tx} * kWarpTileWidth - across_.first);
  const auto y0 =
      static_cast<int>(floor_to(down_.first, kWarpTileHeight) + int64_t{ty} * kWarpTileHeight - down_.first);
  const int left = std::max(x0, 0), top = std::max(y0, 0);
  return {left, top, std::min(x0 + kWarpTileWidth, width_) - left, std::min(y0 + kWarpTileHeight, height_) - top};
}

// Places the pixels of one tile in a layer's image.
struct WarpPlan::Placing {
  const PlacedLayer& layer;
  int64_t x, y;                       // the tile's first pixel on the lattice
  double scale = 0;                   // makes W at most 1
  bool whole = false;                 // false: the plane's horizon crosses the tile, or nearly
  double middle_x = 0, middle_y = 0;  // texel in the tile's middle, the origin of X and Y

  double at(int row, double px, double py) const {
    return glm::dot(layer.to_texel[row], glm::dvec3(double(x) + px, double(y) + py, 1));
  }
  double last_x() const { return layer.image->rect.width + 1; }
  double last_y() const { return layer.image->rect.height + 1; }
  bool begin();
  WarpLayer kernel_layer() const;
};

// False: the layer is behind all of the tile.
bool WarpPlan::Placing::begin() {
  constexpr double w = kWarpTileWidth, h = kWarpTileHeight;
  double nearest = INFINITY, farthest = -INFINITY;
  for (const auto& [px, py] : {std::pair{0.0, 0.0}, {w, 0.0}, {0.0, h}, {w, h}}) {
    nearest = std::min(nearest, at(2, px, py));
    farthest = std::max(farthest, at(2, px, py));
  }
  if (!(farthest > 0)) return false;
  scale = 1 / farthest;
  whole = nearest > farthest * 1e-3;
  if (whole) {
    const double middle_w = at(2, w / 2, h / 2);
    middle_x = std::clamp(std::floor(at(0, w / 2, h / 2) / middle_w), 0.0, last_x());
    middle_y = std::clamp(std::floor(at(1, w / 2, h / 2) / middle_w), 0.0, last_y());
  }
  return true;
}

WarpLayer WarpPlan::Placing::kernel_layer() const {
  glm::dvec3 rows[3] = {layer.to_texel[0] * scale, layer.to_texel[1] * scale, layer.to_texel[2] * scale};
  rows[0] = (rows[0] - middle_x * rows[2]) * double(kWarpSubtexels);
  rows[1] = (rows[1] - middle_y * rows[2]) * double(kWarpSubtexels);
  // The centre of the tile's pixel (0, 0).
  const glm::dvec3 first(double(x) + 0.5, double(y) + 0.5, 1);
  const auto f = [](double v) { return float(v); };
  return {.x0 = f(glm::dot(rows[0], first)),
          .xx = f(rows[0].x),
          .xy = f(rows[0].y),
          .y0 = f(glm::dot(rows[1], first)),
          .yx = f(rows[1].x),
          .yy = f(rows[1].y),
          .w0 = f(glm::dot(rows[2], first)),
          .wx = f(rows[2].x),
          .wy = f(rows[2].y),
          .least_x = f(-middle_x * kWarpSubtexels),
          .most_x = f((last_x() - middle_x) * kWarpSubtexels),
          .shift_x = f(middle_x * kWarpSubtexels) + kWarpMagic,
          .least_y = f(-middle_y * kWarpSubtexels),
          .most_y = f((last_y() - middle_y) * kWarpSubtexels),
          .shift_y = f(middle_y * kWarpSubtexels) + kWarpMagic,
          .depth = f(layer.depth * scale),
          .pitch = layer.image->pitch,
          .texels = layer.image->texels.data()};
}

namespace {

constexpr int kCornersX = kWarpPartsX + 1, kCornersY = kWarpPartsY + 1;

// Corners of a tile's parts in a layer's image, in texels. A part's pixels lie between its corners' places, since W >
// 0.
class PartCorners {
 public:
  PartCorners(const WarpLayer& layer, double middle_x, double middle_y)
      : layer_(layer), middle_x_(float(middle_x)), middle_y_(float(middle_y)) {}

  void find(int i, int j) {
    const float px = float(i * kWarpPartWidth) - 0.5f, py = float(j * kWarpPartHeight) - 0.5f;
    const float w = layer_.w0 + py * layer_.wy + px * layer_.wx;
    const float inverse = 1 / w / float(kWarpSubtexels);
    x_[j][i] = (layer_.x0 + py * layer_.xy + px * layer_.xx) * inverse + middle_x_;
    y_[j][i] = (layer_.y0 + py * layer_.yy + px * layer_.yx) * inverse + middle_y_;
  }
  void extend(Range& x, Range& y, int i, int j) const {
    x.extend(x_[j][i]);
    y.extend(y_[j][i]);
  }

 private:
  const WarpLayer& layer_;
  float middle_x_, middle_y_;
  float x_[kCornersY][kCornersX], y_[kCornersY][kCornersX];
};

// True if texels in these ranges may be visible; beyond the image they are not.
bool may_fill(const LayerImage& image, const Range& x, const Range& y) {
  constexpr float kSlack = 0.02f;  // error of floats, texels
  const auto last_x = float(image.rect.width + 1), last_y = float(image.rect.height + 1);
  if (x.hi + kSlack < 0 || y.hi + kSlack < 0 || x.lo - kSlack > last_x || y.lo - kSlack > last_y) return false;
  const auto cell = [](float v, float last) { return int(std::clamp(v, 0.0f, last)); };
  return image.may_fill(cell(x.lo - kSlack, last_x), cell(y.lo - kSlack, last_y), cell(x.hi + kSlack, last_x) + 1,
                        cell(y.hi + kSlack, last_y) + 1);
}

}  // namespace

bool WarpPlan::place(const PlacedLayer& layer, int64_t x, int64_t y, uint64_t bit, WarpTile& tile,
                     WarpLayer& out) const {
  Placing placing{layer, x, y};
  if (!placing.begin()) return false;
  out = placing.kernel_layer();
  if (!placing.whole) {
    for (uint64_t& part : tile.parts) part |= bit;
    return true;
  }
  PartCorners corners(out, placing.middle_x, placing.middle_y);
  Range all_x, all_y;
  for (const int j : {0, kCornersY - 1})
    for (const int i : {0, kCornersX - 1}) {
      corners.find(i, j);
      corners.extend(all_x, all_y, i, j);
    }
  if (!may_fill(*layer.image, all_x, all_y)) return false;
  for (int j = 0; j < kCornersY; ++j)
    for (int i = 0; i < kCornersX; ++i) corners.find(i, j);
  bool any = false;
  for (int j = 0; j < kWarpPartsY; ++j)
    for (int i = 0; i < kWarpPartsX; ++i) {
      Range rx, ry;
      for (int c = 0; c < 4; ++c) corners.extend(rx, ry, i + c % 2, j + c / 2);
      if (!may_fill(*layer.image, rx, ry)) continue;
      tile.parts[static_cast<size_t>(j * kWarpPartsX + i)] |= bit;
      any = true;
    }
  return any;
}

void WarpPlan::place(int tx, int ty, WarpTile& tile, std::vector<WarpLayer>& layers) const {
  const int64_t x = floor_to(across_.first, kWarpTileWidth) + int64_t{tx} * kWarpTileWidth;
  const int64_t y = floor_to(down_.first, kWarpTileHeight) + int64_t{ty} * kWarpTileHeight;
  const geometry::Rect drawn = rect(tx, ty);
  tile.x0 = static_cast<int>(drawn.x - (x - across_.first));
  tile.y0 = static_cast<int>(drawn.y - (y - down_.first));
  tile.x1 = tile.x0 + drawn.width;
  tile.y1 = tile.y0 + drawn.height;
  tile.parts.fill(0);
  layers.clear();
  for (const PlacedLayer& layer : layers_) {
    WarpLayer placed;
    if (place(layer, x, y, uint64_t{1} << layers.size(), tile, placed)) layers.push_back(placed);
  }
  tile.layers = layers.data();
}

}  // namespace telesplat::volume
