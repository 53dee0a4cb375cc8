#include "tools/lab/simulation/scenes/surface.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <limits>
#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "common/colour/colour_map.h"
#include "common/core/check.h"
#include "common/geometry/chunk_code.h"
#include "common/image/normal.h"
#include "services/data/mesh/served_mesh.h"
#include "services/sampler/mesh/chunk_input.h"
#include "tools/lab/simulation/scenes/surface_parts.h"

namespace telesplat::simulation {
namespace {

constexpr double kCube_m = 0.05;      // side of the checkerboard's cubes
constexpr double kRounding_m = 1e-9;  // margin of depths, for rounding

uint64_t hash_of(const SurfaceParts& surface) {  // FNV-1a
  uint64_t hash = 0xcbf29ce484222325;
  for (const auto& bytes : surface.bytes)
    for (const std::byte b : bytes) hash = (hash ^ std::to_integer<uint64_t>(b)) * 0x100000001b3;
  return hash;
}

// The store of a mesh without its file.
class SurfaceStore final : public data::MeshStore {
 public:
  explicit SurfaceStore(const SurfaceParts& surface) : surface_(surface), chunks_(surface.chunks) {
    chunks_.back().triangles = geometry::decode_chunk(root())->view.triangles();
    chunks_.back().bytes = root().size();
    info_.content_hash = hash_of(surface);
    info_.triangles = surface.triangles;
    info_.vertices = 2 * surface.triangles;
    info_.box_room = surface.box_room;
    info_.box_data = {glm::dvec3(surface.box_room.lo), glm::dvec3(surface.box_room.hi)};
    info_.format = "surface";
    info_.up = "y";
  }
  const data::MeshStoreInfo& info() const override { return info_; }
  const std::vector<geometry::ChunkInfo>& chunks() const override { return chunks_; }
  geometry::ChunkBytes chunk(ChunkId id) const override {
    const bool is_root = id.value + 1 == surface_.chunks.size();
    return {is_root ? root() : surface_.bytes[size_t(id.value)], nullptr};
  }

 private:
  std::span<const std::byte> root() const;

  const SurfaceParts& surface_;
  std::vector<geometry::ChunkInfo> chunks_;
  data::MeshStoreInfo info_;
};

// Where a ray first meets the surface.
struct Hit {
  const SurfacePart* part = nullptr;
  double depth_m = std::numeric_limits<double>::infinity();
};

// A camera's rays through its pixels `rect`. They meet only parts that these pixels may show. A ray's parameter is
// depth in metres.
class Rays {
 public:
  Rays(const SurfaceParts& surface, const geometry::Camera& camera, const geometry::Rect& rect,
       const geometry::Clip& clip)
      : eye_(camera.pose.position_room), near_m_(camera.near_m), clip_(clip) {
    const glm::dquat& r = camera.pose.orientation;
    for (int x = rect.x; x < rect.x + rect.width; ++x)
      columns_.push_back(r * glm::dvec3(camera.left + (x + 0.5) / camera.focal_x(), 0, 0));
    for (int y = rect.y; y < rect.y + rect.height; ++y)
      rows_.push_back(r * glm::dvec3(0, camera.top - (y + 0.5) / camera.focal_y(), -1));
    const geometry::Frustum frustum(geometry::crop(camera, rect));
    for (const SurfacePart& part : surface.parts) {
      if (!frustum.may_contain(part.box_room)) continue;
      const glm::dvec3 from = eye_ - part.centre;
      const geometry::DBox box{glm::dvec3(part.box_room.lo), glm::dvec3(part.box_room.hi)};
      const glm::dvec3 ahead = r * glm::dvec3(0, 0, -1), half = 0.5 * box.size();
      seen_.push_back({&part, box, part.square, 2.0 * part.square * from + part.linear,
                       glm::dot(part.square, from * from) + glm::dot(part.linear, from) - part.constant,
                       glm::dot(ahead, box.centre() - eye_) - glm::dot(glm::abs(ahead), half) - kRounding_m,
                       part.square == glm::dvec3(0)});
    }
    std::stable_sort(seen_.begin(), seen_.end(),
                     [](const Seen& a, const Seen& b) { return a.nearest_m < b.nearest_m; });
  }

