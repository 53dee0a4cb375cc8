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
constexpr float kNone = std::numeric_limits<float>::infinity();

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
};

void BackdropPainter::Band::draw(const Seen& seen, const Corner* corners, const glm::vec3& eye, size_t planes) {
  const BasePart& part = *seen.part;
  for (const Drawn& drawn : seen.drawn) {
    if (drawn.bounds.bottom < first || drawn.bounds.top >= last) continue;
    const uint16_t* v = &part.indices[drawn.first];
    Triangle t{{corners + v[0], corners + v[1], corners + v[2]}, {}, seen.clipped ? planes : 0, kNone, drawn.bounds};
    t.bounds.top = std::max(t.bounds.top, first), t.bounds.bottom = std::min(t.bounds.bottom, last - 1);
    for (size_t k = 0; k < 3; ++k)
      if (seen.clipped) t.inside[k] = &seen.inside_m[planes * v[k]];
    // Depths of a plane that lies farther away are greater by the same factor everywhere.
    const glm::vec4& plane = part.planes[drawn.first / 3];
    const float away = std::abs(glm::dot(glm::vec3(plane), eye) - plane.w);
    const auto& b = drawn.bounds;
    const bool is_large = (1 + std::max(b.right - b.left, b.bottom - b.top)) << out.halvings >= kLeastSeenThrough_px;
    if (is_large && away > 0) t.beyond = kBeyond * (away + kErrors * part.error_m) / away;
    draw(t);
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
  const uint32_t colours[4] = {c[0]->colour, c[1]->colour, c[2]->colour};
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
      float& nearest = out.reciprocal[row + static_cast<size_t>(x)];
      if (reciprocal <= nearest || reciprocal > most) continue;
      bool is_kept = true;
      for (size_t p = 0; p < t.planes; ++p)
        is_kept &= weights[0] * t.inside[0][p] + weights[1] * t.inside[1][p] + weights[2] * t.inside[2][p] >= 0;
      if (!is_kept) continue;
      nearest = reciprocal;
      out.limit_m[row + static_cast<size_t>(x)] = t.beyond / reciprocal;
      for (float& weight : weights) weight = std::clamp(weight / reciprocal, 0.0f, 1.0f);
      out.colour[row + static_cast<size_t>(x)] = mixed(colours, weights, 3);
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
    c.x = c.xw / c.w, c.y = c.yw / c.w;
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
  const Bounds all{0, camera.width - 1, 0, camera.height - 1};
  if (c[0]->w <= near_m || c[1]->w <= near_m || c[2]->w <= near_m)
    return c[0]->w > near_m || c[1]->w > near_m || c[2]->w > near_m ? std::optional(all) : std::nullopt;
  const auto [x0, x1] = std::minmax({c[0]->x, c[1]->x, c[2]->x});
  const auto [y0, y1] = std::minmax({c[0]->y, c[1]->y, c[2]->y});
  const auto width = static_cast<float>(camera.width), height = static_cast<float>(camera.height);
  if (!(x1 > 0 && y1 > 0 && x0 < width && y0 < height)) return {};
  // From the first pixel's centre within to the last one's; a little more does no harm.
  constexpr float kHalf = 0.499f;
  const auto begin = [](float least) { return static_cast<int>(std::max(least, 0.0f) + kHalf); };
  const auto end = [](float most, float limit) { return static_cast<int>(std::min(most, limit) - kHalf); };
  const Bounds out{begin(x0), std::min(end(x1, width), all.right), begin(y0), std::min(end(y1, height), all.bottom)};
  return out.left > out.right || out.top > out.bottom ? std::nullopt : std::optional(out);
}

void BackdropPainter::paint(const BaseMesh& mesh, const geometry::Clip& clip, const geometry::Camera& picture,
                            const image::Shading& shading, Crew& crew, Backdrop& out) {
  out.halvings = int64_t{picture.width} * picture.height > kMostHalved ? 2 : 1;
  out.camera = picture;
  for (int n = 0; n < out.halvings; ++n) out.camera = geometry::half_size(out.camera);
  const auto pixels = static_cast<size_t>(out.camera.width) * static_cast<size_t>(out.camera.height);
  out.colour.resize(pixels);
  out.reciprocal.assign(pixels, 0);
  out.limit_m.resize(pixels);
  const geometry::Frustum frustum(out.camera);
  seen_.clear();
  size_t vertices = 0;
  for (size_t n = 0; n < mesh.parts.size(); ++n) {
    const auto& part = mesh.parts[n];
    const auto kept = clip.empty() ? geometry::Clip::Part::kAll : clip.part_of(part->box_room);
    if (kept == geometry::Clip::Part::kNone || !frustum.may_contain(part->box_room)) continue;
    const std::vector<uint64_t>* hidden = n < mesh.hidden.size() && !mesh.hidden[n].empty() ? &mesh.hidden[n] : nullptr;
    seen_.push_back({part.get(), hidden, vertices, kept == geometry::Clip::Part::kSome, {}, {}});
    vertices += part->positions.size();
  }
  if (corners_.size() < vertices) corners_.resize(vertices);
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
      const float own = b.reciprocal[place];
      if (own == 0 || own * near_m > 1) continue;
      if (info[x] <= encode_depth_code(b.limit_m[place], near_m) << 8) continue;  // empty ones are greater
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
