#include "common/splat/backdrop.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "common/image/normal.h"
#include "common/parallel/crew.h"

namespace telesplat::splat {
namespace {

// Pictures with more pixels than this have a backdrop of a fourth of their resolution, others of half of it.
constexpr int64_t kMostHalved = 3 << 19;
// Reciprocal depths of one surface differ by less than this share, between neighbours.
constexpr float kSurface = 0.1f;
constexpr size_t kBandsAThread = 4;
// Depths lie beyond a triangle's if they are greater by this, and those of a plane as many errors behind it.
constexpr float kBeyond = 1.05f, kErrors = 1.5f;
// Points are seen through triangles of at least this many pixels of the picture: samples of smaller ones lie close.
constexpr int kLeastSeenThrough_px = 8;
// Nodes are fine enough if the surface lies at most this many of the backdrop's pixels from their triangles.
constexpr double kFine_px = 3;
// Triangles with sides of at most this many of the backdrop's pixels are drawn without perspective.
constexpr int kSmall_px = 8;
constexpr float kNone = std::numeric_limits<float>::infinity();

int halvings(const geometry::Camera& picture) { return int64_t{picture.width} * picture.height > kMostHalved ? 2 : 1; }

uint32_t mixed(const uint32_t (&colours)[4], const float (&weights)[4], size_t n) {
  float red = 0.5f, green = 0.5f, blue = 0.5f;
  for (size_t k = 0; k < n; ++k) {
    red += weights[k] * static_cast<float>(colours[k] >> 16 & 255);
    green += weights[k] * static_cast<float>(colours[k] >> 8 & 255);
    blue += weights[k] * static_cast<float>(colours[k] & 255);
  }
  return static_cast<uint32_t>(red) << 16 | static_cast<uint32_t>(green) << 8 | static_cast<uint32_t>(blue);
}

}  // namespace

void find_planes(BasePart& part) {
  part.planes.clear();
  for (size_t i = 0; i < part.indices.size(); i += 3) {
    const glm::vec3& p = part.positions[part.indices[i]];
    const glm::vec3 across =
        glm::cross(part.positions[part.indices[i + 1]] - p, part.positions[part.indices[i + 2]] - p);
    const float length = glm::length(across);
    const glm::vec3 normal = length > 0 ? across / length : glm::vec3(0);
    part.planes.emplace_back(normal, glm::dot(normal, p));
  }
}

double distance_m(const geometry::Box& box, const glm::dvec3& from) {
  return glm::length(from - glm::clamp(from, glm::dvec3(box.lo), glm::dvec3(box.hi)));
}

double fine_enough(const geometry::Camera& picture) {
  return kFine_px * double(1 << halvings(picture)) / std::min(picture.focal_x(), picture.focal_y());
}

BasePart base_part(const geometry::MeshChunkView& chunk) {
  BasePart out;
  out.box_room = chunk.box_room;
  for (size_t v = 0; v < chunk.vertices(); ++v) {
    const float* p = &chunk.positions_room[3 * v];
    out.positions.emplace_back(p[0], p[1], p[2]);
    out.normals.push_back(image::decode_normal32(chunk.normals[v]));
  }
  out.colours.assign(chunk.colours.begin(), chunk.colours.end());
  out.indices.assign(chunk.indices.begin(), chunk.indices.end());
  find_planes(out);
  return out;
}

// Homogeneous rasterisation: M. Olano and T. Greer, "Triangle scan conversion using 2D homogeneous coordinates",
// Graphics Hardware 1997. Triangles need not be cut at the near plane.
struct BackdropPainter::Band {
  Backdrop& out;
  int first, last;  // rows