  /// The pixel is counted from the rectangle's corner.
  glm::dvec3 direction(int x, int y) const { return columns_[size_t(x)] + rows_[size_t(y)]; }
  glm::dvec3 at(const glm::dvec3& direction, double depth_m) const { return eye_ + depth_m * direction; }

  Hit trace(const glm::dvec3& direction) const {
    double begin = near_m_;
    Hit hit;
    if (!clip_.empty()) {
      const auto kept = clip_.stretch(eye_, direction);
      begin = std::max(begin, kept.begin), hit.depth_m = kept.end;
    }
    const glm::dvec3 squares = direction * direction;
    for (const Seen& seen : seen_) {
      const auto meets = [&](double t) {
        if (t >= begin && t < hit.depth_m && is_there(seen, at(direction, t))) hit = {seen.part, t};
      };
      if (seen.nearest_m > hit.depth_m) break;
      // a t^2 + b t + value = 0, without cancellation.
      const double b = glm::dot(seen.gradient, direction);
      if (seen.flat) {
        meets(-seen.value / b);
        continue;
      }
      const double a = glm::dot(seen.square, squares), discriminant = b * b - 4 * a * seen.value;
      if (!(discriminant >= 0)) continue;
      const double root = std::sqrt(discriminant), q = -0.5 * (b < 0 ? b - root : b + root);
      meets(q / a);
      meets(seen.value / q);
    }
    return hit;
  }

 private:
  struct Seen {
    const SurfacePart* part;
    geometry::DBox box_room;
    glm::dvec3 square;
    glm::dvec3 gradient;  // gradient of the part's function at the eye
    double value;         // likewise
    double nearest_m;     // depth of the box's nearest corner
    bool flat;            // square is 0
  };

  static bool is_there(const Seen& seen, const glm::dvec3& p) {
    const auto& [lo, hi] = seen.box_room;
    if (!(p.x >= lo.x && p.x <= hi.x && p.y >= lo.y && p.y <= hi.y && p.z >= lo.z && p.z <= hi.z)) return false;
    if (seen.part->pitch == 0) return true;
    const double along = (p.x - lo.x) / seen.part->pitch;
    return (along - double(int(along))) * seen.part->pitch < seen.part->width;
  }

