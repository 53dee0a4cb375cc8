#include "services/data/mesh/out_of_core/partition.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "common/parallel/in_parallel.h"
#include "services/data/base/mesh.h"

namespace telesplat::data {
namespace {

constexpr size_t kTriangles = 1 << 20;  // in a block

size_t left_of(size_t parts) { return std::bit_floor(parts - 1); }

// Notes for each vertex the part whose triangles have it, or that there are several.
class PartsOfVertices {
 public:
  static constexpr uint16_t kNone = 0, kSeveral = 0xffff;
  explicit PartsOfVertices(uint64_t vertices) : part_(vertices, kNone) {}
  /// Threads may note at once: what is kept does not depend on their order.
  void note(uint32_t vertex, uint32_t part) {
    const std::atomic_ref<uint16_t> kept(part_[vertex]);
    const auto own = static_cast<uint16_t>(part + 1);
    uint16_t before = kNone;
    if (kept.load(std::memory_order_relaxed) == own || kept.compare_exchange_strong(before, own)) return;
    if (before != own) kept.store(kSeveral, std::memory_order_relaxed);
  }
  bool several(uint32_t vertex) const { return part_[vertex] == kSeveral; }

 private:
  std::vector<uint16_t> part_;
};

// The triangles that have a vertex of several parts.
class BorderTriangles {
 public:
  BorderTriangles(const PartsOfVertices& vertices, size_t parts) : vertices_(vertices), around_(parts) {}
  void add(uint32_t triangle, const uint32_t* corners, const std::function<uint32_t()>& part) {
    if (corners[0] == RandomMesh::kNoTriangle) return;
    if (!vertices_.several(corners[0]) && !vertices_.several(corners[1]) && !vertices_.several(corners[2])) return;
    const uint32_t own = part();
    triangles_.push_back({triangle, own, {corners[0], corners[1], corners[2]}});
    for (int k = 0; k < 3; ++k)
      if (vertices_.several(corners[k])) parts_.emplace_back(corners[k], own);
  }
  size_t size() const { return triangles_.size(); }
  std::vector<std::vector<uint32_t>> around() {
    std::sort(parts_.begin(), parts_.end());
    parts_.erase(std::unique(parts_.begin(), parts_.end()), parts_.end());
    for (const Border& t : triangles_)
      for (const uint32_t vertex : t.corners) {
        auto at = std::lower_bound(parts_.begin(), parts_.end(), std::pair(vertex, uint32_t{0}));
        for (; at != parts_.end() && at->first == vertex; ++at) {
          auto& list = around_[at->second];
          if (at->second != t.part && (list.empty() || list.back() != t.triangle)) list.push_back(t.triangle);
        }
      }
    return std::move(around_);
  }