  // A triangle. inside: distances of its corners from the clip's planes; null: nothing is cut away. beyond: depth
  // beyond which points are seen through it, over its own; +infinity without one. bounds: pixels that it may cover.
  struct Triangle {
    const Corner* c[3];
    const float* inside[3];
    size_t planes;
    float beyond;
    Bounds bounds;
  };
  void draw(const Seen& seen, const Corner* corners, const glm::vec3& eye, size_t planes);
  void draw(const Triangle& t);
  void draw_small(const Triangle& t);
  void set(size_t pixel, const Triangle& t, float reciprocal, const float (&weights)[4]);
};

void BackdropPainter::Band::set(size_t pixel, const Triangle& t, float reciprocal, const float (&weights)[4]) {
  const auto near_m = static_cast<float>(out.camera.near_m);
  out.reciprocal[pixel] = reciprocal;
  out.limit[pixel] = encode_depth_code(t.beyond / reciprocal, near_m) << 8;
  const uint32_t colours[4] = {t.c[0]->colour, t.c[1]->colour, t.c[2]->colour};
  out.colour[pixel] = mixed(colours, weights, 3);
}

void BackdropPainter::Band::draw(const Seen& seen, const Corner* corners, const glm::vec3& eye, size_t planes) {
  const BasePart& part = *seen.part;
  if (seen.bottom < first || seen.top >= last) return;
  const auto near_m = static_cast<float>(out.camera.near_m);
  for (const Drawn& drawn : seen.drawn) {
    if (drawn.bounds.bottom < first || drawn.bounds.top >= last) continue;
    const uint16_t* v = &part.indices[drawn.first];
    Triangle t{{corners + v[0], corners + v[1], corners + v[2]}, {}, seen.clipped ? planes : 0, kNone, drawn.bounds};
    t.bounds.top = std::max(t.bounds.top, first), t.bounds.bottom = std::min(t.bounds.bottom, last - 1);
    for (size_t k = 0; k < 3; ++k)
      if (seen.clipped) t.inside[k] = &seen.inside_m[planes * v[k]];
    const auto& b = drawn.bounds;
    const int side = 1 + std::max(b.right - b.left, b.bottom - b.top);
    if (side << out.halvings >= kLeastSeenThrough_px) {
      // Depths of a plane that lies farther away are greater by the same factor everywhere.
      const glm::vec4& plane = part.planes[drawn.first / 3];
      const float away = std::abs(glm::dot(glm::vec3(plane), eye) - plane.w);
      if (away > 0) t.beyond = kBeyond * (away + kErrors * seen.error_m) / away;
    }
    const bool is_small =
        side <= kSmall_px && !seen.clipped && t.c[0]->w > near_m && t.c[1]->w > near_m && t.c[2]->w > near_m;
    is_small ? draw_small(t) : draw(t);
  }
}

// Few pixels: colours are taken to be linear in the picture.
void BackdropPainter::Band::draw_small(const Triangle& t) {
  constexpr float kEdge = -1e-4f;  // rounding leaves no gap between triangles
  const float x0 = static_cast<float>(t.bounds.left) + 0.5f, y0 = static_cast<float>(t.bounds.top) + 0.5f;
  float x[3], y[3], reciprocals[3];
  for (int k = 0; k < 3; ++k) x[k] = t.c[k]->x - x0, y[k] = t.c[k]->y - y0, reciprocals[k] = t.c[k]->reciprocal;
  const float area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0]);
  if (area == 0) return;
  // Corners may lie far outside the picture.
  const float far =
      std::max({std::abs(x[0]), std::abs(x[1]), std::abs(x[2]), std::abs(y[0]), std::abs(y[1]), std::abs(y[2])});
  if (far > 2 * kSmall_px || std::abs(area) < 1e-3f) return draw(t);
  // Function k is 1 at corner k and 0 at the others.
  float at[3], along_x[3], along_y[3];
  for (int k = 0; k < 3; ++k) {
    const int a = (k + 1) % 3, b = (k + 2) % 3;
    along_x[k] = (y[a] - y[b]) / area, along_y[k] = (x[b] - x[a]) / area;
    at[k] = (x[a] * y[b] - x[b] * y[a]) / area;
  }
  for (int row = t.bounds.top; row <= t.bounds.bottom; ++row) {
    float weights[4] = {at[0], at[1], at[2]};
    size_t pixel =
        static_cast<size_t>(row) * static_cast<size_t>(out.camera.width) + static_cast<size_t>(t.bounds.left);
    for (int column = t.bounds.left; column <= t.bounds.right; ++column, ++pixel) {
      if (weights[0] >= kEdge && weights[1] >= kEdge && weights[2] >= kEdge) {
        const float reciprocal =
            weights[0] * reciprocals[0] + weights[1] * reciprocals[1] + weights[2] * reciprocals[2];
        if (reciprocal > out.reciprocal[pixel]) set(pixel, t, reciprocal, weights);
      }
      for (int k = 0; k < 3; ++k) weights[k] += along_x[k];
    }
    for (int k = 0; k < 3; ++k) at[k] += along_y[k];
  }
}