  glm::dvec3 eye_;
  double near_m_;
  const geometry::Clip& clip_;
  std::vector<glm::dvec3> columns_, rows_;
  std::vector<Seen> seen_;
};

// 0..255 a channel, in cubes of two colours, darker towards the floor.
glm::dvec3 colour_at(const SurfacePart& part, const glm::dvec3& p) {
  const auto cube = [](double v) { return int(v / kCube_m + 1000.5); };
  const uint32_t c = part.colours[(cube(p.x) + cube(p.y) + cube(p.z)) % 2];
  return (0.8 + 0.4 * p.y) * glm::dvec3(c >> 16 & 255, c >> 8 & 255, c & 255);
}

// Unit length, facing the eye.
glm::dvec3 normal_at(const SurfacePart& part, const glm::dvec3& p, const glm::dvec3& direction) {
  const glm::dvec3 n = 2.0 * part.square * (p - part.centre) + part.linear;
  return n / (glm::dot(n, direction) > 0 ? -std::sqrt(glm::dot(n, n)) : std::sqrt(glm::dot(n, n)));
}

uint32_t rounded(const glm::dvec3& colour) {
  return uint32_t(colour.x + 0.5) << 16 | uint32_t(colour.y + 0.5) << 8 | uint32_t(colour.z + 0.5);
}

// Makes a mesh of all that six cameras around the room see, with the surface's box.
std::vector<std::byte> make_coarse(const SurfaceParts& surface) {
  constexpr int kSide = 32;      // pixels
  constexpr double kAway_m = 1;  // from the room's origin: they see 0.5 m to each side
  constexpr double kHalf = 0.7071067811865476;
  constexpr double kStep_m = 0.1;  // between neighbouring depths of one surface, at most
  const std::pair<glm::dvec3, glm::dquat> places[] = {
      {{0, 0, kAway_m}, {1, 0, 0, 0}},          {{0, 0, -kAway_m}, {0, 0, 1, 0}},
      {{kAway_m, 0, 0}, {kHalf, 0, kHalf, 0}},  {{-kAway_m, 0, 0}, {kHalf, 0, -kHalf, 0}},
      {{0, kAway_m, 0}, {kHalf, -kHalf, 0, 0}}, {{0, -kAway_m, 0}, {kHalf, kHalf, 0, 0}}};
  const geometry::Clip nothing;
  const auto& [lo, hi] = surface.box_room;
  std::vector<float> positions{lo.x, lo.y, lo.z, hi.x, hi.y, hi.z};
  std::vector<uint32_t> normals(2), colours(2), indices;
  for (const auto& [position, orientation] : places) {
    const geometry::Camera camera{{position, orientation}, -0.5, 0.5, -0.5, 0.5, 0.02, kSide, kSide};
    const Rays rays(surface, camera, {0, 0, kSide, kSide}, nothing);
    std::vector<std::pair<uint32_t, double>> above(kSide), row(kSide);  // vertex (0: no hit) and depth
    for (int y = 0; y < kSide; ++y, std::swap(above, row))
      for (int x = 0; x < kSide; ++x) {
        const glm::dvec3 direction = rays.direction(x, y);
        const Hit hit = rays.trace(direction);
        const auto at = size_t(x);
        row[at] = {0, hit.depth_m};
        if (!hit.part) continue;
        row[at].first = uint32_t(normals.size());
        const glm::dvec3 p = rays.at(direction, hit.depth_m);
        for (int axis = 0; axis < 3; ++axis) positions.push_back(std::clamp(float(p[axis]), lo[axis], hi[axis]));
        normals.push_back(image::encode_normal32(glm::vec3(normal_at(*hit.part, p, direction))));
        colours.push_back(rounded(colour_at(*hit.part, p)));
        if (x == 0 || y == 0) continue;
        const std::pair<uint32_t, double> corners[] = {above[at - 1], row[at - 1], row[at], above[at]};
        const auto [least, most] =
            std::minmax({corners[0].second, corners[1].second, corners[2].second, corners[3].second});
        if (!(most - least < kStep_m)) continue;
        for (const int k : {0, 1, 2, 0, 2, 3}) indices.push_back(corners[k].first);
      }
  }
  const auto laid_out = geometry::build_chunk(positions, normals, colours, indices);
  return geometry::encode_chunk(*geometry::MeshChunkView::validate(laid_out));
}

std::span<const std::byte> SurfaceStore::root() const {
  static std::mutex mutex;
  static std::map<const SurfaceParts*, std::vector<std::byte>> made;
  const std::lock_guard lock(mutex);
  auto& bytes = made[&surface_];
  if (bytes.empty()) bytes = make_coarse(surface_);
  return bytes;
}

class SurfaceSampler final : public sampler::Sampler {
 public:
  explicit SurfaceSampler(const SurfaceParts& surface) : surface_(&surface) {}

  const char* name() const override { return "ray"; }
  Status add_chunk(ChunkId id, geometry::ChunkBytes chunk) override {
    const auto held = sampler::hold(id, chunk.bytes);
    if (!held) return held.error();
    boxes_[size_t(id.value)] = held->view.box_room;
    for (const Surface other : {Surface::kSpheres, Surface::kTerrain, Surface::kFence})
      if (!fits(*surface_) && fits(parts_of(other))) surface_ = &parts_of(other);
    return ok_status();
  }
  Status add_chunks(std::vector<std::pair<ChunkId, geometry::ChunkBytes>> chunks) override {
    sampler::Refusals refusals(chunks.size());
    for (auto& [id, bytes] : chunks)
      if (const Status s = add_chunk(id, std::move(bytes)); !s) refusals.add(s.error());
    return refusals.status();
  }
  void remove_chunk(ChunkId id) override { boxes_.erase(size_t(id.value)); }
  void show(const std::vector<ChunkId>& chunks) override {
    shown_.emplace();
    for (const ChunkId id : chunks) shown_->insert(size_t(id.value));
  }
  void set_colours(std::shared_ptr<const scene::ColourTable>) override {}
  void set_clip(const geometry::Clip& clip) override { clip_ = clip; }