 private:
  struct Border {
    uint32_t triangle, part;
    uint32_t corners[3];
  };
  const PartsOfVertices& vertices_;
  std::vector<Border> triangles_;
  std::vector<std::pair<uint32_t, uint32_t>> parts_;  // vertex of several parts, and one of these
  std::vector<std::vector<uint32_t>> around_;
};

}  // namespace

PartTree::PartTree(std::vector<glm::vec3> points, size_t parts) : parts_(parts), splits_(parts) {
  CHECK(!points.empty() && parts >= 1);
  divide(points, 0, parts);
}

// Empty halves get splits, too: all that comes then goes to one side.
void PartTree::divide(std::span<glm::vec3> points, size_t node, size_t parts) {
  if (parts == 1) return;
  geometry::Box box;
  for (const glm::vec3& p : points) box.extend(p);
  const glm::vec3 size = points.empty() ? glm::vec3(0) : box.size();
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const size_t left = left_of(parts), middle = points.size() * left / parts;
  std::nth_element(points.begin(), points.begin() + middle, points.end(),
                   [axis](const glm::vec3& a, const glm::vec3& b) { return a[axis] < b[axis]; });
  splits_[node] = {axis, middle < points.size() ? points[middle][axis] : 0};
  divide(points.first(middle), node + 1, left);
  divide(points.subspan(middle), node + left, parts - left);
}

uint32_t PartTree::part_of(const glm::vec3& point) const {
  size_t node = 0, first = 0;
  for (size_t parts = parts_; parts > 1;) {
    const size_t left = left_of(parts);
    const Split& split = splits_[node];
    if (point[split.axis] < split.at)
      node += 1, parts = left;
    else
      node += left, first += left, parts -= left;
  }
  return static_cast<uint32_t>(first);
}

Result<ScratchLists> ScratchLists::make(const std::string& folder, size_t lists) {
  std::string name = (std::filesystem::path(folder) / "scratch-XXXXXX").string();
  Descriptor file(mkostemp(name.data(), O_CLOEXEC));
  if (!file.valid()) return Error{fmt::format("no scratch file {}: {}", name, std::strerror(errno))};
  unlink(name.c_str());
  return ScratchLists(std::move(file), lists);
}

void ScratchLists::flush(size_t list) {
  const size_t bytes = kBlock * sizeof(uint32_t);
  const ssize_t n = failure_ ? 0 : pwrite(file_.get(), open_[list].data(), bytes, static_cast<off_t>(end_));
  if (!failure_ && n != static_cast<ssize_t>(bytes)) failure_ = n < 0 ? errno : ENOSPC;
  blocks_[list].push_back(end_);
  end_ += bytes;
  open_[list].clear();
}

Result<std::vector<uint32_t>> ScratchLists::take(size_t list) const {
  std::vector<uint32_t> out(size(list));
  int failure = failure_;
  const size_t bytes = kBlock * sizeof(uint32_t);
  uint32_t* at = out.data();
  for (const uint64_t block : blocks_[list]) {
    if (failure == 0 && pread(file_.get(), at, bytes, static_cast<off_t>(block)) != static_cast<ssize_t>(bytes))
      failure = errno ? errno : EIO;
    at += kBlock;
  }
  if (failure) return Error{fmt::format("its scratch file of {} bytes: {}", end_, std::strerror(failure))};
  std::copy(open_[list].begin(), open_[list].end(), at);
  return out;
}

bool for_blocks(const RandomMesh& mesh, const std::function<void(uint64_t, std::span<const uint32_t>)>& turn) {
  std::vector<uint32_t> corners(3 * std::min<uint64_t>(kTriangles, mesh.triangles()));
  for (uint64_t first = 0; first < mesh.triangles(); first += kTriangles) {
    const size_t count = std::min<uint64_t>(kTriangles, mesh.triangles() - first);
    if (!mesh.corners(first, count, corners.data())) return false;
    turn(first, std::span(corners).first(3 * count));
    mesh.drop_pages();
  }
  return true;
}

glm::vec3 centroid(const RandomMesh& mesh, const uint32_t* corners) {
  return glm::vec3((mesh.position(corners[0]) + mesh.position(corners[1]) + mesh.position(corners[2])) / 3.0);
}

Result<std::optional<Partition>> divide(const RandomMesh& mesh, const PartTree& tree, const std::string& folder,
                                        const std::function<void(double)>& progress) {
  auto own = ScratchLists::make(folder, tree.parts());
  if (!own) return own.error();
  Partition out{*std::move(own), {}};
  PartsOfVertices vertices(mesh.vertices());
  std::vector<uint16_t> parts(std::min<uint64_t>(kTriangles, mesh.triangles()));
  const double all = 2 * static_cast<double>(mesh.triangles());
  for_blocks(mesh, [&](uint64_t first, std::span<const uint32_t> corners) {
    progress(static_cast<double>(first) / all);
    const size_t count = corners.size() / 3;
    in_parallel(size_t{0}, count, [&](size_t t) {
      if (corners[3 * t] == RandomMesh::kNoTriangle) return;
      const uint32_t part = tree.part_of(centroid(mesh, &corners[3 * t]));
      parts[t] = static_cast<uint16_t>(part);
      for (size_t k = 0; k < 3; ++k) vertices.note(corners[3 * t + k], part);
    });
    for (size_t t = 0; t < count; ++t)
      if (corners[3 * t] != RandomMesh::kNoTriangle) out.own.add(parts[t], static_cast<uint32_t>(first + t));
  });
  BorderTriangles border(vertices, tree.parts());
  for_blocks(mesh, [&](uint64_t first, std::span<const uint32_t> corners) {
    progress(0.5 + static_cast<double>(first) / all);
    for (size_t t = 0; t < corners.size() / 3 && border.size() <= mesh.triangles() / 4; ++t)
      border.add(static_cast<uint32_t>(first + t), &corners[3 * t],
                 [&] { return tree.part_of(centroid(mesh, &corners[3 * t])); });
  });
  if (border.size() > mesh.triangles() / 4) return std::optional<Partition>();
  out.around = border.around();
  return std::optional(std::move(out));
}

}  // namespace telesplat::data