void BackdropPainter::Band::draw(const Triangle& t) {
  const auto& c = t.c;
  // Function k is 1 / w at corner k and 0 at the others, linear in the picture: their sum is 1 / w.
  const auto place = [](const Corner* v) { return glm::dvec3(double{v->xw}, double{v->yw}, double{v->w}); };
  const glm::dvec3 a = place(c[0]), b = place(c[1]), d = place(c[2]);
  glm::dvec3 functions[3] = {glm::cross(b, d), glm::cross(d, a), glm::cross(a, b)};
  const double volume = glm::dot(a, functions[0]);
  if (volume == 0) return;
  const double scale = 1 / volume;
  for (auto& f : functions) f *= scale;
  const auto most = static_cast<float>(1 / out.camera.near_m);  // what lies before the near plane covers nothing
  for (int y = t.bounds.top; y <= t.bounds.bottom; ++y) {
    double begin = t.bounds.left, end = t.bounds.right;
    double value[3];  // at pixel 0 of the row
    for (int k = 0; k < 3; ++k) {
      const glm::dvec3& f = functions[k];
      value[k] = 0.5 * f.x + (y + 0.5) * f.y + f.z;
      if (f.x > 0)
        begin = std::max(begin, -value[k] / f.x);
      else if (f.x < 0)
        end = std::min(end, -value[k] / f.x);
      else if (value[k] < 0)
        end = -1;
    }
    if (begin > end) continue;
    const size_t row = static_cast<size_t>(y) * static_cast<size_t>(out.camera.width);
    // Rounding by conversion: std::ceil() is a call.
    int x = static_cast<int>(begin);
    if (x < begin) ++x;
    for (; x <= static_cast<int>(end); ++x) {
      float weights[4];
      for (int k = 0; k < 3; ++k) weights[k] = static_cast<float>(value[k] + x * functions[k].x);
      const float reciprocal = weights[0] + weights[1] + weights[2];
      const size_t pixel = row + static_cast<size_t>(x);
      if (reciprocal <= out.reciprocal[pixel] || reciprocal > most) continue;
      bool is_kept = true;
      for (size_t p = 0; p < t.planes; ++p)
        is_kept &= weights[0] * t.inside[0][p] + weights[1] * t.inside[1][p] + weights[2] * t.inside[2][p] >= 0;
      if (!is_kept) continue;
      for (float& weight : weights) weight = std::clamp(weight / reciprocal, 0.0f, 1.0f);
      set(pixel, t, reciprocal, weights);
    }
  }
}

void BackdropPainter::transform(Seen& seen, const geometry::Clip& clip, const geometry::Camera& camera,
                                const image::Shading& shading) {
  const BasePart& part = *seen.part;
  const auto t = camera.room_to_pixel();
  const glm::vec4 tx(t.x), ty(t.y), tw(t.w);
  for (size_t v = 0; v < part.positions.size(); ++v) {
    const glm::vec3& p = part.positions[v];
    Corner& c = corners_[seen.first + v];
    c.xw = glm::dot(glm::vec3(tx), p) + tx.w, c.yw = glm::dot(glm::vec3(ty), p) + ty.w;
    c.w = glm::dot(glm::vec3(tw), p) + tw.w;
    c.reciprocal = 1 / c.w;
    c.x = c.xw * c.reciprocal, c.y = c.yw * c.reciprocal;
    c.is_lit = false;
    if (seen.clipped)
      for (const geometry::ClipPlane& plane : clip.planes)
        seen.inside_m.push_back(static_cast<float>(plane.inside_m(glm::dvec3(p))));
  }
  const glm::vec3 eye(camera.pose.position_room);
  for (size_t i = 0; i < part.indices.size(); i += 3) {
    if (seen.hidden && (*seen.hidden)[i / 3 / 64] >> (i / 3 % 64) & 1) continue;
    const uint16_t* v = &part.indices[i];
    Corner* const c[3] = {&corners_[seen.first + v[0]], &corners_[seen.first + v[1]], &corners_[seen.first + v[2]]};
    const auto bounds = bounds_of(c, camera);
    if (!bounds) continue;
    seen.drawn.push_back({static_cast<uint32_t>(i), *bounds});
    seen.top = std::min(seen.top, bounds->top), seen.bottom = std::max(seen.bottom, bounds->bottom);
    for (size_t k = 0; k < 3; ++k) {
      if (std::exchange(c[k]->is_lit, true)) continue;
      const glm::vec3& n = part.normals[v[k]];
      const float light = shading.intensity(glm::dot(n, eye - part.positions[v[k]]) < 0 ? -n : n);
      c[k]->colour = image::Shading::apply(part.colours[v[k]], static_cast<uint32_t>(255 * light + 0.5f));
    }
  }
}