  image::DepthImage sample(const geometry::Camera& camera, const geometry::Rect& tile,
                           const image::PixelMask* mask) override {
    image::DepthImage out(tile.width, tile.height);
    const Rays rays(*surface_, camera, tile, clip_);
    for (int y = 0; y < tile.height; ++y)
      for (int x = 0; x < tile.width; ++x) {
        if (mask && !mask->at(x, y)) continue;
        const glm::dvec3 direction = rays.direction(x, y);
        const Hit hit = rays.trace(direction);
        if (!hit.part) continue;
        const bool coarse = !shows(hit.part->chunk);
        if (coarse && !shows(surface_->chunks.size() - 1)) continue;
        const glm::dvec3 p = rays.at(direction, hit.depth_m);
        const size_t pixel = size_t(y) * size_t(tile.width) + size_t(x);
        out.depth[pixel] = image::encode_depth(hit.depth_m, camera.near_m);
        out.colour[pixel] = coarse ? kCoarseColour : rounded(colour_at(*hit.part, p));
        out.normal[pixel] = image::encode_normal16(glm::vec3(normal_at(*hit.part, p, direction)));
      }
    return out;
  }

 private:
  static constexpr uint32_t kCoarseColour = 0xff00ff;  // where it stays, pictures are wrong
  bool shows(size_t chunk) const { return holds(*surface_, chunk) && (!shown_ || shown_->contains(chunk)); }
  bool holds(const SurfaceParts& surface, size_t chunk) const {
    const auto box = boxes_.find(chunk);
    return box != boxes_.end() && chunk < surface.chunks.size() && box->second == surface.chunks[chunk].box_room;
  }
  // Some chunks of two surfaces have the same box.
  bool fits(const SurfaceParts& surface) const {
    return std::all_of(boxes_.begin(), boxes_.end(), [&](const auto& b) { return holds(surface, b.first); });
  }

  const SurfaceParts* surface_;
  std::map<size_t, geometry::Box> boxes_;  // boxes of held chunks
  std::optional<std::set<size_t>> shown_;  // nullopt: all
  geometry::Clip clip_;
};

const char* name_of(Surface surface) {
  constexpr const char* kNames[] = {"spheres", "terrain", "fence"};
  return kNames[size_t(surface)];
}

}  // namespace

std::unique_ptr<data::Served> serve_surface(Surface surface) {
  return data::serve_mesh(
      std::make_shared<SurfaceStore>(parts_of(surface)), name_of(surface),
      {.as_begun = std::nullopt,
       .map = *colour::find_colour_map("viridis"),
       .iso = std::nullopt,
       .open = [](const std::string&, const data::Progress&) -> Result<std::shared_ptr<data::MeshStore>> {
         return Error{"a simulated surface has no arrays"};
       }});
}

std::unique_ptr<sampler::Sampler> sample_surface(Surface surface) {
  return std::make_unique<SurfaceSampler>(parts_of(surface));
}

image::View render_surface(Surface surface, const geometry::Camera& camera, const image::Shading& shading,
                           const geometry::Clip& clip) {
  const size_t pixels = size_t(camera.width) * size_t(camera.height);
  image::View view{camera.width, camera.height, std::vector<uint32_t>(pixels, shading.background()),
                   std::vector<float>(pixels, std::numeric_limits<float>::infinity())};
  const Rays rays(parts_of(surface), camera, {0, 0, camera.width, camera.height}, clip);
  for (int y = 0; y < camera.height; ++y)
    for (int x = 0; x < camera.width; ++x) {
      const glm::dvec3 direction = rays.direction(x, y);
      const Hit hit = rays.trace(direction);
      if (!hit.part) continue;
      const glm::dvec3 p = rays.at(direction, hit.depth_m);
      const size_t pixel = size_t(y) * size_t(camera.width) + size_t(x);
      const float light = shading.intensity(glm::vec3(normal_at(*hit.part, p, direction)));
      view.colour[pixel] = rounded(colour_at(*hit.part, p) * double(light));
      view.depth_m[pixel] = float(hit.depth_m);
    }
  return view;
}

}  // namespace telesplat::simulation