// Returns the pixels that a triangle may cover. Nothing: it covers none, or lies before the near plane.
std::optional<BackdropPainter::Bounds> BackdropPainter::bounds_of(const Corner* const (&c)[3],
                                                                  const geometry::Camera& camera) {
  const auto near_m = static_cast<float>(camera.near_m);
  float x0 = kNone, x1 = -kNone, y0 = kNone, y1 = -kNone;
  const auto extend = [&](float x, float y) {
    x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
  };
  for (size_t k = 0; k < 3; ++k) {
    const Corner &a = *c[k], &b = *c[(k + 1) % 3];
    if (a.w > near_m) extend(a.x, a.y);
    if ((a.w > near_m) == (b.w > near_m)) continue;
    const float part = (near_m - a.w) / (b.w - a.w);  // share of the edge that lies before the near plane
    extend((a.xw + part * (b.xw - a.xw)) / near_m, (a.yw + part * (b.yw - a.yw)) / near_m);
  }
  const auto width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
  if (!(x1 > 0 && y1 > 0 && x0 < width && y0 < height)) return {};
  // From the first pixel's centre within to the last one's; a little more does no harm.
  constexpr float kHalf = 0.499f;
  const auto begin = [](float least) { return static_cast<int>(std::max(least, 0.0f) + kHalf); };
  const auto end = [](float most, float limit) { return static_cast<int>(std::min(most, limit) - kHalf); };
  const Bounds out{begin(x0), std::min(end(x1, width), camera.width - 1), begin(y0),
                   std::min(end(y1, height), camera.height - 1)};
  return out.left > out.right || out.top > out.bottom ? std::nullopt : std::optional(out);
}

// Finds the parts that may be in view and are fine enough, or the finest. Returns the number of their vertices.
size_t BackdropPainter::look(const BaseMesh& mesh, const geometry::Clip& clip, const geometry::Camera& picture) {
  const geometry::Frustum frustum(picture);
  const double fine = fine_enough(picture);
  seen_.clear();
  size_t vertices = 0;
  open_.clear();
  for (size_t n = 0; n < mesh.roots; ++n) open_.push_back({n, nullptr});
  while (!open_.empty()) {
    const auto [n, parent] = open_.back();
    const BaseNode& node = mesh.nodes[n];
    open_.pop_back();
    if (!frustum.may_contain(node.box_room)) continue;
    bool opens = false;
    for (const BaseNode::Part& p : node.parts) {
      // The surface may lie an error beside its triangles, and those of the children with it.
      const glm::vec3 beside(node.error_m);
      const geometry::Box box{p.triangles->box_room.lo - beside, p.triangles->box_room.hi + beside};
      if (!frustum.may_contain(box)) continue;
      const double away = distance_m(box, picture.pose.position_room);
      // All of the parent's parts with these triangles are fine enough.
      if (parent && double{parent->error_m} <= fine * (away - parent->part_m - double{parent->error_m})) continue;
      if (node.children > 0 && double{node.error_m} > fine * away) {
        opens = true;
        continue;
      }
      const auto kept = clip.empty() ? geometry::Clip::Part::kAll : clip.part_of(box);
      if (kept == geometry::Clip::Part::kNone) continue;
      const bool clipped = kept == geometry::Clip::Part::kSome;
      seen_.push_back({p.triangles.get(), p.hidden.get(), node.error_m, vertices, clipped, {}, {}, picture.height, -1});
      vertices += p.triangles->positions.size();
    }
    for (uint32_t i = 0; opens && i < node.children; ++i) open_.push_back({node.first_child + i, &node});
  }
  return vertices;
}

void BackdropPainter::paint(const BaseMesh& mesh, const geometry::Clip& clip, const geometry::Camera& picture,
                            const image::Shading& shading, Crew& crew, Backdrop& out) {
  out.halvings = halvings(picture);
  out.camera = picture;
  for (int n = 0; n < out.halvings; ++n) out.camera = geometry::half_size(out.camera);
  const auto pixels = static_cast<size_t>(out.camera.width) * static_cast<size_t>(out.camera.height);
  out.colour.resize(pixels);
  out.reciprocal.assign(pixels, 0);
  out.limit.assign(pixels, kEmptyInfo);
  if (const size_t vertices = look(mesh, clip, picture); corners_.size() < vertices) corners_.resize(vertices);
  crew.run(seen_.size(), [&](size_t i, int) { transform(seen_[i], clip, out.camera, shading); });
  const glm::vec3 eye(picture.pose.position_room);
  const size_t bands = kBandsAThread * static_cast<size_t>(crew.threads());
  crew.run(bands, [&](size_t i, int) {
    const auto row = [&](size_t n) { return static_cast<int>(static_cast<size_t>(out.camera.height) * n / bands); };
    Band band{out, row(i), row(i + 1)};
    for (const Seen& seen : seen_) band.draw(seen, &corners_[seen.first], eye, clip.planes.size());
  });
}

void fill_from(const Backdrop& b, const geometry::Rect& rect, float near_m, const ResolvedTile& tile, int grow) {
  const int last_x = b.camera.width - 1, last_y = b.camera.height - 1;
  const float scale = 1 / static_cast<float>(1 << b.halvings);
  const auto width = static_cast<size_t>(b.camera.width);
  const auto clamped = [](int at, int last) { return static_cast<size_t>(std::clamp(at, 0, last)); };
  for (int y = -grow; y < tile.height + grow; ++y) {
    uint32_t* colour = tile.colour(y);
    uint32_t* info = tile.info(y);
    const float v = (static_cast<float>(rect.y + y) + 0.5f) * scale - 0.5f;
    const int above = static_cast<int>(std::floor(v));
    const size_t rows[2] = {width * clamped(above, last_y), width * clamped(above + 1, last_y)};
    const size_t row = width * clamped((rect.y + y) >> b.halvings, last_y);
    const float fy = v - static_cast<float>(above);
    for (int x = -grow; x < tile.width + grow; ++x) {
      const size_t place = row + clamped((rect.x + x) >> b.halvings, last_x);
      if (info[x] <= b.limit[place]) continue;  // empty ones are greater
      const float own = b.reciprocal[place];
      const float u = (static_cast<float>(rect.x + x) + 0.5f) * scale - 0.5f;
      const int before = static_cast<int>(std::floor(u));
      const float fx = u - static_cast<float>(before);
      const size_t columns[2] = {clamped(before, last_x), clamped(before + 1, last_x)};
      uint32_t colours[4];
      float weights[4], sum = 0, reciprocal = 0;
      for (size_t k = 0; k < 4; ++k) {
        const size_t at = rows[k / 2] + columns[k % 2];
        colours[k] = b.colour[at];
        const bool same = std::abs(b.reciprocal[at] - own) < kSurface * own;
        weights[k] = same ? (k / 2 ? fy : 1 - fy) * (k % 2 ? fx : 1 - fx) : 0;
        sum += weights[k], reciprocal += weights[k] * b.reciprocal[at];
      }
      for (float& weight : weights) weight /= sum;
      colour[x] = mixed(colours, weights, 4);
      info[x] = encode_depth_code(sum / reciprocal, near_m) << 8;
    }
  }
}

}  // namespace telesplat::splat
